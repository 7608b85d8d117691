// Any words are options of a command, and any text before them, up to a zero, its --config file, or an error that is a
// user's own fault.

#include <fcntl.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "options/command_line.h"
#include "options/option_values.h"
#include "program.h"
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
    arguments.push_back(word);
  }
  // Any declared option is found, and none runs.
  static const isohf::cli::Command kCommands[] = {
      {"convert", "Tries options", "", [](CLI::App& line, isohf::cli::Common&) {
         const auto text = std::make_shared<std::string>();
         const auto texts = std::make_shared<std::vector<std::string>>();
         const auto flag = std::make_shared<bool>(false);
         isohf::cli::positional(line, "INPUT", "A file", *text);
         isohf::cli::group(line, "Samples");
         isohf::cli::option(line, "-f,--filter", "cubic|bilinear", "A text", *text);
         isohf::cli::option(line, "--shape", "CxR", "A size",
                            [text](const std::string& word) { (void)isohf::cli::parse_size(word, 1, 100); });
         line.add_flag("--overwrite", *flag, "A flag");
         isohf::cli::flag_with_value(line, "--fill", "D", "A flag with a value",
                                     [text](const auto& word) { *text = word.value_or(""); });
         isohf::cli::repeated(line, "--texture", "FILE", "Files",
                              [texts](const std::string& word) { texts->push_back(word); });
         isohf::cli::exclusive(line, {"--shape", "--overwrite"});
         return isohf::cli::Run([text, texts, flag] { return 0; });
       }}};
  static const isohf::cli::Program kProgram = {"isohf", "Tries options.", "", kCommands};
  static const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  isohf::cli::Common common;
  common.out = common.err = nowhere;
  const int code = isohf::cli::run(kProgram, arguments, common);
  if (code != isohf::cli::kExitDone && code != isohf::cli::kExitUsage) std::abort();
  return 0;
}
