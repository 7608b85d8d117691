/// --memory: what the program really takes, by its own or the system's account of its largest resident set.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "formats/io/packed_bytes.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kWidth = 60000;
constexpr std::int64_t kHeight = kSanitized ? 100 : 300;

/// Small but wide: hills as 16-bit samples without a header.
std::string wide_raster() {
  std::string bytes(static_cast<std::size_t>(kWidth * kHeight * 2), '\0');
  for (std::int64_t r = 0; r < kHeight; ++r) {
    for (std::int64_t c = 0; c < kWidth; ++c) {
      const auto height = static_cast<std::uint16_t>(1000 + ((c * 37) >> 6) % 311 + ((r * c) >> 9) % 53);
      bytes[static_cast<std::size_t>(2 * (r * kWidth + c))] = static_cast<char>(height & 0xFFU);
      bytes[static_cast<std::size_t>(2 * (r * kWidth + c) + 1)] = static_cast<char>(height >> 8U);
    }
  }
  return bytes;
}

/// Runs isohf and what it took, as the child of a small program: a program counts what its parent held when it was begun.
RunResult run_measured(const std::vector<std::string>& arguments, const std::string& figures, double& peak_megabytes) {
  RunResult result = run_program(
      with_more({"/usr/bin/env", "python3", "-c",
                 "import resource, subprocess, sys\n"
                 "code = subprocess.call(sys.argv[2:])\n"
                 "open(sys.argv[1], 'w').write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))\n"
                 "sys.exit(code)",
                 figures, isohf_path()},
                arguments));
  peak_megabytes = std::stod(read_file(figures)) * 1024e-6;
  return result;
}

TEST(Memory, EveryCommandStaysWithinATenthOfWhatItIsGivenAndMakesTheSame) {
  if (kSanitized) GTEST_SKIP() << "memory is what this is about; KeptRows and what keeps rows run under the sanitizers";
  const TemporaryFolder folder;
  const TemporaryFolder elsewhere;
  write_file(folder / "wide.raw", wide_raster());
  const std::string raw = std::to_string(kWidth) + "x" + std::to_string(kHeight) + ":u16le";
  struct Case {
    std::vector<std::string> command;
    std::string output;  ///< what it writes, empty: what it says
    int megabytes;       ///< less than it takes without a limit
  };
  const std::vector<Case> cases = {
      {{"convert", folder / "wide.raw", folder / "kept.isohf", "--raw", raw, "--lossless"}, folder / "kept.isohf", 77},
      {{"convert", folder / "wide.raw", folder / "seeds.isohf", "--raw", raw, "--shadow-seeds"},
       folder / "seeds.isohf",
       68},
      {{"convert", folder / "wide.raw", folder / "full.isohf", "--raw", raw, "--nodata", "1150", "--fill"},
       folder / "full.isohf",
       92},
      {{"export", folder / "kept.isohf", folder / "back.npy"}, folder / "back.npy", 68},
      {{"export", folder / "seeds.isohf", folder / "hex.npy"}, folder / "hex.npy", 68},
      {{"export", folder / "seeds.isohf", folder / "flat.npy", "--method", "barycentric"}, folder / "flat.npy", 48},
      {{"shade", folder / "seeds.isohf", folder / "east.tif", "--size", "60000x300"}, folder / "east.tif", 61},
      {{"shade", folder / "seeds.isohf", folder / "south.png", "--size", "60000x300", "--kind", "shadow-mask", "--sun",
        "190,35"},
       folder / "south.png",
       61},
      {{"shade", folder / "seeds.isohf", folder / "hill.tif", "--size", "30000x150", "--kind", "hillshade"},
       folder / "hill.tif",
       53},
      {{"verify", folder / "kept.isohf"}, "", 53},
      {{"verify", folder / "seeds.isohf"}, "", 72},
      {{"verify", folder / "seeds.isohf", "--against", folder / "wide.raw"}, "", 88}};
  for (const Case& one : cases) {
    const auto run = [&](const std::vector<std::string>& more, double& peak) {
      std::vector<std::string> command = one.command;
      command.insert(command.end(), {"-j", "2"});
      if (!one.output.empty()) command.insert(command.end(), {"--overwrite", "--quiet"});
      command.insert(command.end(), more.begin(), more.end());
      const RunResult result = run_measured(command, elsewhere / "peak", peak);
      EXPECT_EQ(result.exit_code, 0) << result.err;
      return one.output.empty() ? result.out : read_file(one.output);
    };
    SCOPED_TRACE(one.command[0] + " " + one.command[1]);
    double peak = 0.0;
    const std::string made = run({"--memory", std::to_string(one.megabytes) + "MB"}, peak);
    EXPECT_LE(peak, 1.1 * one.megabytes);
    EXPECT_TRUE(run({}, peak) == made);
    EXPECT_GT(peak, one.megabytes) << "the limit asks for nothing";
  }
  for (const char* command : {"export", "verify"}) {
    std::vector<std::string> refused = {command, folder / "kept.isohf"};
    if (command != std::string("verify")) refused.push_back(folder / "none.tif");
    refused.insert(refused.end(), {"--memory", "14MB"});
    const RunResult result = run_isohf(refused);
    EXPECT_EQ(result.exit_code, 1) << command;
    EXPECT_THAT(result.err, HasSubstr("--memory allows 14 MB, "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_EQ(folder.names(),
            (std::vector<std::string>{"back.npy", "east.tif", "flat.npy", "full.isohf", "hex.npy", "hill.tif",
                                      "kept.isohf", "seeds.isohf", "south.png", "wide.raw"}));
}

TEST(Memory, ConvertStaysWithinATenthOfWhatItIsGivenAndWritesTheSameBytes) {
  if (kSanitized) GTEST_SKIP() << "shadow memory counts as well; MemoryPlan holds the bytes";
  const TemporaryFolder folder;
  write_file(folder / "wide.raw", wide_raster());
  const auto convert = [&](const std::string& name, std::vector<std::string> more) {
    return run_isohf(with_more(
        {"convert", folder / "wide.raw", folder / name, "--raw",
         std::to_string(kWidth) + "x" + std::to_string(kHeight) + ":u16le", "-j", "2", "--json", "--overwrite"},
        more));
  };
  for (const std::vector<std::string>& filter :
       {std::vector<std::string>{"--filter", "bilinear"}, {"--filter", "bspline3", "--shadow-seeds"}}) {
    ASSERT_EQ(convert("free.isohf", filter).exit_code, 0);
    const std::string expected = read_file(folder / "free.isohf");
    for (const int megabytes : {80, 100, 140}) {
      std::vector<std::string> bound = filter;
      bound.insert(bound.end(), {"--memory", std::to_string(megabytes) + "MB"});
      const RunResult result = convert("bound.isohf", bound);
      ASSERT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(result.err, "");
      EXPECT_TRUE(read_file(folder / "bound.isohf") == expected) << megabytes;
      EXPECT_LE(nlohmann::json::parse(result.out).at("peak_memory_bytes").get<double>(), 1.1e6 * megabytes)
          << filter[1];
    }
  }
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"bound.isohf", "free.isohf", "wide.raw"}));
}

