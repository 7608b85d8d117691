#include "isohf/parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <random>

#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/shards.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using testing::HasSubstr;

/// Hills with a lake of voids, of tiles of 12x19 that planes of two kinds stand on.
class Hills : public test::MemorySource<float> {
 public:
  explicit Hills(double rise = 0.0)
      : MemorySource(SampleType::kFloat32, 210, 150, [rise](std::int64_t c, std::int64_t r) {
          const auto x = static_cast<double>(c);
          const auto z = static_cast<double>(r);
          if (std::hypot(x - 60.0, z - 40.0) < 25.0) return std::numeric_limits<double>::quiet_NaN();
          const double bump = std::hypot(x - 150.0, z - 100.0) < 12.0 ? rise : 0.0;
          return 300.0 + 20.0 * std::sin(x * 0.05) * std::cos(z * 0.04) + 3.0 * std::sin(x * 0.6 + z * 0.3) + bump;
        }) {}
};

class Parts : public testing::Test {
 protected:
  Parts() {
    options.plan.shape = {12, 19};
    options.plan.levels = 2;
    options.overwrite = true;
    options.producer = "isohf test";
    options.z_range = {270.0, 330.0};
    options.shadow_seeds.emplace();
    options.texture.emplace();
    options.texture->photo = &photo;
  }
  std::string make(const std::string& name, double rise = 0.0) {
    Hills source(rise);
    (void)convert(source, folder / name, options);
    return folder / name;
  }
  std::string refusal(const std::function<void()>& action) { return test::error_of(action).what(); }

  test::TemporaryFolder folder;
  ConvertOptions options;
  test::MemoryPhoto photo{210, 150, 3, [](std::int64_t c, std::int64_t r, int channel) {
                            return static_cast<int>((c * 3 + r * 5 + channel * 60) % 256);
                          }};
};

class Extract : public Parts {
 protected:
  /// Cuts tiles of a plane, and compares the elevations of 200 places on them with the whole's.
  void expect_same_elevations(const std::string& whole, int plane, const TileRange& tiles) {
    const std::string cut = folder / "cut.isohf";
    (void)extract_tiles(whole, cut, plane, tiles, {.overwrite = true});
    const VerifyReport report = verify_archive(cut);
    EXPECT_TRUE(report.passed()) << (report.findings.empty() ? "" : report.findings.front().text);
    ArchiveReader from(whole);
    ArchiveReader to(cut);
    const Metadata& metadata = to.metadata();
    if (plane > 0) return;  // other triangles
    Surface before(from);
    Surface after(to);
    const double west = static_cast<double>(tiles.first.column) * from.grid().extent_x();
    const double north = static_cast<double>(tiles.first.row) * from.grid().extent_z();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    int places = 0;
    for (int i = 0; i < 200; ++i) {
      const WorldPoint at{part(random) * metadata.grid.world_width(), part(random) * metadata.grid.world_height()};
      const WorldPoint there{at.x + west, at.z + north};
      const double expected = before.at(there).elevation;
      const auto compare = [&](double found) {
        ASSERT_EQ(std::isnan(found), std::isnan(expected)) << at.x << " " << at.z;
        // Places are sums that round.
        if (std::isnan(expected)) return;
        ASSERT_NEAR(found, expected, 1e-7) << at.x << " " << at.z;
      };
      compare(after.at(at).elevation);
      const WorldGeoreference geo(metadata);
      if (!geo.has_geo()) continue;
      ++places;
      const GeoPoint place = geo.geo_from_world(at);
      compare(after.at(place).elevation);
      if (std::isnan(expected)) continue;
      ASSERT_NEAR(before.at(place).elevation, expected, 1e-7);
    }
    EXPECT_EQ(places, metadata.source.crs_unit == "degree" ? 200 : 0);
  }

  /// A globe of areas, or a piece of it.
  static std::unique_ptr<test::MemorySource<float>> degrees(double west, double north, double spacing,
                                                            Registration registration = Registration::kArea) {
    auto source =
        std::make_unique<test::MemorySource<float>>(SampleType::kFloat32, 180, 90, [](std::int64_t c, std::int64_t r) {
          return 300.0 +
                 20.0 * std::sin(static_cast<double>(c) * M_PI / 45.0) * std::cos(static_cast<double>(r) * 0.06);
        });
    source->mutable_info().georeference = test::place_at(registration, HorizontalUnit::kDegree, west, north, spacing);
    source->mutable_info().vertical_unit = "metre";
    return source;
  }
};

