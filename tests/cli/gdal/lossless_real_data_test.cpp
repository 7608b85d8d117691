/// convert --lossless and export give every readable raster of the shared data back, bit for bit.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/raster.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// Files are shared out to several tests by the first letter of their names, so that they can run side by side.
struct Share {
  const char* name;
  char first;
  char last;
};

bool is_in(const Share& share, const fs::path& file) {
  const auto letter = static_cast<char>(std::tolower(static_cast<unsigned char>(file.filename().string().front())));
  return letter >= share.first && letter <= share.last;
}

/// What --raw has to say of a .r16 file: the ones in the folder are squares. Empty for all others.
std::string raw_layout(const fs::path& file) {
  if (lower_extension(file) != ".r16") return {};
  const auto side = static_cast<long>(std::lround(std::sqrt(static_cast<double>(fs::file_size(file)) / 2.0)));
  return std::to_string(side) + "x" + std::to_string(side) + ":u16le";
}

OpenOptions options_for(const fs::path& file) {
  OpenOptions options;
  if (const std::string layout = raw_layout(file); !layout.empty()) options.raw = raw_layout_from_string(layout);
  return options;
}

void expect_same(const Raster& found, const Raster& expected) {
  ASSERT_EQ(found.info.width, expected.info.width);
  ASSERT_EQ(found.info.height, expected.info.height);
  ASSERT_EQ(to_string(found.info.sample_type), to_string(expected.info.sample_type));
  EXPECT_TRUE(found.raw == expected.raw) << "samples differ";
  EXPECT_TRUE(std::equal(found.elevations.begin(), found.elevations.end(), expected.elevations.begin(),
                         [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }))
      << "voids or scale differ";
}

/// The format of the source, so far as isohf writes it; no PNG of elevations that were packed into its colours.
std::string restored_name(const fs::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".png" && size_bytes(open_raster(file, options_for(file))->info().sample_type) > 2)
    return "back.tif";
  for (const char* own : {".tif", ".exr", ".png", ".hgt"}) {
    if (extension == own) return std::string("back") + own;
  }
  return extension == ".zip" ? "back.hgt" : "back.tif";
}

void expect_restored(const fs::path& file, const TemporaryFolder& folder) {
  const std::string archive = folder / "a.isohf";
  const std::string back = folder / restored_name(file);
  std::vector<std::string> convert = {"convert", file, archive, "--lossless", "--overwrite", "--quiet"};
  if (const std::string layout = raw_layout(file); !layout.empty()) convert.insert(convert.end(), {"--raw", layout});
  const RunResult converted = run_isohf(convert);
  ASSERT_EQ(converted.exit_code, 0) << converted.err;
  const RunResult restored = run_isohf({"export", archive, back, "--overwrite", "--quiet"});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_EQ(restored.out + restored.err, "");
  if (lower_extension(file) == ".hgt") {
    EXPECT_TRUE(read_file(back) == read_file(file)) << "the whole file is not the same";
  }
  expect_same(read_raster(back), read_raster(file, options_for(file)));
}

/// The name that the test runner shows; without it bytes of the value stand there.
std::ostream& operator<<(std::ostream& out, const Share& share) {
  return out << share.name;
}

class LosslessRealData : public testing::TestWithParam<Share> {};

TEST_P(LosslessRealData, ComesBackBitForBit) {
  const std::vector<fs::path> files = real_files();
  if (files.empty()) GTEST_SKIP() << kNoRealFiles;
  const TemporaryFolder folder;
  std::vector<std::string> restored;
  std::vector<std::string> not_read;
  for (const fs::path& file : files) {
    if (!is_in(GetParam(), file) || (kSanitized && fs::file_size(file) > (std::uintmax_t{1} << 20U))) continue;
    SCOPED_TRACE(file);
    try {
      const auto source = open_raster(file, options_for(file));
      // One row is no surface: ldem_4_cropped.img.
      if (std::min(source->info().width, source->info().height) < 2) {
        not_read.push_back(file.filename());
        continue;
      }
    } catch (const Error& error) {
      // No raster, or of a format that this build does not read.
      ASSERT_EQ(error.code(), ErrorCode::kUnsupported) << error.what();
      not_read.push_back(file.filename());
      continue;
    }
    expect_restored(file, folder);
    restored.push_back(file.filename());
  }
  std::cout << restored.size() << " restored bit for bit; not rasters that this build reads:";
  for (const std::string& name : not_read) std::cout << ' ' << name;
  std::cout << '\n';
  EXPECT_FALSE(restored.empty());
}

INSTANTIATE_TEST_SUITE_P(Files, LosslessRealData,
                         testing::Values(Share{"AtoB", 'a', 'b'}, Share{"CtoM", 'c', 'm'}, Share{"NtoR", 'n', 'r'},
                                         Share{"StoZ", 's', 'z'}),
                         [](const auto& tested) { return std::string(tested.param.name); });

/// One of the repository's own rasters, converted in some other way than the default.
struct Way {
  const char* file;
  std::vector<std::string> options;
};

}  // namespace
}  // namespace isohf::test
