/// Archives that somebody altered on purpose, every checksum right: verify finds it, and no command crashes, hangs or
/// obeys what it prints.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/verify.h"
#include "support/altered_archive.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kKept = ISOHF_SOURCE_DIR "/testdata/conformance/good/";

/// Ids of what verify finds; kNotReadable where the archive is refused as a whole.
std::vector<int> findings_in(const std::string& path) {
  std::vector<int> ids;
  for (const Finding& finding : verify_archive(path, {.threads = 1}).findings) ids.push_back(finding.id);
  return ids;
}

/// Paths of all members that are no objects.
void add_leaves(const json& value, const json::json_pointer& at, std::vector<json::json_pointer>& leaves) {
  if (!value.is_object()) return leaves.push_back(at);
  for (const auto& [name, member] : value.items()) add_leaves(member, at / name, leaves);
}

/// What follows from nothing else in an archive, so that nobody can tell whether it was altered.
bool is_free(const std::string& path) {
  static const std::vector<std::string> free = {"/producer",
                                                "/level",
                                                "/edges",
                                                "/data_crc32",  // which putting together states anew
                                                "/job_sha256",
                                                "/source/ground",
                                                "/filter",
                                                "/acquisition",
                                                "/units/vertical",
                                                "/source/name",
                                                "/source/format",
                                                "/source/channel",
                                                "/source/voids",
                                                "/source/crs",
                                                "/source/body",
                                                "/source/vertical_datum",
                                                "/source/z_",
                                                "/source/mosaic",
                                                "/statistics/clamped",
                                                "/statistics/worst_rounding",
                                                "/projection/why",
                                                "/projection/worst_scale_error",
                                                "/projection/utm_zone",
                                                "/projection/parallel",
                                                "/projection/scale_0",
                                                "/projection/false_",
                                                "/wraps_x",
                                                "/lossless/rows_per_member",
                                                "/lossless/void_values",
                                                "/shadow_seeds/directions",
                                                "/textures"};
  return std::any_of(free.begin(), free.end(), [&](const std::string& start) { return path.starts_with(start); });
}

TEST(AlteredArchives, ArePutTogetherAsTheyWere) {
  const TemporaryFolder folder;
  for (const char* name :
       {"u16.isohf", "u16-lossless-voids.isohf", "projected-lossless.isohf", "u16-globe-lossless.isohf"}) {
    AlteredArchive(kKept + name).write(folder / "a.isohf");
    EXPECT_THAT(findings_in(folder / "a.isohf"), testing::IsEmpty()) << name;
  }
}

TEST(AlteredArchives, ContradictoryMetadataAreFindings) {
  const TemporaryFolder folder;
  std::size_t refused = 0;
  std::size_t found = 0;
  ASSERT_EQ(
      run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "new.isohf"}).exit_code, 0);
  for (const std::string& name : {kKept + "u16-globe-lossless.isohf", kKept + "projected-lossless.isohf",
                                  kKept + "seeds-hulls.isohf", folder / "new.isohf"}) {
    const AlteredArchive whole(name);
    std::vector<json::json_pointer> leaves;
    add_leaves(whole.metadata, json::json_pointer(), leaves);
    for (std::size_t i = 0; i < leaves.size(); i += kSanitized ? 5 : 1) {
      const json::json_pointer& leaf = leaves[i];
      const json& before = whole.metadata.at(leaf);
      std::vector<json> values = {nullptr, "nonsense", 9223372036854775808.0, -1e308};
      if (before.is_number()) values.push_back(2.0 * before.get<double>() + 100.0);
      for (const json& value : values) {
        if (value == before) continue;
        AlteredArchive altered = whole;
        altered.metadata[leaf] = value;
        altered.write(folder / "a.isohf");
        SCOPED_TRACE(name + leaf.to_string() + " = " + value.dump());
        std::vector<int> ids;
        ASSERT_NO_THROW(ids = findings_in(folder / "a.isohf"));
        refused += std::count(ids.begin(), ids.end(), finding::kNotReadable) > 0 ? 1U : 0U;
        found += ids.empty() ? 0U : 1U;
        const bool may_pass = is_free(leaf.to_string()) || (value.is_null() && before.is_null());
        EXPECT_TRUE(may_pass || !ids.empty());
      }
    }
  }
  EXPECT_GT(refused, kSanitized ? 20U : 100U);
  EXPECT_GT(found, refused + (kSanitized ? 2 : 20));
}

