#include <cstdio>
#include <exception>
#include <memory>
#include <new>

#include "headless.h"
#include "isohf/base/error.h"
#include "options.h"
#include "tile_source.h"
#include "window.h"

namespace {

int run(int argc, char** argv) {
  using isohf::view::Options;
  const isohf::view::ParsedOptions parsed = isohf::view::parse_options(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  const Options& options = *parsed.options;
  const std::unique_ptr<isohf::view::TileSource> source = isohf::view::open_archive(options.archive);
  if (options.action != Options::Action::kWindow) return isohf::view::run_headless(*source, options);
  isohf::view::run_window(*source, options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "isohf-view: %s\n", error.what());
    return error.code() == isohf::ErrorCode::kCancelled ? 130 : 1;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "isohf-view: out of memory\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "isohf-view: %s\n", error.what());
  }
  return 1;
}