TEST(Memory, PlanPrintsTheLeastAndConvertTakesIt) {
  const TemporaryFolder folder;
  write_file(folder / "wide.raw", wide_raster());
  const std::vector<std::string> command = {"convert",
                                            folder / "wide.raw",
                                            folder / "wide.isohf",
                                            "--raw",
                                            std::to_string(kWidth) + "x" + std::to_string(kHeight) + ":u16le",
                                            "-j",
                                            "2",
                                            "--json"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), command.begin(), command.end());
    return run_isohf(more);
  };
  const auto planned = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = with_more(command, more);
    words.front() = "plan";
    return nlohmann::json::parse(run_isohf(words).out);
  };
  const auto plan = planned({});
  EXPECT_EQ(plan.at("scratch_bytes"), 0);
  const auto least = plan.at("least_memory_bytes").get<std::uint64_t>();
  EXPECT_LT(least, plan.at("estimated_memory_bytes").get<std::uint64_t>());
  const RunResult refused = with({"--memory", std::to_string(least / 1000000 - 1) + "MB"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("needs at least " + std::to_string((least + 999999) / 1000000) + " MB"));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"wide.raw"});
  const std::string enough = std::to_string(least / 1000000 + 1) + "MB";
  EXPECT_GT(planned({"--memory", enough}).at("scratch_bytes"), 0);
  std::vector<std::string> without_folder = {"/usr/bin/env", "TMPDIR=" + (folder / "none"), isohf_path()};
  without_folder.insert(without_folder.end(), command.begin(), command.end());
  without_folder.insert(without_folder.end(), {"--memory", enough});
  const RunResult nowhere = run_program(without_folder);
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr(folder / "none: cannot make a scratch file"));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"wide.raw"});
  const RunResult made = with({"--memory", enough});
  EXPECT_EQ(made.exit_code, 0) << made.err;
#ifndef __SANITIZE_ADDRESS__
  EXPECT_LE(nlohmann::json::parse(made.out).at("peak_memory_bytes").get<double>(), 1.1 * static_cast<double>(least));
#endif
}

TEST(Memory, CountsPackedTilesAloneAndInAMosaic) {
  if (kSanitized) GTEST_SKIP() << "memory is what this is about; PackedTile and PackedMosaic run under the sanitizers";
  const TemporaryFolder folder;
  constexpr std::size_t kSide = 3601;
  std::string tile(kSide * kSide * 2, '\0');  // 26 MB
  for (std::size_t i = 0; i < kSide * kSide; ++i) {
    const std::size_t height = 700 + i / 9000 + (i * i >> 7U) % 5;
    tile[2 * i] = static_cast<char>(height >> 8U);
    tile[2 * i + 1] = static_cast<char>(height & 0xFFU);
  }
  const std::string packed = gzipped(tile);
  std::vector<std::string> tiles;
  for (const char* name : {"N45E006.hgt.gz", "N45E007.hgt.gz", "N45E008.hgt.gz"}) {
    tiles.push_back(folder / name);
    write_file(tiles.back(), packed);
  }
  const auto convert = [&](const std::vector<std::string>& inputs, const std::string& memory) {
    std::vector<std::string> command = {"convert", "-o", folder / "a.isohf", "-j", "2", "--json", "--overwrite"};
    command.insert(command.end(), inputs.begin(), inputs.end());
    if (!memory.empty()) command.insert(command.end(), {"--memory", memory + "MB"});
    const RunResult result = run_isohf(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? nlohmann::json::parse(result.out).at("peak_memory_bytes").get<double>() : 0.0;
  };
  for (const std::vector<std::string>& inputs : {std::vector<std::string>{tiles.front()}, tiles}) {
    SCOPED_TRACE(inputs.size());
    (void)convert(inputs, "");
    const std::string expected = read_file(folder / "a.isohf");
    for (const char* memory : {"36", "64", "120"}) {
      if (inputs.size() > 1 && memory == std::string("36")) continue;  // a strip of three tiles takes more
      const double peak = convert(inputs, memory);
      EXPECT_TRUE(read_file(folder / "a.isohf") == expected) << memory;
      EXPECT_LE(peak, 1.1e6 * std::stod(memory));
    }
  }
}

}  // namespace
}  // namespace isohf::test
