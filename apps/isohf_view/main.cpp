#include <memory>

#include "headless.h"
#include "options.h"
#include "paging/tile_source.h"
#include "program.h"
#include "window.h"

namespace {

int run(const isohf::cli::Arguments& arguments) {
  using namespace isohf::view;
  const std::optional<Options> options = parse_options(arguments);
  if (!options) return isohf::cli::kExitDone;
  check_outputs(*options);
  const std::unique_ptr<TileSource> source = open_archive(options->archive);
  if (options->action != Options::Action::kWindow) return run_headless(*source, *options);
  run_window(*source, *options);
  return isohf::cli::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return isohf::cli::run_program("isohf-view", argc, argv, run);
}
