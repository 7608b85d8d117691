#include "isohf/shards.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "isohf/archive/attach.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/memory_source.h"
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
  }
  std::string make(const std::string& name, double rise = 0.0) {
    Hills source(rise);
    (void)convert(source, folder / name, options);
    return folder / name;
  }
  std::string cut(const std::string& archive, const std::string& name, const TileRange& tiles) {
    (void)extract_tiles(archive, folder / name, tiles, {.overwrite = true});
    return folder / name;
  }
  std::string message_of(const std::vector<std::string>& archives) {
    try {
      (void)merge_archives(archives, folder / "refused.isohf");
    } catch (const Error& error) {
      EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf"));
      EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf.part"));
      return error.what();
    }
    return "nothing was refused";
  }

  test::TemporaryFolder folder;
  ConvertOptions options;
};

TEST_F(Parts, ComplementaryOnesGiveTheWholesBytesInAnyOrder) {
  test::MemoryPhoto photo(210, 150, 3, [](std::int64_t c, std::int64_t r, int channel) {
    return static_cast<int>((c * 3 + r * 5 + channel * 60) % 256);
  });
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    options.code_type = type;
    options.texture.emplace();
    options.texture->photo = &photo;
    const std::string whole = make("whole.isohf");
    test::write_file(folder / "note.txt", "belongs to all of it");
    (void)attach_members(whole, {{folder / "note.txt", "note.txt"}});
    const TileGrid grid = ArchiveReader(whole).grid();
    const std::int64_t columns = grid.tile_columns();
    const std::int64_t rows = grid.tile_rows();
    ASSERT_GT(columns, 9);
    ASSERT_GT(rows, 8);
    const std::string west = cut(whole, "w.isohf", {{0, 0}, {9, 7}});
    const std::string east = cut(whole, "e.isohf", {{9, 0}, {columns, 7}});
    const std::string south = cut(whole, "s.isohf", {{0, 7}, {columns, rows}});
    for (const std::string& part : {west, east, south}) {
      EXPECT_TRUE(verify_archive(part).passed()) << part;
      const ArchiveReader reader(part);
      EXPECT_FALSE(tiles_of(reader.metadata()) == tiles_of(ArchiveReader(whole).metadata()));
      EXPECT_TRUE(reader.find_member("note.txt").has_value());
    }
    const PartSummary joined = merge_archives({south, west, east}, folder / "joined.isohf", {.overwrite = true});
    EXPECT_TRUE(joined.is_whole);
    EXPECT_TRUE(joined.same_as_whole);
    EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole));
    // By way of a part of two parts, and of a part cut from that.
    (void)merge_archives({west, east}, folder / "north.isohf", {.overwrite = true});
    EXPECT_TRUE(verify_archive(folder / "north.isohf").passed());
    const std::string again = cut(folder / "north.isohf", "again.isohf", {{0, 0}, {9, 7}});
    EXPECT_EQ(test::read_file(again), test::read_file(west));
    (void)merge_archives({folder / "north.isohf", south}, folder / "joined.isohf", {.overwrite = true});
    EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole));
  }
}

TEST_F(Parts, OfALosslessArchiveShareItsResidualsAndGiveThemBack) {
  options.lossless = true;
  const std::string whole = make("whole.isohf");
  const TileGrid grid = ArchiveReader(whole).grid();
  const std::int64_t columns = grid.tile_columns();
  const std::string north_west = cut(whole, "nw.isohf", {{0, 0}, {5, 4}});
  const std::string north_east = cut(whole, "ne.isohf", {{5, 0}, {columns, 4}});
  const std::string south = cut(whole, "s.isohf", {{0, 4}, {columns, grid.tile_rows()}});
  for (const std::string& part : {north_west, north_east, south}) {
    const ArchiveReader reader(part);
    EXPECT_TRUE(verify_archive(part).passed()) << part;
    EXPECT_FALSE(lossless_record(reader.metadata()).has_value()) << "it cannot give the samples";
    EXPECT_EQ(reader.find_member("residual/00000000").has_value(), part == north_west);
  }
  const PartSummary joined = merge_archives({south, north_east, north_west}, folder / "joined.isohf");
  EXPECT_TRUE(joined.same_as_whole);
  EXPECT_TRUE(joined.warnings.empty());
  EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole));
  // Joined with other land they are nobody's.
  const std::string changed = make("changed.isohf", 9.0);
  const PartSummary mixed = merge_archives({whole, changed}, folder / "mixed.isohf");
  ASSERT_EQ(mixed.warnings.size(), 1U);
  EXPECT_THAT(mixed.warnings.front(), HasSubstr("residuals are left out"));
  EXPECT_FALSE(ArchiveReader(folder / "mixed.isohf").find_member("residual/00000000").has_value());
  EXPECT_TRUE(verify_archive(folder / "mixed.isohf").passed());
}

