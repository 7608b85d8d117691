/// isohf attach: files become members of an archive.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands/command.h"
#include "isohf/archive/attach.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kAttachFooter =
    R"(A file keeps its name without its folder; FILE=NAME gives it another one, with folders of its own.
The archive is copied and takes its name when it is complete: interrupted, it is as it was.

Examples:
  isohf attach dem.isohf LICENSE.txt
  isohf attach dem.isohf report.pdf=docs/report.pdf photo.jpg)";

Attachment attachment_from(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos || std::filesystem::exists(text))
    return {text, std::filesystem::path(text).filename().string()};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace

int command_attach(const Arguments& arguments) {
  CommonOptions common;
  std::string archive;
  std::vector<std::string> texts;
  CommandLine line("attach", "Adds files to an archive as members of their own.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "The archive", archive);
  line.positionals("FILE[=NAME]...", "Files to add, and the names they get", texts);
  add_common_options(line, common);
  line.footer(kAttachFooter);
  if (!line.parse(arguments)) return kExitDone;
  line.require("ARCHIVE", archive);
  line.require("FILE", texts);
  std::vector<Attachment> files;
  for (const std::string& text : texts) files.push_back(attachment_from(text));
  const std::uint64_t bytes = attach_members(archive, files);
  StandardOutput out;
  if (common.json) {
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (const Attachment& file : files) names.push_back(file.name);
    out.write(json_text({{"archive", archive}, {"bytes", bytes}, {"attached", names}}));
  }
  out.finish();
  return kExitDone;
}

}  // namespace isohf::cli
