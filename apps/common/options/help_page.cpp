#include "options/help_page.h"

#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include "output/json_output.h"
#include "output/standard_output.h"
#include "output/terminal.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kNameWidth = 28;

/// Breaks `text` at blanks so that no line is longer than `width`; lines after the first start with `indent` blanks.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t width) {
  std::string out;
  std::size_t column = indent;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t to = std::min(text.find(' ', from), text.size());
    const std::size_t length = to - from;
    if (column > indent && column + 1 + length > width) {
      (out += '\n').append(indent, ' ');
      column = indent;
    } else if (column > indent) {
      out += ' ';
      ++column;
    }
    out.append(text, from, length);
    column += length;
    from = to + 1;
  }
  return out;
}

std::string heading_of(const std::string& text) {
  return telling().json ? text : styled(text, Style::kHeading, STDOUT_FILENO);
}

}  // namespace

void HelpPage::usage(const std::string& call) {
  (page_ += '\n') += heading_of("Usage:");
  (((page_ += ' ') += call) += '\n');
}

void HelpPage::heading(const std::string& text) {
  if (!page_.empty()) page_ += '\n';
  page_ += heading_of(text);
  page_ += '\n';
}

void HelpPage::paragraph(std::string& lines) {
  if (!lines.empty()) (page_ += wrapped(lines, 0, text_width())) += '\n';
  lines.clear();
}

void HelpPage::text(const std::string& text) {
  if (!page_.empty()) page_ += "\n";
  std::string lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line.front() != ' ') {
      if (!lines.empty()) lines += ' ';
      lines += line;
      continue;
    }
    if (!line.empty() && lines.ends_with(":")) {
      (page_ += heading_of(lines)) += '\n';
      lines.clear();
    }
    paragraph(lines);
    (page_ += line) += '\n';
  }
  paragraph(lines);
}

void HelpPage::row(const std::string& name, const std::string& description) {
  std::string line(2, ' ');
  line += name;
  if (line.size() + 2 > kNameWidth) {
    (line += '\n').append(kNameWidth, ' ');
  } else {
    line.resize(kNameWidth, ' ');
  }
  (page_ += line + wrapped(description, kNameWidth, text_width())) += '\n';
}

void HelpPage::print() const {
  StandardOutput out;
  if (telling().json) {
    out.write(json_text({{"name", program_name()}, {"version", ISOHF_VERSION}, {"help", page_}}));
  } else {
    out.write_styled(page_);
  }
  out.finish();
}

}  // namespace isohf::cli
