#pragma once

#include <string>

namespace isohf::cli {

/// A page of help for standard output, as wide as the terminal.
class HelpPage {
 public:
  /// "Usage: " and how the program is called.
  void usage(const std::string& call);
  /// A line that begins a section, after an empty one.
  void heading(const std::string& text);
  /// Text whose lines run on until an empty or indented one; indented lines stay as they are, and a line that ends with
  /// a colon above them is a heading.
  void text(const std::string& text);
  /// Two columns.
  void row(const std::string& name, const std::string& description);
  void print() const;

 private:
  void paragraph(std::string& lines);

  std::string page_;
};

}  // namespace isohf::cli
