/// isohf_manual SOURCES FOLDER: writes manual pages and completions there, as they are installed below share/.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "commands/command.h"
#include "manual_page.h"
#include "options.h"
#include "options/help_formatter.h"

namespace isohf::cli {
namespace {

std::string join(std::vector<std::string> words) {
  return CLI::detail::join(words, " ");
}

/// "u16 u8 f32" of "u16|u8|f32". In "S|finest|auto" capitals stand for something else.
std::string words_in(const std::string& value) {
  std::vector<std::string> words = CLI::detail::split(value, '|');
  if (words.size() == 1) return {};
  std::erase_if(words, [](const std::string& word) {
    return std::ranges::any_of(word, [](unsigned char c) { return std::isupper(c) != 0; });
  });
  return join(words);
}

/// A line for each option: COMMAND;NAMES;VALUE;WORDS;TEXT.
std::string table_of(const CLI::App& line, const std::string& command) {
  std::ostringstream table;
  for (const auto& [heading, options] : by_heading(line)) {
    for (const CLI::Option* option : options) {
      std::vector<std::string> names;
      for (const std::string& name : option->get_snames()) names.push_back("-" + name);
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
      if (names.empty()) continue;
      std::string value = option->get_positional() ? option->get_name(true) : option->get_type_name();
      if (option->get_items_expected_max() == 0) value.clear();
      const std::string text = option->get_description();
      table << '\n'
            << command << ';' << join(names) << ';' << value << ';' << words_in(value) << ';'
            << text.substr(0, text.find(" [default"));
    }
  }
  return table.str();
}

/// What the scripts that complete read: the options of all commands, then each command and its options.
std::string table_of(const CLI::App& root) {
  std::string table = table_of(root, "all");
  for (const CLI::App* command : root.get_subcommands({}))
    table += "\n" + command->get_name() + ";;;;" + command->get_description() + table_of(*command, command->get_name());
  return table.substr(1);
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  file << text;
}

void write_all(const std::filesystem::path& sources, const std::filesystem::path& folder) {
  Common common;
  CLI::App root(kIsohf.summary, kIsohf.name);
  declare(kIsohf, root, common);
  // isohf passes the options of view on unread.
  view::Options view;
  view::add_options(*root.get_subcommand("view"), view);

  write(folder / "man/man1/isohf.1", manual_page(root));
  for (const CLI::App* command : root.get_subcommands({}))
    write(folder / "man/man1" / ("isohf-" + command->get_name() + ".1"), manual_page(*command));
  const std::string table = table_of(root);
  const auto script = [&](const char* name, const std::string& filled) {
    std::ostringstream text;
    text << std::ifstream(sources / name).rdbuf();
    return CLI::detail::find_and_replace(text.str(), "@TABLE@", filled);
  };
  for (const std::string program : {"isohf", "isohf-view"}) {
    write(folder / "bash-completion/completions" / program, script("completion.bash", table));
    write(folder / "fish/vendor_completions.d" / (program + ".fish"),
          script("completion.fish", CLI::detail::find_and_replace(table, "'", "\\'")));
  }
  write(folder / "zsh/site-functions/_isohf", script("completion.zsh", table));
}

}  // namespace
}  // namespace isohf::cli

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: isohf_manual SOURCES FOLDER\n";
    return isohf::cli::kExitUsage;
  }
  isohf::cli::write_all(argv[1], argv[2]);
  return isohf::cli::kExitDone;
}
