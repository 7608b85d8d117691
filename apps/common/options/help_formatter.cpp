#include "options/help_formatter.h"

#include <algorithm>
#include <sstream>

#include "options/command_line.h"
#include "output/terminal.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kNameWidth = 26;

/// Breaks `text` at blanks so that no line is longer than `width`; lines after the first start with `indent` blanks.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::string out;
  std::size_t column = indent;
  std::istringstream words(text);
  for (std::string word; words >> word; column += word.size()) {
    if (column == indent) {
      out += word;
    } else if (column + 1 + word.size() > width) {
      out += "\n" + std::string(indent, ' ') + word;
      column = indent;
    } else {
      out += " " + word;
      ++column;
    }
  }
  return out;
}

/// A page, as wide as the terminal behind `file`.
class Page {
 public:
  explicit Page(int file) : file_(file), width_(text_width(file)) {}

  void heading(const std::string& text) { page_ += (page_.empty() ? "" : "\n") + bold(text) + "\n"; }
  void usage(const std::string& call) { page_ += bold("Usage:") + " " + call + "\n"; }
  void row(const std::string& name, const std::string& description) {
    std::string line = "  " + name;
    if (line.size() + 2 > kNameWidth) line += '\n';
    line.resize(line.ends_with('\n') ? line.size() + kNameWidth : kNameWidth, ' ');
    page_ += line + wrapped(description, kNameWidth, width_) + "\n";
  }
  /// Lines run on until an empty or indented one; indented lines stay as they are, and a line above them that ends with
  /// a colon is a heading.
  void text(const std::string& text) {
    if (!text.empty()) page_ += '\n';
    std::string paragraph;
    const auto end_paragraph = [&](bool is_heading) {
      if (!paragraph.empty()) page_ += (is_heading ? bold(paragraph) : wrapped(paragraph, 0, width_)) + "\n";
      paragraph.clear();
    };
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty() && line.front() != ' ') {
        paragraph += (paragraph.empty() ? "" : " ") + line;
        continue;
      }
      end_paragraph(!line.empty() && paragraph.ends_with(":"));
      page_ += line + "\n";
    }
    end_paragraph(false);
  }
  [[nodiscard]] const std::string& str() const { return page_; }

 private:
  [[nodiscard]] std::string bold(const std::string& text) const { return styled(text, Style::kHeading, file_); }

  int file_;
  std::size_t width_;
  std::string page_;
};

void add_commands(Page& page, const CLI::App& root) {
  std::vector<std::string> headings;
  for (const CLI::App* command : root.get_subcommands({})) {
    if (headings.empty() || headings.back() != command->get_group()) {
      headings.push_back(command->get_group());
      page.heading(headings.back() + ":");
    }
    page.row(command->get_name(), command->get_description());
  }
}

}  // namespace

std::string usage_of(const CLI::App& line) {
  std::string usage = invocation(line);
  if (!line.get_subcommands({}).empty()) return usage + " COMMAND [ARGUMENTS] [OPTIONS]";
  for (const CLI::Option* option : line.get_options()) {
    if (option->get_positional())
      usage += " " + (option->get_type_name().empty() ? option->get_name(true) : option->get_type_name());
  }
  return usage + " [OPTIONS]";
}

std::string shown_name(const CLI::Option& option) {
  if (option.get_lnames().empty() && option.get_snames().empty())
    return option.get_type_name().empty() ? option.get_name(true) : option.get_type_name();
  if (option.get_lnames().empty()) return "-" + option.get_snames().front();
  std::string name = option.get_snames().empty() ? "    " : "-" + option.get_snames().front() + ", ";
  name += "--" + option.get_lnames().front();
  const std::string value = option.get_positional() ? option.get_name(true) : option.get_type_name();
  if (value.empty() || value.front() == '[') return name + value;
  return name + " " + value;
}

std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> by_heading(const CLI::App& line) {
  std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> groups;
  for (const CLI::Option* option : line.get_options()) {
    // Named once, for all commands.
    if (line.get_parent() != nullptr && (option == line.get_help_ptr() || option == line.get_help_all_ptr())) continue;
    const auto group = std::ranges::find(groups, option->get_group(), [](const auto& known) { return known.first; });
    if (group != groups.end()) {
      group->second.push_back(option);
    } else {
      groups.push_back({option->get_group(), {option}});
    }
  }
  // A program of one command has its own options first.
  if (line.get_parent() == nullptr && line.get_subcommands({}).empty())
    std::rotate(groups.begin(), groups.begin() + 1, groups.end());
  const auto first = std::ranges::find(groups, kMostUsed, [](const auto& known) { return known.first; });
  if (first != groups.end()) std::rotate(groups.begin(), first, first + 1);
  return groups;
}

std::string HelpFormatter::make_help(const CLI::App* line, std::string /*name*/, CLI::AppFormatMode mode) const {
  Page page(common_.out);
  const auto groups = by_heading(*line);
  const bool is_brief = mode == CLI::AppFormatMode::Normal && !groups.empty() && groups.front().first == kMostUsed;
  page.usage(usage_of(*line));
  page.text(line->get_description());
  add_commands(page, *line);
  const auto add_rows = [&](const std::string& heading, const std::vector<const CLI::Option*>& options) {
    if (!options.empty()) page.heading(heading + ":");
    for (const CLI::Option* option : options) page.row(shown_name(*option), option->get_description());
  };
  if (is_brief) {
    add_rows("Arguments", line->get_options([](const CLI::Option* option) { return option->get_positional(); }));
    add_rows(kMostUsed, groups.front().second);
    page.text(invocation(*line) + " --help lists all options.");
    return page.str();
  }
  for (const auto& [heading, options] : groups) add_rows(heading, options);
  if (line->get_parent() != nullptr) {
    page.text("Options of every command: --json, -q, -v, --strict, --config FILE, -h, --help, -V (" +
              line->get_parent()->get_name() + " --help).");
  }
  page.text(line->get_footer());
  return page.str();
}

}  // namespace isohf::cli