TEST_F(Parts, LastArchiveGivesTheTileAndEverythingFollows) {
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
  // With what is around, so that edges meet: but the seeds of these rows are those of the joined tiles.
  const TileRange& around = difference.bounds;
  const std::string update = cut(changed, "update.isohf", around);
  const PartSummary joined = merge_archives({old, update}, folder / "joined.isohf");
  EXPECT_FALSE(joined.same_as_whole);
  EXPECT_EQ(ArchiveReader(folder / "joined.isohf").metadata().content_sha256,
            ArchiveReader(changed).metadata().content_sha256);
  EXPECT_TRUE(verify_archive(folder / "joined.isohf").passed());
  EXPECT_TRUE(diff_archives(changed, folder / "joined.isohf").same_tiles());
  // Parts of two origins need no neighbours beyond their own; what lies beside tiles must be of one kind.
  const PartSummary small = merge_archives({cut(old, "old_part.isohf", around), update}, folder / "parts.isohf");
  EXPECT_EQ(small.tiles, around);
  EXPECT_TRUE(diff_archives(changed, folder / "parts.isohf").same_tiles());
  options.shadow_seeds.reset();
  EXPECT_THAT(message_of({old, make("unlit.isohf")}), HasSubstr("has other shadow seeds than"));
  options.shadow_seeds.emplace();
  options.filter = Filter::kBilinear;
  const PartSummary other = merge_archives({old, make("bilinear.isohf")}, folder / "other.isohf");
  EXPECT_THAT(other.warnings, testing::ElementsAre(HasSubstr("bilinear.isohf: was made with another filter than")));
  EXPECT_EQ(small.warnings.size(), 0U);
  options.filter.reset();
  // A piece of it does not meet what lies around.
  const std::string torn = cut(changed, "torn.isohf", {around.first, {around.first.column + 1, around.end.row}});
  if (around.end.column - around.first.column > 1) {
    EXPECT_THAT(message_of({old, torn}), HasSubstr("does not meet its neighbour of"));
  }
}

TEST_F(Parts, AllThatIsWrongIsSaidBeforeAnythingIsWritten) {
  const std::string whole = make("whole.isohf");
  const std::int64_t columns = ArchiveReader(whole).grid().tile_columns();
  const std::string west = cut(whole, "w.isohf", {{0, 0}, {4, 5}});
  const std::string east = cut(whole, "e.isohf", {{6, 0}, {columns, 5}});
  EXPECT_THAT(message_of({west, east}), HasSubstr("tiles of columns 4 to 5 and rows 0 to 4 are in none"));
  std::string bytes = test::read_file(east);
  test::write_file(folder / "cut.isohf", bytes.substr(0, bytes.size() / 2));
  bytes[bytes.size() / 3] = static_cast<char>(bytes[bytes.size() / 3] ^ 1);
  test::write_file(folder / "bit.isohf", bytes);
  const std::string found = message_of({west, folder / "cut.isohf", folder / "none.isohf", folder / "bit.isohf"});
  for (const char* name : {"cut.isohf: ", "none.isohf: ", "bit.isohf: its members' data"}) {
    EXPECT_THAT(found, HasSubstr(name));
  }
  options.step = 0.01;
  options.z_range.reset();
  const std::string other = make("other.isohf");
  EXPECT_THAT(message_of({whole, other}), HasSubstr("other.isohf: has elevations"));
  // Elevations are compared whatever their codes: both steps together are as far as they can lie apart.
  const ArchiveDifference apart = diff_archives(whole, other, true);
  EXPECT_EQ(apart.why_other_lattice, "");
  EXPECT_GT(apart.surface->compared, 0);
  EXPECT_LE(apart.surface->max, 0.5 * (ArchiveReader(whole).metadata().quantisation.scale + 0.01) + 1e-4);
  EXPECT_THROW((void)merge_archives({whole}, whole, {.overwrite = true}), Error);
  EXPECT_THROW(cut(whole, "beyond.isohf", {{0, 0}, {columns + 1, 1}}), Error);
  EXPECT_THROW(cut(west, "beyond.isohf", {{3, 0}, {5, 1}}), Error);
}