TEST(AlteredArchives, GroundThatIsNoneIsAFinding) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "a.isohf"}).exit_code,
            0);
  const AlteredArchive whole(folder / "a.isohf");
  for (const auto& [place, value] : {std::pair<const char*, double>{"bounds/south", -91.0},
                                     {"bounds/north", -91.0},
                                     {"bounds/west", 1e308},
                                     {"centre/latitude", 91.0},
                                     {"map_scale/least", 0.0},
                                     {"map_scale/mean", 9e9},
                                     {"map_scale/latitude", 91.0}}) {
    AlteredArchive altered = whole;
    altered.metadata[json::json_pointer(std::string("/source/ground/") + place)] = value;
    altered.write(folder / "b.isohf");
    EXPECT_THAT(findings_in(folder / "b.isohf"), testing::Contains(finding::kMetadata)) << place;
  }
}

TEST(AlteredArchives, NamesThatNobodyKnowsAreFindings) {
  const TemporaryFolder folder;
  for (const char* path : {"/filter", "/acquisition", "/units/horizontal", "/source/registration",
                           "/source/sample_type", "/source/crs/unit"}) {
    AlteredArchive altered(kKept + "u16.isohf");
    altered.metadata[json::json_pointer(path)] = "nonsense";
    altered.write(folder / "a.isohf");
    EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kMetadata)) << path;
  }
}

TEST(AlteredArchives, OtherGroundAndOtherDigestsAreFindings) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "whole.isohf",
                       "--shape", "108x83"})
                .exit_code,
            0);
  const AlteredArchive whole(folder / "whole.isohf");
  for (const auto& [place, value] : {std::pair<const char*, json>{"/units/vertical", "foot"},
                                     {"/source/crs/epsg", 4711},
                                     {"/source/vertical_datum/name", "another"},
                                     {"/source/body/semi_major_axis_m", 1737400.0},
                                     {"/ground_sha256", std::string(64, '0')}}) {
    AlteredArchive altered = whole;
    altered.metadata[json::json_pointer(place)] = value;
    altered.write(folder / "a.isohf");
    EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kContentHash)) << place;
  }
  AlteredArchive other = whole;
  ASSERT_NE(other.bytes("tiles/0/0.tile"), other.bytes("tiles/0/1.tile"));
  other.set("tiles/0/0.tile", whole.bytes("tiles/0/1.tile"));
  other.write(folder / "a.isohf");
  const VerifyReport report = verify_archive(folder / "a.isohf");
  EXPECT_TRUE(std::any_of(report.findings.begin(), report.findings.end(), [](const Finding& found) {
    return found.id == finding::kContentHash && found.tile == TileIndex{0, 0};
  }));
}

