#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

const std::string kFolder = ISOHF_SOURCE_DIR "/testdata/archives/v1/";

/// The archives of format version 1 that later programs must read, and what they say of their content.
const std::map<std::string, std::string> kContents = {
    {"bytes.isohf", "da8a536da8349b6d2c6e79b0e2971c3884d04664052f0762d6798eb61a720f71"},
    {"codes.isohf", "d388500a5e3cdb693eecfee6038694671b34850863029151cb2af1ac7a47c155"},
    {"floats.isohf", "b3ddf4c4dce196fabf4b613cfc7ad93a92e2dd688c6536c49b06fd98427481e0"},
    {"globe.isohf", "b06304a993cadca17b7359c85290f85e72525d8a1696ee1126f0d983b1fbad4a"},
    {"lossless.isohf", "00716c4dacc1e66891e114ed89518c6ba08ac92f14e8ec60f6ae268e48e52069"},
    {"projected.isohf", "a2ba7bf712970c2cea85ffa26c1f509dc226972dcf8a240984e32da610b9b9ce"},
    {"textured.isohf", "f007094852c4800db6f82a2c580da79d70c9a701ce2452fba1591884deecf49a"},
};

std::vector<std::byte> samples_of(const std::string& path) {
  return read_whole(*open_raster(path, {}));
}

TEST(KeptArchives, AreAllKnown) {
  std::size_t found = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    EXPECT_EQ(kContents.count(entry.path().filename().string()), 1U) << entry.path();
    ++found;
  }
  EXPECT_EQ(found, kContents.size());
}

TEST(KeptArchives, PassEveryCheckWithTheContentThatWasWritten) {
  for (const auto& [name, content] : kContents) {
    SCOPED_TRACE(name);
    const RunResult verified = run_isohf({"verify", kFolder + name, "--quiet"});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const RunResult described = run_isohf({"info", kFolder + name, "--json"});
    ASSERT_EQ(described.exit_code, 0) << described.err;
    EXPECT_EQ(nlohmann::json::parse(described.out).at("metadata").at("content_sha256"), content);
  }
}

// One has bilinear vertices, the other splines that were mirrored at the ends and at voids.
TEST(KeptArchives, HoldTheirSourcesVerticesByTheRuleForEdgesOfTheirTime) {
  const std::string data = ISOHF_SOURCE_DIR "/testdata/";
  for (const auto& [archive, source] :
       {std::pair{"codes.isohf", "coast_512x384_int16.tif"}, std::pair{"lossless.isohf", "voids_200x150_int16.tif"}}) {
    const RunResult verified = run_isohf({"verify", kFolder + archive, "--against", data + source, "--quiet"});
    EXPECT_EQ(verified.exit_code, 0) << archive << verified.out << verified.err;
  }
}

TEST(KeptArchives, GiveTheSamplesOfTheirSourceBack) {
  const TemporaryFolder folder;
  const RunResult restored = run_isohf({"restore", kFolder + "lossless.isohf", folder / "voids.tif"});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_TRUE(samples_of(folder / "voids.tif") == samples_of(ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif"));
  const RunResult projected = run_isohf({"restore", kFolder + "projected.isohf", folder / "map.tif"});
  ASSERT_EQ(projected.exit_code, 0) << projected.err;
  const auto source = open_raster(folder / "map.tif", {});
  ASSERT_EQ(source->info().sample_type, SampleType::kInt32);
  std::int32_t sample = 0;
  source->read_window({5, 5, 1, 1}, std::as_writable_bytes(std::span(&sample, 1)));
  EXPECT_EQ(sample, -56);  // 10 E, 48 N of 3000 sin(longitude) cos(latitude) + 500 cos(3 latitude), rounded
}

}  // namespace
}  // namespace isohf::test
