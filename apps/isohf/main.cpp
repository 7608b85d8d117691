/// isohf: elevation rasters to isometric heightfield archives. The command table; errors to exit codes.

#include <fmt/core.h>
#include <malloc.h>

#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "command.h"
#include "command_line.h"
#include "formats/registry.h"
#include "isohf/base/error.h"
#include "isohf/base/simd.h"
#include "standard_output.h"

namespace isohf::cli {
namespace {

struct Command {
  const char* name;
  const char* summary;
  CommandFunction run;
};

constexpr Command kCommands[] = {
    {"plan", "List tile shapes, or what convert would make of an input", command_plan},
    {"convert", "Turn a raster of elevations into an archive", command_convert},
    {"info", "Say what an archive or a raster holds", command_info},
    {"verify", "Check an archive, and compare it with its source", command_verify},
    {"restore", "Turn an archive back into a raster", command_restore},
    {"export", "Write the surface as a raster of any grid, whole or cut into tiles", command_export},
    {"sample", "Print elevation and normal at places", command_sample},
    {"shade", "Draw a picture of the surface with its shadows", command_shade},
    {"formats", "List what can be read and written", command_formats},
    {"experiment", "Measure iso and ortho meshes against sine waves, as the paper does",
     [](const Arguments& arguments) -> int { become_program("isohf-experiment", arguments); }},
};

constexpr const char* kVersion = "isohf " ISOHF_VERSION "\n";

constexpr const char* kUsage = R"(Usage: isohf COMMAND [arguments] [options]

Turns rasters of elevations (GeoTIFF, OpenEXR, PNG, SRTM .hgt, ...) into archives of isometric heightfield
tiles, and reads, checks and measures such archives.

Commands:
)";

constexpr const char* kAfterCommands = R"(
Common options, after the command:
  -h, --help          The command's arguments, options, defaults and examples
      --json          One JSON document on standard output instead of text
  -q, --quiet         Print nothing but errors
  -v, --verbose       Say more on standard error
      --config FILE   Read options from a TOML or INI file: one 'long-option = value' a line
Of commands that take a while:
  -j, --threads N     Threads (default: all cores); the result does not depend on it
      --progress MODE auto, plain, json or none; on standard error
Of commands that write a file:
      --overwrite     Replace the output where it exists
Of convert:
      --resume        Continue an interrupted run
      --memory SIZE   Stay within that much, as in 400M
Alone:
      --version       Print the version

ISOHF_MODULE_PATH names the folder of the OpenImageIO and PROJ modules (default: beside the program, then ../lib/isohf).
ISOHF_SIMD=off runs the plain twins of vectorised code: slower, and the same bytes.

Results go to standard output, everything else to standard error.
Exit codes: 0 done, 1 failed, 2 wrong usage, 3 verify or restore found differences, 130 interrupted.

Examples:
  isohf plan                              list tile shapes
  isohf plan dem.tif                      what convert would do, without doing it
  isohf convert dem.tif dem.isohf
  isohf verify dem.isohf --against dem.tif
  isohf restore dem.isohf back.tif
  echo "1200.5 340" | isohf sample dem.isohf
)";

void print_usage() {
  StandardOutput out;
  out.write(kUsage);
  for (const Command& command : kCommands) {
    std::string name = std::string("  ") + command.name;
    name.resize(14, ' ');
    out.write(name + command.summary + "\n");
  }
  out.write(kAfterCommands);
  out.finish();
}

/// Keeps freed memory in the process. Tiles come and go by the thousand, a few hundred kilobytes each; the system would
/// clear every page of each anew, a quarter of the time that large inputs take.
void keep_freed_memory() {
#if defined(__GLIBC__)
  constexpr int kMappedFrom = 4 << 20;
  constexpr int kKept = 256 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  ::mallopt(M_TRIM_THRESHOLD, kKept);
#endif
}

/// `setting`: "off" runs the plain twins of vectorised code, for tests and for finding faults.
void choose_simd(const char* setting) {
  const std::string_view text = setting == nullptr ? "on" : setting;
  if (text != "on" && text != "off") {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("the environment variable ISOHF_SIMD is '{}', must be on or off", text));
  }
  set_simd(text == "on");
}

int run(const Arguments& given) {
  keep_freed_memory();
  if (const char* folder = std::getenv("ISOHF_MODULE_PATH"); folder != nullptr) set_module_folder(folder);
  choose_simd(std::getenv("ISOHF_SIMD"));
  Arguments arguments = given;
  if (arguments.empty()) {
    throw Error(ErrorCode::kInvalidArgument, "no command given (isohf --help lists the commands)");
  }
  std::string name = arguments.front();
  arguments.erase(arguments.begin());
  if (name == "--version" || name == "version") {
    StandardOutput out;
    out.write(kVersion);
    out.finish();
    return kExitDone;
  }
  if (name == "--help" || name == "-h" || name == "help") {
    if (name == "help" && !arguments.empty()) {
      name = arguments.front();
      arguments = {"--help"};
    } else {
      print_usage();
      return kExitDone;
    }
  }
  std::vector<std::string> names;
  for (const Command& command : kCommands) {
    if (name == command.name) return command.run(arguments);
    names.emplace_back(command.name);
  }
  if (name.starts_with("-")) {
    throw Error(ErrorCode::kInvalidArgument,
                "found " + name + " where a command is required; options follow the command (isohf --help)");
  }
  const std::string near = nearest_word(name, names);
  throw Error(ErrorCode::kInvalidArgument, "unknown command '" + name + "'" +
                                               (near.empty() ? "" : "; did you mean " + near + "?") +
                                               " (isohf --help lists the commands)");
}

}  // namespace
}  // namespace isohf::cli

int main(int argc, char** argv) {
  return isohf::cli::run_program("isohf", argc, argv, isohf::cli::run);
}
