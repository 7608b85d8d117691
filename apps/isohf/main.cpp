/// isohf: elevation rasters to isometric heightfield archives. The command table; errors to exit codes.

#include <fmt/core.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "commands/command.h"
#include "formats/registry.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "options/command_line.h"
#include "options/help_page.h"
#include "options/option_values.h"

namespace isohf::cli {
namespace {

constexpr Command kCommands[] = {
    {"plan", "List tile shapes, or preview a conversion", command_plan},
    {"convert", "Turn a raster of elevations into an archive", command_convert},
    {"info", "Describe archives and rasters", command_info},
    {"verify", "Check archives, and compare one with its source", command_verify},
    {"export", "Write a raster, on the source's grid or any other, whole or cut into tiles", command_export},
    {"sample", "Print elevation and normal at places", command_sample},
    {"shade", "Draw a picture of the surface with its shadows", command_shade},
    {"extract", "Cut some tiles of an archive into one of their own", command_extract},
    {"merge", "Join the shards of a conversion", command_merge},
    {"diff", "Compare two archives", command_diff},
    {"view", "Fly over an archive in a window, or draw it without one", command_view},
    {"formats", "List the formats that are read and written", command_formats},
};

constexpr const char* kSummary =
    "Turns rasters of elevations (GeoTIFF, OpenEXR, PNG, SRTM .hgt, ...) into archives of isometric heightfield tiles, "
    "and reads, checks and measures such archives.";

constexpr const char* kNotes = R"(Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 differences (verify, diff), 130 interrupted.

ISOHF_MODULE_PATH names the folder of the OpenImageIO, PROJ and netCDF modules (default: beside the program, then ../lib/isohf).
ISOHF_SIMD=off runs the plain twins of vectorised code: slower, and the same bytes.
NO_COLOR turns colours off, CLICOLOR_FORCE=1 keeps them in pipes.

Examples:
  isohf plan                              list tile shapes
  isohf plan dem.tif                      preview what convert would do
  isohf convert dem.tif dem.isohf
  isohf verify dem.isohf --against dem.tif
  isohf export dem.isohf back.tif
  echo "1200.5 340" | isohf sample dem.isohf
  isohf help convert)";

void print_usage() {
  HelpPage page;
  page.text(kSummary);
  page.usage("isohf COMMAND [arguments] [options]");
  page.heading("Commands:");
  for (const Command& command : kCommands) page.row(command.name, command.summary);
  page.heading("Common options:");
  page.row("-h, --help", "Print the arguments, options, defaults and examples of a command");
  page.row("-V, --version", "Print the version");
  page.row("    --json", "Print one JSON document on standard output instead of text");
  page.row("-q, --quiet", "Print nothing but errors, and warnings of lost data");
  page.row("    --strict", "Take warnings as errors");
  page.row("-v, --verbose", "Say more on standard error");
  page.row("    --config FILE", "Read options from a TOML file");
  page.text(kNotes);
  page.print();
}

bool is_one_of(const std::string& word, std::initializer_list<const char*> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Takes the common options that stand before the command; they go behind it.
Arguments take_leading(Arguments& arguments) {
  Arguments leading;
  const std::vector<DeclaredOption> known = options_of(kCommands[0]);
  while (!arguments.empty() && arguments.front().size() > 1 && arguments.front().front() == '-' &&
         !is_one_of(arguments.front(), {"-h", "--help", "-V", "--version"})) {
    const std::string& argument = arguments.front();
    const std::string name = argument.substr(0, argument[1] == '-' ? argument.find('=') : 2);
    std::vector<std::string> names = {"--help", "--version"};
    const DeclaredOption* found = nullptr;
    for (const DeclaredOption& option : known) {
      if (option.group != "Common") continue;
      names.push_back(option.name);
      if (option.name == name || option.letter == name) found = &option;
    }
    if (found == nullptr) {
      const std::string near = did_you_mean(name, names);
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("found {} before the command{} (isohf --help)", name,
                              near.empty() ? "; only common options may stand there, others follow it" : near));
    }
    const bool has_value = found->takes_value && name == argument && arguments.size() > 1;
    const auto end = arguments.begin() + (has_value ? 2 : 1);
    leading.insert(leading.end(), arguments.begin(), end);
    arguments.erase(arguments.begin(), end);
  }
  return leading;
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
  set_commands(kCommands);
  Arguments arguments = given;
  const Arguments leading = take_leading(arguments);
  if (arguments.empty()) {
    throw Error(ErrorCode::kInvalidArgument, "no command given (isohf --help lists the commands)");
  }
  if (is_one_of(arguments.front(), {"-V", "--version", "version"})) {
    print_version();
    return kExitDone;
  }
  if (is_one_of(arguments.front(), {"-h", "--help", "help"})) {
    if (arguments.size() == 1 || arguments[1].starts_with("-")) {
      print_usage();
      return kExitDone;
    }
    arguments = {arguments[1], "--help"};
  }
  const std::string name = arguments.front();
  arguments.erase(arguments.begin());
  arguments.insert(arguments.begin(), leading.begin(), leading.end());
  std::vector<std::string> names = {"help"};
  for (const Command& command : kCommands) {
    if (name == command.name) return command.run(arguments);
    names.emplace_back(command.name);
  }
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("unknown command '{}'{} (isohf --help lists the commands)", name, did_you_mean(name, names)));
}

}  // namespace
}  // namespace isohf::cli

int main(int argc, char** argv) {
  return isohf::cli::run_program("isohf", argc, argv, isohf::cli::run);
}
