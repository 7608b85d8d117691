/// isohf view: starts isohf-view, the program that draws.

#include "commands/command.h"
#include "options.h"

namespace isohf::cli {

int command_view(const Arguments& arguments) {
  // Wrong options and --help are answered here; the program of its own starts only to draw.
  if (!view::parse_options(arguments)) return kExitDone;
  become_program("isohf-view", arguments);
}

}  // namespace isohf::cli