TEST(AlteredArchives, OtherSeedsAreFindings) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "seeds.isohf",
                       "--shape", "28x35", "--levels", "2", "--shadow-seeds"})
                .exit_code,
            0);
  const AlteredArchive whole(folder / "seeds.isohf");
  EXPECT_THAT(findings_in(folder / "seeds.isohf"), testing::IsEmpty());
  std::vector<std::string> seeds = whole.names();
  std::erase_if(seeds, [](const std::string& name) { return !name.starts_with("seeds/"); });
  ASSERT_GT(seeds.size(), 10U);
  std::size_t bytes = 0;
  for (std::size_t s = 0; s < seeds.size(); s += 7) {
    const std::vector<std::byte> payload = whole.bytes(seeds[s]);
    for (std::size_t i = s % 5; i < payload.size(); i += kSanitized ? 25 : 5, ++bytes) {
      std::vector<std::byte> other = payload;
      other[i] ^= std::byte{1};
      AlteredArchive altered = whole;
      altered.set(seeds[s], other);
      altered.metadata["shadow_seeds"]["bytes"] = altered.compressed_bytes("seeds/");
      altered.write(folder / "a.isohf");
      EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kShadowSeeds)) << seeds[s] << " " << i;
    }
  }
  EXPECT_GT(bytes, kSanitized ? 10U : 50U);
  AlteredArchive missing = whole;
  missing.remove(seeds.front());
  missing.metadata["shadow_seeds"]["bytes"] = missing.compressed_bytes("seeds/");
  missing.metadata["shadow_seeds"]["members"] = seeds.size() - 1;
  missing.write(folder / "a.isohf");
  EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kShadowSeeds));
  // Those of another tile, and those for another sun.
  AlteredArchive swapped = whole;
  swapped.set(seeds[0], whole.bytes(seeds[1]));
  swapped.metadata["shadow_seeds"]["bytes"] = swapped.compressed_bytes("seeds/");
  swapped.write(folder / "a.isohf");
  EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kShadowSeeds));
  AlteredArchive sun = whole;
  sun.metadata["shadow_seeds"]["sun_min_deg"] = 12.0;
  sun.write(folder / "a.isohf");
  EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kShadowSeeds));
}

TEST(AlteredArchives, ResidualsThatAreNoneAreFindings) {
  const TemporaryFolder folder;
  const AlteredArchive whole(kKept + "u16-lossless-voids.isohf");
  for (const char* how : {"cut", "flip", "remove"}) {
    AlteredArchive altered = whole;
    std::vector<std::byte> payload = whole.bytes("residual/00000000");
    if (*how == 'c') payload.resize(payload.size() / 2);
    if (*how == 'f') payload[payload.size() / 2] ^= std::byte{4};
    altered.set("residual/00000000", payload);
    if (*how == 'r') altered.remove("residual/00000000");
    altered.write(folder / "a.isohf");
    EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kLossless)) << how;
  }
}

TEST(AlteredArchives, EveryFlippedBitIsFound) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "whole.isohf",
                       "--shape", "28x35", "--levels", "2", "--density", "0.02", "--shadow-seeds", "--lossless"})
                .exit_code,
            0);
  AlteredArchive(folder / "whole.isohf").write(folder / "small.isohf");  // without the blanks behind the metadata
  ASSERT_THAT(findings_in(folder / "small.isohf"), testing::IsEmpty());
  const std::string whole = read_file(folder / "small.isohf");
  // All bits where members end, which is where idle ones are, and a part of all others.
  std::vector<std::size_t> bits;
  for (std::size_t at = whole.find("PK\x03\x04", 1); at != std::string::npos; at = whole.find("PK\x03\x04", at + 1)) {
    for (std::size_t bit = 8 * (at - 2); bit < 8 * at; ++bit) bits.push_back(bit);
  }
  for (std::size_t bit = 0; bit < 8 * whole.size(); bit += kSanitized ? 1009 : 101) bits.push_back(bit);
  for (const std::size_t bit : bits) {
    std::string flipped = whole;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    write_file(folder / "a.isohf", flipped);
    EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Not(testing::IsEmpty())) << "bit " << bit;
  }
}

/// ISOHF_FLIPS=N tries every N-th bit of each archive that is kept, ISOHF_FLIPS_OF=NAME of one.
TEST(AlteredArchives, EveryFlippedBitOfThoseThatAreKeptIsFound) {
  const TemporaryFolder folder;
  const char* const step = std::getenv("ISOHF_FLIPS");
  const char* const only = std::getenv("ISOHF_FLIPS_OF");
  std::size_t flips = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kKept)) {
    if (only != nullptr && entry.path().stem() != only) continue;
    if (entry.path().stem() == "member-added-behind") continue;  // its times say nothing
    std::string bytes = read_file(entry.path());
    const std::size_t every = step != nullptr ? std::stoul(step) : kSanitized ? 100003 : 10007;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += every, ++flips) {
      const auto flip = [&] { bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8))); };
      flip();
      write_file(folder / "a.isohf", bytes);
      EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Not(testing::IsEmpty())) << entry.path() << " bit " << bit;
      flip();
    }
  }
  EXPECT_GT(flips, 0U);
  RecordProperty("flips", static_cast<int>(flips));
  std::cout << flips << " flips\n";
}