TEST_F(Extract, OfAnyKindOfArchiveKeepsElevationsAndPlaces) {
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    options.code_type = type;
    const std::string whole = make("whole.isohf");
    const TileGrid grid = ArchiveReader(whole).grid();
    ASSERT_GT(grid.tile_columns(), 12);
    ASSERT_GT(grid.tile_rows(), 8);
    expect_same_elevations(whole, 0, {{3, 1}, {9, 5}});
    expect_same_elevations(whole, 0, {{9, 6}, {grid.tile_columns(), grid.tile_rows()}});
    expect_same_elevations(whole, 0, {{0, 0}, {grid.tile_columns(), grid.tile_rows()}});
    expect_same_elevations(whole, 0, {{7, 7}, {8, 8}});
    expect_same_elevations(whole, 1, {{0, 0}, {1, 1}});
  }
}

TEST_F(Extract, OfDegreesAndGlobesKeepsElevationsAndPlaces) {
  options.texture.reset();
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    for (const char* projection : {"equirectangular", "local", "none"}) {
      options.plan.ground.projection = ProjectionRequest::parse(projection);
      options.shadow_seeds.reset();
      const auto source = degrees(5.005, 46.995, 0.01, registration);
      (void)convert(*source, folder / "whole.isohf", options);
      const TileGrid grid = ArchiveReader(folder / "whole.isohf").grid();
      SCOPED_TRACE(projection);
      expect_same_elevations(folder / "whole.isohf", 0, {{1, 1}, {4, 3}});
      expect_same_elevations(folder / "whole.isohf", 0, {{4, 2}, {grid.tile_columns(), grid.tile_rows()}});
    }
    options.plan.ground = {};
    options.plan.ground.wrap = Wrap::kAlways;
    const auto globe = degrees(registration == Registration::kArea ? -179.0 : -180.0, 89.0, 2.0, registration);
    (void)convert(*globe, folder / "globe.isohf", options);
    const ArchiveReader whole(folder / "globe.isohf");
    ASSERT_TRUE(whole.metadata().wraps_x);
    const std::int64_t columns = whole.grid().tile_columns();
    expect_same_elevations(folder / "globe.isohf", 0, {{columns - 3, 0}, {columns, 3}});
    EXPECT_FALSE(ArchiveReader(folder / "cut.isohf").metadata().wraps_x);
    expect_same_elevations(folder / "globe.isohf", 0, {{0, 1}, {columns, 3}});
    EXPECT_TRUE(ArchiveReader(folder / "cut.isohf").metadata().wraps_x);
    options.plan.ground = {};
  }
}

