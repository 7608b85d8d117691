/// isohf view: becomes isohf-view, the program that draws and the only one that links GL.

#include "commands/command.h"

namespace isohf::cli {

Run add_view(CLI::App& line, Common& /*common*/) {
  // Its options are that program's, --help included.
  line.set_help_flag();
  line.set_help_all_flag();
  line.prefix_command()->fallthrough(false);
  return [&line]() -> int { become_program("isohf-view", line.remaining()); };
}

}  // namespace isohf::cli
