/// isohf formats: what can be read and written.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "commands/command.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormatsFooter =
    R"(Inputs are recognised by their first bytes, and by the extension if the format has no signature. --json also
lists libraries and their versions.)";

ordered_json list_of(const std::vector<Format>& formats) {
  ordered_json list = ordered_json::array();
  for (const Format& format : formats) {
    list.push_back({{"name", format.name},
                    {"extensions", format.extensions},
                    {"library", library_of(format)},
                    {"note", format.note.empty() ? ordered_json(nullptr) : ordered_json(spelled(format.note))}});
  }
  return list;
}

/// A format that is written goes with the reader that has its extensions.
std::string table() {
  std::string text = fmt::format("{:<24} {:<10} {:<32} {}\n", "FORMAT", "USE", "EXTENSIONS", "NOTES");
  for (const Format& format : native_formats()) {
    const auto is_read = [&](std::string_view extension) {
      return std::ranges::find(format.extensions, extension) != format.extensions.end();
    };
    std::vector<std::string> notes;
    if (!format.note.empty()) notes.push_back(format.note);
    bool is_written = false;
    for (const Format& other : writable_formats()) {
      if (!std::ranges::all_of(other.extensions, is_read)) continue;
      is_written = true;
      notes.push_back("writes " + other.note);
    }
    const std::string row = fmt::format("{:<24} {:<10} {:<32} {}", format.name, is_written ? "read,write" : "read",
                                        fmt::format("{}", fmt::join(format.extensions, " ")), fmt::join(notes, "; "));
    text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
  }
  return spelled(text);
}

int run(const Common& common) {
  Report report;
  report.add("read", list_of(native_formats()));
  std::string more;
  try {
    const OiioFormats other = oiio_formats();
    report.add("read_by_module", {{"present", true}, {"library", other.library}, {"extensions", other.extensions}});
    more = common.verbose
               ? fmt::format("{} reads {}\n", other.library, fmt::join(other.extensions, " "))
               : fmt::format("{} reads {} more extensions; -v lists them\n", other.library, other.extensions.size());
  } catch (const Error& error) {
    report.add("read_by_module", {{"present", false}, {"why", error.what()}});
    more = std::string("OpenImageIO reads nothing: ") + error.what() + "\n";
  }
  report.add("written", list_of(writable_formats()));
  if (common.json || common.quiet) {
    report.print(common);
    return kExitDone;
  }
  StandardOutput out(common);
  out.write(table() + more);
  out.finish();
  return kExitDone;
}

}  // namespace

Run add_formats(CLI::App& line, Common& common) {
  line.footer(kFormatsFooter);
  return [&common] { return run(common); };
}

}  // namespace isohf::cli