TEST(AlteredArchives, NoProgramCrashesOnThem) {
  struct Case {
    const char* archive;
    const char* path;
    json value;
  };
  const std::vector<Case> cases = {{"u16-lossless-voids.isohf", "/source/first_sample/x", 1e308},
                                   {"u16-lossless-voids.isohf", "/source/spacing/x", 9223372036854775808.0},
                                   {"u16-lossless-voids.isohf", "/source/spacing/x", -1e308},
                                   {"u16-lossless-voids.isohf", "/source/spacing/z", 1e-308},
                                   {"u16.isohf", "/valid/x0", -1e308},
                                   {"u16.isohf", "/valid/x1", 1e308},
                                   {"u16.isohf", "/tiles/columns", 16777216},
                                   {"u16.isohf", "/tiles", {{"columns", 65536}, {"rows", 65536}, {"stored", 4}}},
                                   {"u16-lossless-voids.isohf", "/source/width", 1LL << 60},
                                   {"u16-lossless-voids.isohf", "/lossless/width", 1LL << 60},
                                   {"u16-lossless-voids.isohf", "/lossless", "nonsense"},
                                   {"u16-lossless-voids.isohf", "/lossless/rows_per_member", 1LL << 40},
                                   {"projected-lossless.isohf", "/projection/latitude_0", 1e308},
                                   {"projected-lossless.isohf", "/source/crs/spacing_x", 1e-300},
                                   {"u16.isohf", "/samples/scale", 1e308},
                                   {"u16.isohf", "/extent/x", 1e30},
                                   {"seeds-hulls.isohf", "/shadow_seeds/elevation_units_per_world_unit", 1e300}};
  const TemporaryFolder folder;
  for (const Case& c : cases) {
    AlteredArchive altered(kKept + c.archive);
    altered.metadata[json::json_pointer(c.path)] = c.value;
    altered.write(folder / "a.isohf");
    const std::vector<std::vector<std::string>> commands = {
        {"info", folder / "a.isohf"},
        {"verify", folder / "a.isohf"},
        {"export", folder / "a.isohf", folder / "r.tif"},
        {"export", folder / "a.isohf", folder / "e.tif", "--size", "20x20"},
        {"shade", folder / "a.isohf", "-o", folder / "s.png", "--size", "20x20"},
        {"sample", folder / "a.isohf", "--at", "100,100"}};
    for (const std::vector<std::string>& command : commands) {
      SCOPED_TRACE(std::string(c.archive) + c.path + " = " + c.value.dump() + ": " + command.front());
      RunOptions limits;
      // The sanitizers map terabytes of addresses for themselves.
      if (!kSanitized) limits.address_space_bytes = std::uint64_t{4} << 30U;
      const RunResult result = run_isohf(command, limits);
      EXPECT_LE(result.exit_code, 3) << result.err;
      EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
      EXPECT_THAT(result.err, testing::Not(testing::AnyOf(HasSubstr("internal error"), HasSubstr("json.exception"))));
      EXPECT_TRUE(command.front() != "verify" || result.exit_code == 3) << result.out << result.err;
      for (const std::string& left : folder.names()) EXPECT_THAT(left, testing::Not(HasSubstr(".part")));
      for (const char* made : {"r.tif", "e.tif", "s.png"}) std::filesystem::remove(folder / made);
    }
  }
}

TEST(AlteredArchives, MetadataOfTooManyMembersOrValuesAreRefusedAtOnce) {
  const TemporaryFolder folder;
  const AlteredArchive whole(kKept + "u16-lossless-voids.isohf");
  json many;
  for (int i = 0; i < 200000; ++i) many["k" + std::to_string(i)] = i;
  for (const auto& [place, value, why] : {std::tuple<const char*, json, const char*>{"/more", many, "10000 members"},
                                          {"/source/more", many, "10000 members"},
                                          {"/more", std::vector<int>(1000001), "1000000 values"}}) {
    AlteredArchive altered = whole;
    altered.metadata[json::json_pointer(place)] = value;
    altered.write(folder / "a.isohf");
    const VerifyReport report = verify_archive(folder / "a.isohf");
    ASSERT_EQ(report.findings.size(), 1U) << place;
    EXPECT_EQ(report.findings[0].id, finding::kNotReadable);
    EXPECT_THAT(report.findings[0].text, HasSubstr(why));
  }
}