/// The shards of a plan, made in an odd order.
class Shards : public Parts {
 protected:
  std::vector<std::string> make_shards(HeightSource& source, const ShardPlan& plan, const std::string& name) {
    std::vector<std::string> files;
    const int count = static_cast<int>(plan.shards.size());
    for (int i = 0; i < count; ++i) {
      const int number = count % 2 == 0 ? count - i : (i * 2 + 1) % count + 1;
      files.push_back(folder / (name + std::to_string(number) + ".isohf"));
      (void)convert_shard(source, plan, number, files.back(), options);
      EXPECT_TRUE(is_shard(files.back(), plan, number));
      EXPECT_EQ(is_shard(files.back(), plan, number % count + 1), count == 1);
      EXPECT_TRUE(verify_archive(files.back()).passed()) << number;
    }
    return files;
  }
  std::string refusal(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing was refused";
  }
};

TEST_F(Shards, JoinToTheBytesOfOneRun) {
  test::MemoryPhoto photo(210, 150, 3, [](std::int64_t c, std::int64_t r, int channel) {
    return static_cast<int>((c * 3 + r * 5 + channel * 60) % 256);
  });
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    for (const bool given : {true, false}) {
      options.code_type = type;
      if (!given) options.z_range.reset();
      options.filter = given ? Filter::kBspline3 : Filter::kBilinear;
      if (!given) options.plan.shape = {8, 11};  // two shards end with rows of the first plane: nothing is decoded
      options.texture.emplace();
      options.texture->photo = &photo;
      const std::string whole = make("whole.isohf");
      Hills source;
      const int count = given ? 5 : 2;
      const ShardPlan plan = parse_shard_plan(format_shard_plan(plan_shards(source, options, count)));
      ASSERT_EQ(static_cast<int>(plan.shards.size()), count);
      const std::vector<std::string> files = make_shards(source, plan, "part-");
      EXPECT_TRUE(missing_shards(plan, files).empty());
      const PartSummary joined = merge_shards(plan, files, folder / "joined.isohf", {.overwrite = true});
      EXPECT_TRUE(joined.is_whole);
      EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole));
    }
    options.z_range = {270.0, 330.0};
    options.plan.shape = {12, 19};
  }
}

TEST_F(Shards, OfALosslessConversionJoinToItsBytes) {
  options.lossless = true;
  for (const CodeType type : {CodeType::kU8, CodeType::kF32}) {
    for (const int count : {2, 5, 9}) {
      options.code_type = type;
      options.filter = Filter::kBilinear;
      if (type == CodeType::kF32) options.z_range.reset();
      const std::string whole = make("whole.isohf");
      Hills source;
      const ShardPlan plan = parse_shard_plan(format_shard_plan(plan_shards(source, options, count)));
      EXPECT_EQ(plan.samples_sha256, lossless_record(ArchiveReader(whole).metadata())->sha256);
      const std::vector<std::string> files = make_shards(source, plan, "part-");
      const PartSummary joined = merge_shards(plan, files, folder / "joined.isohf", {.overwrite = true});
      EXPECT_TRUE(joined.warnings.empty());
      EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(whole));
      options.lossless = false;
      EXPECT_THAT(refusal([&] { (void)convert_shard(source, plan, 1, folder / "a.isohf", options); }),
                  HasSubstr("planned was \"lossless\""));
      options.lossless = true;
    }
  }
}

TEST(ShardList, JoinsNumbersThatFollowEachOther) {
  EXPECT_EQ(shard_list({1, 3, 4, 5, 9}), "1,3-5,9");
}

TEST_F(Shards, OfFewRowsAreAsManyAsThereAreRows) {
  Hills source;
  const ShardPlan plan = plan_shards(source, options, 1000);
  EXPECT_EQ(static_cast<std::int64_t>(plan.shards.size()), plan.tile_rows);
  const ShardPlan two = plan_shards(source, options, 1);
  ASSERT_EQ(two.shards.size(), 1U);
  (void)make("whole.isohf");
  (void)merge_shards(two, make_shards(source, two, "one-"), folder / "joined.isohf");
  EXPECT_EQ(test::read_file(folder / "joined.isohf"), test::read_file(folder / "whole.isohf"));
}

TEST_F(Shards, InterruptedGoOnAndGiveTheSameBytes) {
  Hills source;
  const ShardPlan plan = plan_shards(source, options, 3);
  const std::vector<std::string> files = make_shards(source, plan, "part-");
  const std::string file = folder / "again.isohf";
  std::atomic<bool> cancel = false;
  Job job;
  job.cancel = &cancel;
  job.progress = [&](const Progress& at) { cancel = at.done > at.total / 2; };
  options.resume = true;
  EXPECT_THROW((void)convert_shard(source, plan, 2, file, options, job), Error);
  EXPECT_FALSE(is_shard(file, plan, 2));
  (void)convert_shard(source, plan, 2, file, options);
  EXPECT_EQ(test::read_file(file), test::read_file(folder / "part-2.isohf"));
  // What another shard left under the name is told of, and where it was removed its journal is in nobody's way.
  std::filesystem::remove(file);
  cancel = false;
  EXPECT_THROW((void)convert_shard(source, plan, 2, file, options, job), Error);
  EXPECT_THAT(refusal([&] { (void)convert_shard(source, plan, 3, file, options); }),
              HasSubstr(".part belongs to another input or other options; remove it to start over"));
  std::filesystem::remove(file + ".part");
  (void)convert_shard(source, plan, 3, file, options);
  EXPECT_EQ(test::read_file(file), test::read_file(folder / "part-3.isohf"));
}