TEST_F(Extract, CopiesTexturesMakesSeedsAndLeavesResidualsOut) {
  options.lossless = true;
  const std::string whole = make("whole.isohf");
  const std::string cut = folder / "cut.isohf";
  const PartSummary summary = extract_tiles(whole, cut, 0, {{8, 5}, {12, 8}});
  EXPECT_THAT(summary.warnings, testing::ElementsAre(HasSubstr("residuals are left out")));
  const ArchiveReader from(whole);
  const ArchiveReader to(cut);
  EXPECT_FALSE(lossless_record(to.metadata()).has_value());
  EXPECT_EQ(to.read_tile({1, 2}), from.read_tile({9, 7}));
  int textures = 0;
  for (const MemberTable& table : to.tables()) {
    if (!table.name.starts_with("textures/")) continue;
    ++textures;
    std::string there = table.name;
    std::string here = table.name;
    const auto put = [](std::string& name, const char* what, const char* number) {
      name.replace(name.find(what), std::string(what).size(), number);
    };
    put(there, "{row}", "7"), put(there, "{column}", "9");
    put(here, "{row}", "2"), put(here, "{column}", "1");
    EXPECT_EQ(to.read_member(here), from.read_member(there)) << here;
  }
  EXPECT_GT(textures, 0);
  EXPECT_THAT(refusal([&] { (void)extract_tiles(whole, cut, 0, {{8, 5}, {12, 8}}); }), HasSubstr("exists"));
  EXPECT_THAT(refusal([&] {
                (void)extract_tiles(whole, folder / "a.isohf", 0, {{8, 5}, {12, 8}}, {.strict = true});
              }),
              HasSubstr("residuals are left out"));
  EXPECT_THAT(refusal([&] {
                (void)extract_tiles(whole, folder / "a.isohf", 0, {{0, 0}, {100, 1}});
              }),
              HasSubstr("of tiles are asked for"));
  EXPECT_THAT(refusal([&] {
                (void)extract_tiles(whole, folder / "a.isohf", 9, {{0, 0}, {1, 1}});
              }),
              HasSubstr("not an overview 9"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.isohf"));
}

TEST_F(Parts, DiffSaysHowFarElevationsLieApart) {
  options.texture.reset();
  const std::string old = make("old.isohf");
  const std::string changed = make("changed.isohf", 9.0);
  const ArchiveDifference difference = diff_archives(old, changed, true);
  ASSERT_GT(difference.tiles_differing, 1);
  EXPECT_NEAR(difference.surface->max, 9.0, 1.5);  // the cubic goes beyond a cliff
  EXPECT_EQ(difference.surface->voids, 0);
  double most = 0.0;
  std::int64_t changed_samples = 0;
  std::int64_t voids = 0;
  subtract_archives(old, changed, [&](std::int64_t row, std::span<const double> samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double x = static_cast<double>(static_cast<std::int64_t>(i) % 210) - 150.0;
      const double z = static_cast<double>(row + static_cast<std::int64_t>(i) / 210) - 100.0;
      voids += std::isnan(samples[i]) ? 1 : 0;
      if (!(std::abs(samples[i]) > 0.0)) continue;
      ++changed_samples;
      EXPECT_LT(std::hypot(x, z), 16.0);
      most = std::max(most, samples[i]);
    }
  });
  EXPECT_NEAR(most, 9.0, 1.5);
  EXPECT_NEAR(static_cast<double>(changed_samples), 3.14 * 14.0 * 14.0, 100.0);  // the filter reaches beyond it
  EXPECT_NEAR(static_cast<double>(voids), 3.14 * 25.0 * 25.0, 250.0);            // the lake
  options.step = 0.01;
  options.z_range.reset();
  // Elevations are compared whatever their codes: both steps together are as far as they can lie apart.
  const std::string other = make("other.isohf");
  const ArchiveDifference apart = diff_archives(old, other, true);
  EXPECT_EQ(apart.why_other_lattice, "");
  EXPECT_GT(apart.surface->compared, 0);
  EXPECT_LE(apart.surface->max, 0.5 * (ArchiveReader(old).metadata().quantisation.scale + 0.01) + 1e-4);
}

TEST_F(Parts, DiffFindsAnotherOffsetUnderEqualCodes) {
  options.texture.reset();
  options.step = 0.01;
  const std::string low = make("low.isohf");
  options.z_range = {{370.0, 430.0}};
  Hills source;
  source.mutable_info().z_offset = 100.0;
  (void)convert(source, folder / "high.isohf", options);
  ASSERT_EQ(ArchiveReader(low).tile_digest({0, 0}), ArchiveReader(folder / "high.isohf").tile_digest({0, 0}));
  const ArchiveDifference difference = diff_archives(low, folder / "high.isohf", true);
  EXPECT_EQ(difference.tiles_differing, ArchiveReader(low).metadata().tiles_stored);
  EXPECT_NEAR(difference.surface->mean, 100.0, 1e-9);
  EXPECT_NEAR(difference.surface->max, 100.0, 1e-9);
  EXPECT_EQ(difference.surface->voids, 0);
}

/// Shards, made in an odd order.
class Shards : public Parts {
 protected:
  std::vector<std::string> make_shards(HeightSource& source, int count, const std::string& name) {
    std::vector<std::string> files;
    for (int i = 0; i < count; ++i) {
      const int number = count % 2 == 0 ? count - i : (i * 2 + 1) % count + 1;
      files.push_back(folder / (name + std::to_string(number) + ".isohf"));
      (void)convert_shard(source, {number, count}, files.back(), options);
      EXPECT_TRUE(is_shard(files.back(), source, {number, count}, options));
      EXPECT_EQ(is_shard(files.back(), source, {number % count + 1, count}, options), count == 1);
    }
    return files;
  }
  void expect_bytes_of_one_run(int count) {
    const std::string whole = make("whole.isohf");
    Hills source;
    const std::vector<std::string> files = make_shards(source, count, "part-");
    EXPECT_TRUE(missing_shards(files).numbers.empty());
    const PartSummary joined = merge_shards(files, folder / "joined.isohf", {.overwrite = true});
    EXPECT_TRUE(joined.warnings.empty());
    EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole)) << count << " shards";
  }
};