TEST(AlteredArchives, MembersThatInflateAThousandfoldTakeNoMemory) {
  const TemporaryFolder folder;
  AlteredArchive altered(kKept + "u16-lossless-voids.isohf");
  altered.set("residual/00000000", std::vector<std::byte>(std::size_t{250} << 20U));
  altered.write(folder / "a.isohf");
  RunOptions limits;
  if (!kSanitized) limits.address_space_bytes = std::uint64_t{300} << 20U;
  const RunResult verified = run_isohf({"verify", folder / "a.isohf", "-j", "1"}, limits);
  EXPECT_EQ(verified.exit_code, 3) << verified.err;
  EXPECT_THAT(verified.out, testing::AllOf(HasSubstr("residual/00000000"), HasSubstr("too many for")));
  EXPECT_THAT(verified.out + verified.err, testing::Not(HasSubstr("memory")));
  const RunResult restored = run_isohf({"export", folder / "a.isohf", folder / "r.tif", "-j", "1"}, limits);
  EXPECT_EQ(restored.exit_code, 1) << restored.err;
  EXPECT_THAT(restored.err, HasSubstr("too many for"));
}

TEST(AlteredArchives, AGridOfTilesThatNobodyHasIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "new.isohf"}).exit_code, 0);
  AlteredArchive altered(folder / "new.isohf");
  altered.metadata["tiles"]["columns"] = 65535;
  altered.write(folder / "a.isohf");
  EXPECT_THAT(findings_in(folder / "a.isohf"), testing::Contains(finding::kNotReadable));
}

TEST(RestoreSpacing, ASpacingBeyondTheSurfaceIsRefused) {
  const TemporaryFolder folder;
  for (const char* method : {"hex", "barycentric"}) {
    for (const char* spacing : {"1e21", "1e300"}) {
      const RunResult result =
          run_isohf({"export", kKept + "u16.isohf", folder / "a.tif", "--spacing", spacing, "--method", method});
      EXPECT_EQ(result.exit_code, 2) << result.err;
      EXPECT_THAT(result.err, HasSubstr("is wider than the ground"));
      EXPECT_THAT(folder.names(), testing::IsEmpty());
    }
  }
}

TEST(AlteredArchives, NothingInThemReachesTheTerminalAsACommand) {
  const TemporaryFolder folder;
  const std::string bad =
      "\x1b[31mred\x1b]0;title\x07 \xc2\x9b"
      "2J\nline \xe2\x80\xae";
  AlteredArchive altered(kKept + "u16-lossless-voids.isohf");
  for (const char* path :
       {"/producer", "/filter", "/acquisition", "/units/vertical", "/source/name", "/source/format", "/source/channel",
        "/source/crs/name", "/source/body/name", "/source/vertical_datum/name", "/source/registration"}) {
    altered.metadata[json::json_pointer(path)] = bad;
  }
  altered.write(folder / "a.isohf");
  const std::string raster = folder / "a.isohf";
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"info", folder / "a.isohf"},
                                             {"verify", folder / "a.isohf"},
                                             {"info", folder / "a.isohf", "--json"},
                                             {"verify", folder / "a.isohf", "--json"}}) {
    const RunResult result = run_isohf(command);
    for (const std::string& text : {result.out, result.err}) {
      EXPECT_THAT(text, testing::Not(testing::AnyOf(HasSubstr("\x1b"), HasSubstr("\x07"), HasSubstr("\xc2\x9b"),
                                                    HasSubstr("\nline"))))
          << command.front();
    }
    EXPECT_TRUE(command.back() != "--json" || json::accept(result.out));
  }
}

}  // namespace
}  // namespace isohf::test