TEST_F(Shards, AreRefusedWhereTheyAreNotWhatWasPlanned) {
  Hills source;
  const ShardPlan plan = plan_shards(source, options, 3);
  const std::vector<std::string> files = make_shards(source, plan, "part-");
  const auto merged = [&](const std::vector<std::string>& parts) {
    return refusal([&] { (void)merge_shards(plan, parts, folder / "refused.isohf"); });
  };
  options.level = 2;
  EXPECT_THAT(refusal([&] { (void)convert_shard(source, plan, 1, folder / "a.isohf", options); }),
              HasSubstr("are not those that were planned: \"level 2\", planned was \"level"));
  EXPECT_THAT(refusal([&] { (void)convert_shard(source, plan, 4, folder / "a.isohf", options); }),
              HasSubstr("there is no shard 4: the plan has 1 to 3"));
  const ShardPlan other = plan_shards(source, options, 3);
  const std::vector<std::string> foreign = make_shards(source, other, "other-");
  const std::string found = merged({files[0], files[0], foreign[1], folder / "none.isohf"});
  EXPECT_THAT(found, HasSubstr("none.isohf"));
  EXPECT_THAT(found, HasSubstr("other-1.isohf: is a shard of another plan"));
  EXPECT_THAT(found, HasSubstr("is shard 2, as "));
  EXPECT_THAT(found, HasSubstr("of the plan's 3 shards these are missing: 1,3"));
  EXPECT_EQ(missing_shards(plan, {files[0], foreign[1]}), (std::vector<int>{1, 3}));
  EXPECT_THAT(refusal([&] { (void)merge_archives(files, folder / "refused.isohf"); }),
              HasSubstr("name its plan first"));
  EXPECT_THAT(merged({make("whole.isohf"), files[0], files[1], files[2]}), HasSubstr("is no shard of a plan"));
  // A local header that no reader of the data looks at: found while members are copied, which then leaves nothing.
  options.planes = false;
  const ShardPlan two = plan_shards(source, options, 2);
  const std::vector<std::string> halves = make_shards(source, two, "half-");
  std::string dated = test::read_file(halves[1]);
  char& date = dated[dated.find("tiles/") - 30 + 12];
  date = static_cast<char>(date ^ 1);
  test::write_file(halves[1], dated);
  EXPECT_THAT(refusal([&] { (void)merge_shards(two, halves, folder / "refused.isohf"); }),
              HasSubstr("no local header that says what the index says"));
  EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf.part"));
  EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf"));
  options.max_error = 1.0;
  EXPECT_THAT(refusal([&] { (void)plan_shards(source, options, 2); }),
              HasSubstr("`max_error` needs all of the source"));
  std::string json = format_shard_plan(plan);
  EXPECT_THAT(refusal([&] { (void)parse_shard_plan("{}"); }), HasSubstr("format: is missing"));
  json.replace(json.find("\"version\": 2"), 12, "\"version\": 9");
  EXPECT_THAT(refusal([&] { (void)parse_shard_plan(json); }), HasSubstr("version 9, 2 is read"));
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
  options.level = 3;
  const std::string other = make("other.isohf");
  const ArchiveDifference difference = diff_archives(whole, other);
  EXPECT_TRUE(difference.same_tiles());
  EXPECT_FALSE(difference.surface.has_value());
  bool names_level = false;
  for (const auto& member : difference.metadata) {
    names_level = names_level || (member.name == "/level" && member.second == "3");
  }
  EXPECT_TRUE(names_level);
  const TileGrid grid = ArchiveReader(whole).grid();
  const TileRange touched = tiles_touching(grid, {0.5 * grid.extent_x(), 0.0, 2.0 * grid.extent_x(), 1e-3});
  EXPECT_EQ(touched, (TileRange{{0, 0}, {2, 1}}));
  EXPECT_THROW((void)tiles_touching(grid, {-9.0, -9.0, -8.0, -8.0}), Error);
}

}  // namespace
}  // namespace isohf
