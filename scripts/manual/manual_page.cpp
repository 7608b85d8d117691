#include "manual_page.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "options/command_line.h"
#include "options/help_formatter.h"

namespace isohf::cli {
namespace {

std::string roff(std::string text) {
  for (const auto& [from, to] : {std::pair("\\", "\\e"), {"-", "\\-"}, {"'", "\\(aq"}, {"`", "\\(ga"}})
    text = CLI::detail::find_and_replace(text, from, to);
  return text.starts_with('.') ? "\\&" + text : text;
}

/// Indented lines stay as they are.
std::string paragraphs(const std::string& text) {
  std::string out;
  bool verbatim = false;
  bool ended = false;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line); ended = line.empty()) {
    if (line.empty()) continue;
    if (line.starts_with(' ') != verbatim) {
      verbatim = !verbatim;
      out += verbatim ? ".EX\n" : ".EE\n";
    }
    if (ended) out += ".PP\n";
    out += roff(line) + "\n";
  }
  return verbatim ? out + ".EE\n" : out;
}

std::string item(const std::string& name, const std::string& value, const std::string& text) {
  return ".TP\n\\fB" + roff(name) + "\\fI" + roff(value) + "\\fR\n" + roff(text) + "\n";
}

std::string item_of(const CLI::Option& option) {
  const std::string name = CLI::detail::trim_copy(shown_name(option));
  const std::size_t value =
      name.starts_with('-') ? std::min(name.find_first_of(" [", name.rfind(" -") + 1), name.size()) : 0;
  return item(name.substr(0, value), name.substr(value), option.get_description());
}

std::string page_name(const CLI::App& line) {
  return CLI::detail::find_and_replace(invocation(line), " ", "-");
}

}  // namespace

std::string manual_page(const CLI::App& line) {
  const bool is_root = line.get_parent() == nullptr;
  const CLI::App& root = is_root ? line : *line.get_parent();
  const std::string footer = line.get_footer();
  const std::size_t examples = footer.find("Examples:\n");
  std::string summary = line.get_description();
  if (summary.starts_with(line.get_name() + " ")) summary.erase(0, line.get_name().size() + 1);
  std::string title = page_name(line);
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return std::toupper(c); });

  std::string page = ".TH " + title + " 1 \"\" \"isohf " + root.version() + "\" \"isohf manual\"\n.nh\n";
  page += ".SH NAME\n" + page_name(line) + " \\- " + roff(summary) + "\n";
  page += ".SH SYNOPSIS\n" + roff(usage_of(line)) + "\n";
  page += ".SH DESCRIPTION\n" + paragraphs(footer.substr(0, examples));
  if (is_root) page += ".SH COMMANDS\n";
  for (const CLI::App* command : line.get_subcommands({}))
    page += item(page_name(*command), "(1)", command->get_description());
  page += ".SH OPTIONS\n";
  for (const auto& [heading, options] : by_heading(line)) {
    page += ".SS " + roff(heading) + "\n";
    for (const CLI::Option* option : options) page += item_of(*option);
  }
  if (examples != std::string::npos)
    page += ".SH EXAMPLES\n" + paragraphs(footer.substr(footer.find('\n', examples) + 1));
  return is_root ? page : page + ".SH SEE ALSO\n.BR isohf (1),\nwith the options that all commands have.\n";
}

}  // namespace isohf::cli
