// Any words are options of a command, and any text before them, up to a zero, its --config file, or an error that is a
// user's own fault.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "isohf/error.h"
#include "options/command_line.h"
#include "support/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const isohf::test::TemporaryFolder folder("/dev/shm");
  const std::string all(reinterpret_cast<const char*>(data), size);
  const std::size_t zero = all.find('\0');
  isohf::cli::Arguments arguments;
  if (zero != std::string::npos) {
    isohf::test::write_file(folder / "options.toml", std::string_view(all).substr(0, zero));
    arguments = {"--config", folder / "options.toml"};
  }
  std::istringstream words(zero == std::string::npos ? all : all.substr(zero + 1));
  for (std::string word; std::getline(words, word);) {
    // Help and the version go to standard output.
    if (word.starts_with("-") && word.find_first_of("hV") != std::string::npos) return 0;
    arguments.push_back(word);
  }
  std::string input;
  std::string filter;
  std::string shape;
  bool overwrite = false;
  std::vector<std::string> textures;
  std::vector<std::string> pairs;
  isohf::cli::CommandLine line("convert", "Tries options.");
  line.positional("input", "A file", input);
  line.group("Samples");
  line.option("-f,--filter", "NAME", "A text", filter);
  line.words({"cubic", "bilinear"});
  line.option("--shape", "CxR", "A text", [&](const std::string& text) { shape = text; });
  line.flag("--overwrite", "A flag", overwrite);
  line.repeated("--texture", "FILE", "Files", textures);
  line.repeated_pair("--at", "X Y", "Places", [&](const std::string& x, const std::string& y) {
    pairs.push_back(x);
    pairs.push_back(y);
  });
  line.exclusive({"--shape", "--overwrite"});
  try {
    if (!line.parse(arguments)) return 0;
    if (pairs.size() % 2 != 0) std::abort();
    static_cast<void>(line.texts_in({"Samples"}));
  } catch (const isohf::Error& error) {
    if (error.code() != isohf::ErrorCode::kInvalidArgument) std::abort();
  }
  return 0;
}
