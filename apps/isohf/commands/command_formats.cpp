/// isohf formats: what can be read and written.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormatsFooter =
    R"(Inputs are recognised by their first bytes; the extension decides only where a format has no signature.
Every input takes --registration, --nodata, --valid-range, --fill, --z-scale, --z-offset and
--sample-spacing.

Examples:
  isohf formats
  isohf formats --json)";

/// Formats that the OpenImageIO module reads, or why there are none.
struct OtherFormats {
  std::optional<OiioFormats> formats;
  std::string why_none;
};

OtherFormats other_formats() {
  OtherFormats other;
  try {
    other.formats = oiio_formats();
  } catch (const Error& error) {
    other.why_none = error.what();
  }
  return other;
}

ordered_json list_of(const Format& format) {
  return {{"name", format.name},
          {"extensions", format.extensions},
          {"library", library_of(format)},
          {"note", format.note.empty() ? ordered_json(nullptr) : ordered_json(format.note)}};
}

ordered_json list_of(const std::vector<Format>& formats) {
  ordered_json list = ordered_json::array();
  for (const Format& format : formats) list.push_back(list_of(format));
  return list;
}

ordered_json list_of(const OtherFormats& other) {
  if (!other.formats) return {{"present", false}, {"why", other.why_none}};
  return {{"present", true}, {"library", other.formats->library}, {"extensions", other.formats->extensions}};
}

std::string text_from(const char* heading, const std::vector<Format>& formats) {
  std::string text = std::string(heading) + "\n";
  for (const Format& format : formats) {
    text += fmt::format("  {:<26} {:<16} {:<30} {}", format.name, library_of(format),
                        fmt::format("{}", fmt::join(format.extensions, " ")), format.note);
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

std::string text_from(const OtherFormats& other) {
  if (!other.formats) return "Read through OpenImageIO: nothing; " + other.why_none + "\n";
  return fmt::format("Read through {}, also photos for --texture\n  {}\n", other.formats->library,
                     fmt::join(other.formats->extensions, " "));
}

int run(const Common& common) {
  const OtherFormats other = other_formats();
  StandardOutput out(common);
  if (common.json) {
    out.write(json_text({{"read", list_of(native_formats())},
                         {"read_by_module", list_of(other)},
                         {"written", list_of(writable_formats())}}));
  } else if (!common.quiet) {
    out.write(text_from("Read", native_formats()) + text_from(other) + text_from("Written", writable_formats()));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

Run add_formats(CLI::App& line, Common& common) {
  line.footer(kFormatsFooter);
  return [&common] { return run(common); };
}

}  // namespace isohf::cli
