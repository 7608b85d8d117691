// Any bytes are a raster of some format, or one line that says what is wrong with it.
//
// ISOHF_READER names the case of tests/formats/reader_cases.h whose file the bytes take the place of: it has the
// reader, the file's name and what lies beside it. ISOHF_READER_SEEDS=FOLDER writes every case's own file to
// FOLDER/CASE/valid, prints the cases' names, and ends.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <vector>

#include "formats/reader_cases.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

[[noreturn]] void stop(const std::string& why) {
  std::cerr << "fuzz_reader: " << why << std::endl;
  std::abort();
}

void write_seeds(const std::filesystem::path& folder) {
  for (const ReaderCase& each : reader_cases()) {
    std::filesystem::create_directories(folder / each.name);
    write_file(folder / each.name / "valid", each.bytes);
    std::cout << each.name << '\n';
  }
}

/// The chosen case with a folder in memory, which libFuzzer's way out leaves no one to remove but exit handlers.
struct Chosen {
  Chosen() {
    const char* const name = std::getenv("ISOHF_READER");
    if (name == nullptr) stop("ISOHF_READER must name a case of tests/formats/reader_cases.cpp");
    const std::vector<ReaderCase> cases = reader_cases();
    const auto found =
        std::find_if(cases.begin(), cases.end(), [&](const ReaderCase& candidate) { return candidate.name == name; });
    if (found == cases.end()) stop(std::string("no case is called ") + name);
    each = *found;
    for (const auto& [beside, bytes] : each.beside) write_file(folder / beside, bytes);
    damaged = folder / each.file_name;
    opened = each.opened.empty() ? damaged : folder / each.opened;
  }

  ReaderCase each;
  const TemporaryFolder folder{"/dev/shm"};
  std::string damaged, opened;
};

void require_one_line(const std::string& text) {
  if (text.find_first_of("\n\r") != std::string::npos) stop("more than a line: " + text);
}

void read_some(HeightSource& source) {
  const SourceInfo& info = source.info();
  if (info.width < 1 || info.height < 1) stop("an empty raster was opened");
  for (const std::string& warning : info.warnings) require_one_line(warning);
  const std::int64_t columns = std::min<std::int64_t>(info.width, 256);
  const std::int64_t rows = std::min<std::int64_t>(info.height, 16);
  std::vector<std::byte> samples(static_cast<std::size_t>(columns * rows) * size_bytes(info.sample_type));
  source.read_window({0, 0, columns, rows}, samples);
  source.read_window({info.width - columns, info.height - rows, columns, rows}, samples);
  source.read_window({0, 0, columns, rows}, samples);
}

}  // namespace
}  // namespace isohf::test

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  if (const char* folder = std::getenv("ISOHF_READER_SEEDS"); folder != nullptr) {
    isohf::test::write_seeds(folder);
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using isohf::test::stop;
  static const isohf::test::Chosen chosen;
  const int file = ::open(chosen.damaged.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0 || ::write(file, data, size) != static_cast<ssize_t>(size)) stop("the file cannot be written");
  ::close(file);
  try {
    isohf::test::read_some(*chosen.each.open(chosen.opened, chosen.each.options));
  } catch (const isohf::Error& error) {
    const std::string message = error.what();
    if (message.rfind(chosen.folder.path(), 0) != 0) stop("names no file: " + message);
    isohf::test::require_one_line(message);
  }
  return 0;
}