TEST_F(Shards, JoinToTheBytesOfOneRun) {
  options.filter = Filter::kBspline3;
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    options.code_type = type;
    expect_bytes_of_one_run(5);
  }
  // Floats need no range; two shards end with rows of the first plane: nothing is decoded.
  options.z_range.reset();
  options.filter = Filter::kBilinear;
  options.plan.shape = {8, 11};
  expect_bytes_of_one_run(2);
  expect_bytes_of_one_run(1);
}

TEST_F(Shards, OfALosslessConversionJoinToItsBytes) {
  options.lossless = true;
  options.filter = Filter::kBilinear;
  for (const CodeType type : {CodeType::kU8, CodeType::kF32}) {
    options.code_type = type;
    for (const int count : {2, 5, 9}) expect_bytes_of_one_run(count);
  }
}

TEST(ShardList, JoinsNumbersThatFollowEachOther) {
  EXPECT_EQ(shard_list({1, 3, 4, 5, 9}), "1,3-5,9");
}

TEST_F(Shards, InterruptedGoOnAndGiveTheSameBytes) {
  Hills source;
  const std::vector<std::string> files = make_shards(source, 3, "part-");
  const std::string file = folder / "again.isohf";
  std::atomic<bool> cancel = false;
  Job job;
  job.cancel = &cancel;
  job.progress = [&](const Progress& at) { cancel = at.done > at.total / 2; };
  options.resume = true;
  EXPECT_THROW((void)convert_shard(source, {2, 3}, file, options, job), Error);
  EXPECT_FALSE(is_shard(file, source, {2, 3}, options));
  (void)convert_shard(source, {2, 3}, file, options);
  EXPECT_EQ(test::read_file(file), test::read_file(folder / "part-2.isohf"));
  // What another shard left under the name is told of, and where it was removed its journal is in nobody's way.
  std::filesystem::remove(file);
  cancel = false;
  EXPECT_THROW((void)convert_shard(source, {2, 3}, file, options, job), Error);
  EXPECT_THAT(refusal([&] {
                (void)convert_shard(source, {3, 3}, file, options);
              }),
              HasSubstr(".part belongs to another input or other options; remove it to start over"));
  std::filesystem::remove(file + ".part");
  (void)convert_shard(source, {3, 3}, file, options);
  EXPECT_EQ(test::read_file(file), test::read_file(folder / "part-3.isohf"));
}

TEST_F(Shards, AreRefusedByAllButTheMerge) {
  Hills source;
  const std::vector<std::string> files = make_shards(source, 3, "part-");
  const std::string third = folder / "part-3.isohf";
  const std::string expected = third + ": is shard 3 of 3; merge the shards first: isohf merge ";
  EXPECT_THAT(refusal([&] { const ArchiveReader reader(third); }), HasSubstr(expected));
  EXPECT_THAT(refusal([&] { (void)verify_archive(third); }), HasSubstr(expected));
  EXPECT_THAT(refusal([&] {
                (void)extract_tiles(third, folder / "a.isohf", 0, {{0, 0}, {1, 1}});
              }),
              HasSubstr(expected));
  EXPECT_THAT(refusal([&] { (void)diff_archives(third, third); }), HasSubstr(expected));
  EXPECT_EQ(ArchiveReader(third, ArchiveReader::Shards::kRead).metadata().grid.tile_columns(),
            ArchiveReader(make("whole.isohf")).grid().tile_columns());
}

