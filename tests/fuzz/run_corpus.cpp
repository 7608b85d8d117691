// Runs a fuzz target without a fuzzer: over every file of a folder as it is, cut off, and altered at random places.
// usage: fuzz_NAME FOLDER. The random numbers are the same in every run; with ISOHF_MUTATIONS there are five times as many.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

void run(const std::vector<std::uint8_t>& bytes) {
  static_cast<void>(LLVMFuzzerTestOneInput(bytes.data(), bytes.size()));
}

#ifndef ISOHF_FUZZ_ROUNDS
#define ISOHF_FUZZ_ROUNDS 300
#endif

void run_altered(const std::vector<std::uint8_t>& bytes, std::mt19937& random) {
  static const int rounds = ISOHF_FUZZ_ROUNDS * (std::getenv("ISOHF_MUTATIONS") != nullptr ? 5 : 1);
  const auto pick = [&](std::size_t below) {
    return static_cast<std::size_t>(random()) % std::max<std::size_t>(below, 1);
  };
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint8_t> altered = bytes;
    for (std::size_t change = pick(4) + 1; change > 0 && !altered.empty(); --change) {
      const std::size_t at = pick(altered.size());
      switch (pick(4)) {
        case 0:
          altered[at] ^= static_cast<std::uint8_t>(1U << pick(8));
          break;
        case 1:
          altered[at] = static_cast<std::uint8_t>(random());
          break;
        case 2:
          altered[at] = pick(2) == 0 ? 0x00 : 0xff;
          break;
        default:
          altered.resize(at);
          break;
      }
    }
    run(altered);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::mt19937 random(20040808);
  for (const auto& file : files) {
    std::ifstream in(file, std::ios::binary);
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    run(bytes);
    run_altered(bytes, random);
  }
  std::printf("%zu files\n", files.size());
  return files.empty() ? 1 : 0;
}