TEST_F(Shards, AllThatIsWrongIsSaidBeforeAnythingIsWritten) {
  Hills source;
  const std::vector<std::string> files = make_shards(source, 3, "part-");
  const auto merged = [&](const std::vector<std::string>& parts) {
    const std::string why = refusal([&] { (void)merge_shards(parts, folder / "refused.isohf"); });
    EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf"));
    EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf.part"));
    return why;
  };
  std::string bytes = test::read_file(files[1]);
  test::write_file(folder / "cut.isohf", bytes.substr(0, bytes.size() / 2));
  char& code = bytes[bytes.find(".tile") + 20];
  code = static_cast<char>(code ^ 1);
  test::write_file(folder / "bit.isohf", bytes);
  const std::vector<std::string> four = make_shards(source, 4, "four-");
  const std::string whole = make("whole.isohf");
  options.effort = Effort::kFast;
  const std::vector<std::string> foreign = make_shards(source, 3, "other-");
  const std::string found = merged({files[0], files[0], foreign[1], folder / "none.isohf", four[0], whole,
                                    folder / "cut.isohf", folder / "bit.isohf"});
  EXPECT_THAT(found, HasSubstr("none.isohf"));
  EXPECT_THAT(found, HasSubstr("other-1.isohf: is a shard of another conversion than"));
  EXPECT_THAT(found, HasSubstr("four-4.isohf: is shard 4 of 4, "));
  EXPECT_THAT(found, HasSubstr("whole.isohf: is an archive, not a shard"));
  EXPECT_THAT(found, HasSubstr("cut.isohf: "));
  EXPECT_THAT(found, HasSubstr("bit.isohf: its members' data"));
  EXPECT_THAT(found, HasSubstr("is shard 2, as "));
  EXPECT_THAT(found, HasSubstr("of 3 shards these are missing: 1,3"));
  const MissingShards missing = missing_shards({files[0], foreign[1], folder / "cut.isohf"});
  EXPECT_EQ(missing.numbers, (std::vector<int>{1, 3}));
  EXPECT_EQ(missing.count, 3);
  EXPECT_THAT(refusal([&] { (void)missing_shards({folder / "none.isohf"}); }), HasSubstr("none.isohf"));
  // A local header that no reader of the data looks at: found while members are copied, which then leaves nothing.
  options.planes = false;
  const std::vector<std::string> halves = make_shards(source, 2, "half-");
  std::string dated = test::read_file(halves[1]);
  char& date = dated[dated.find("tiles/") - 30 + 12];
  date = static_cast<char>(date ^ 1);
  test::write_file(halves[1], dated);
  EXPECT_THAT(merged(halves), HasSubstr("no local header that says what the index says"));
}

TEST_F(Shards, AreRefusedWithoutWhatNoneCanKnow) {
  Hills source;
  const auto refused = [&](const ShardNumber& shard) {
    return refusal([&] { (void)convert_shard(source, shard, folder / "a.isohf", options); });
  };
  EXPECT_THAT(refused({4, 3}), HasSubstr("there is no shard 4 of 3"));
  for (const ShardNumber& shard : {ShardNumber{0, 1}, ShardNumber{2, 1}, ShardNumber{-1, -1}}) {
    EXPECT_THAT(refused(shard), HasSubstr("there is no shard"));
  }
  EXPECT_THAT(refused({1, 1000}), HasSubstr("1000 shards are too many: the rows of tiles make "));
  options.z_range.reset();
  EXPECT_THAT(refused({1, 3}), HasSubstr("a shard needs `z_range`"));
  options.z_range = {270.0, 330.0};
  options.max_error = 1.0;
  EXPECT_THAT(refused({1, 3}), HasSubstr("`max_error` needs all of the source"));
}

TEST(TileRange, MeetsAndIsPutAround) {
  const TileRange west{{0, 2}, {4, 6}};
  const TileRange east{{3, 0}, {9, 5}};
  EXPECT_EQ(intersection(west, east), (TileRange{{3, 2}, {4, 5}}));
  EXPECT_EQ(around(west, east), (TileRange{{0, 0}, {9, 6}}));
  EXPECT_FALSE(intersection(west, east).is_empty());
  EXPECT_TRUE(intersection(west, {{4, 2}, {5, 6}}).is_empty());  // side by side
  EXPECT_TRUE((TileRange{{0, 3}, {4, 3}}).is_empty());
}

TEST_F(Parts, DiffDecodesNothingAndListsMetadata) {
  const std::string whole = make("whole.isohf");
  options.effort = Effort::kFast;
  const std::string other = make("other.isohf");
  const ArchiveDifference difference = diff_archives(whole, other);
  EXPECT_TRUE(difference.same_tiles());
  EXPECT_FALSE(difference.surface.has_value());
  bool names_level = false;
  for (const auto& member : difference.metadata) {
    names_level = names_level || (member.name == "/level" && member.second == "2");
  }
  EXPECT_TRUE(names_level);
  const TileGrid grid = ArchiveReader(whole).grid();
  const TileRange touched = tiles_touching(grid, {0.5 * grid.extent_x(), 0.0, 2.0 * grid.extent_x(), 1e-3});
  EXPECT_EQ(touched, (TileRange{{0, 0}, {2, 1}}));
  EXPECT_THROW((void)tiles_touching(grid, {-9.0, -9.0, -8.0, -8.0}), Error);
}

}  // namespace
}  // namespace isohf
