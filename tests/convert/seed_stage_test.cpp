#include "isohf/convert/stages/seed_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "isohf/archive.h"
#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/light/shadow.h"
#include "isohf/verify.h"
#include "support/rasters/memory_source.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;
constexpr double kRadian = 0.017453292519943295;

/// Ridges and pits, with a lake of voids.
class Ridges : public test::MemorySource<float> {
 public:
  explicit Ridges(std::int64_t width = 190, std::int64_t height = 60)
      : MemorySource(SampleType::kFloat32, width, height, [](std::int64_t c, std::int64_t r) {
          const auto x = static_cast<double>(c);
          const auto z = static_cast<double>(r);
          if (std::hypot(x - 80.0, z - 30.0) < 14.0) return std::numeric_limits<double>::quiet_NaN();
          return 300.0 + 9.0 * std::sin(x * 0.37 + std::sin(z * 0.2)) + 6.0 * std::sin(x * 0.05) * std::cos(z * 0.11) +
                 (std::abs(x - 20.0) < 1.5 ? 40.0 : 0.0);
        }) {}

  void read_window(const Window& window, std::span<std::byte> out) override {
    if (window.row + window.rows > fail_from_row) throw Error(ErrorCode::kCancelled, "interrupted");
    MemorySource::read_window(window, out);
  }
  std::int64_t fail_from_row = std::numeric_limits<std::int64_t>::max();
};

ConvertOptions options_with(const ShadowSeedRequest& request, CodeType type = CodeType::kU16) {
  ConvertOptions options;
  options.plan.shape = {20, 19};
  options.plan.levels = 1;
  options.code_type = type;
  options.shadow_seeds = request;
  options.overwrite = true;
  options.producer = "isohf test";
  options.z_range = {280.0, 360.0};
  return options;
}

/// S at the edge where light enters each tile of a row of tiles, carried through all of it.
void for_each_edge(const ArchiveReader& archive, LightTravel travel, double sun_deg,
                   const std::function<void(TileIndex, const TileCodes&, std::span<const double>)>& check) {
  const TileGrid& grid = archive.grid();
  const TileShape& shape = grid.shape();
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    std::vector<double> handed(static_cast<std::size_t>(visible_rows(shape)), kNoShadow);
    for (std::int64_t i = 0; i < grid.tile_columns(); ++i) {
      const TileIndex tile{travel == LightTravel::kEastward ? i : grid.tile_columns() - 1 - i, row};
      check(tile, archive.read_tile(tile), handed);
      const std::vector<double> exact = archive.read_elevations(tile);
      std::vector<float> heights(exact.begin(), exact.end());
      for (int r = 1; r <= visible_rows(shape); ++r) {
        for (int c = 1; c <= last_visible_column(shape, r); ++c) {
          const LatticeVertex at = grid.lattice_vertex(tile, {c, r});
          if (static_cast<double>(at.x) * grid.sigma_x() <= archive.metadata().valid.x1 + 1e-9 &&
              static_cast<double>(at.z) * grid.sigma_z() <= archive.metadata().valid.z1 + 1e-9) {
            continue;
          }
          heights[static_cast<std::size_t>(r * shape.columns() + c)] = NAN;  // beyond what the source covers
        }
      }
      tile_shadow(grid, {heights.data(), shape.columns(), shape.rows()}, {travel, std::tan(sun_deg * kRadian)}, handed,
                  {}, handed);
    }
  }
}

/// S at the edge where light enters a tile, elevation units, from its seeds and the padding at that edge.
std::vector<double> shadow_at_edge(const ArchiveReader& archive, const ShadowSeedReader& reader, TileIndex index,
                                   const TileCodes& tile, LightTravel travel, double sun_deg) {
  const TileShape& shape = archive.grid().shape();
  const Quantisation& quantisation = archive.metadata().quantisation;
  const double fall = reader.info().fall_per_half_step(archive.grid(), quantisation, sun_deg);
  const TileEdges edges = tile_edges(shape, tile);
  const HullSeeds seeds = reader.hulls(index, tile);
  const bool is_east = travel == LightTravel::kEastward;
  const bool is_first = index.column == (is_east ? 0 : archive.grid().tile_columns() - 1);
  std::vector<double> found;
  for (int row = 1; row <= visible_rows(shape); ++row) {
    const double before = (is_east ? edges.west : edges.east)[static_cast<std::size_t>(row - 1)];
    const WorldBounds& valid = archive.metadata().valid;
    const TileGrid& grid = archive.grid();
    const std::int64_t x = is_east ? index.column * half_steps_across(shape) - padding_distance(row)
                                   : (index.column + 1) * half_steps_across(shape) + padding_distance(row);
    const bool is_covered = x <= last_casting_step(valid.x1, grid.sigma_x()) &&
                            index.row * shape.cell_rows() + row - 1 <= last_casting_step(valid.z1, grid.sigma_z());
    double highest = is_first || !is_covered || std::isnan(before) ? kNoShadow : before - padding_distance(row) * fall;
    for (const ShadowCaster& caster : (is_east ? seeds.eastward : seeds.westward).row(row)) {
      highest = std::max(highest, caster.height - static_cast<double>(caster.distance) * fall);
    }
    found.push_back(quantisation.offset + quantisation.scale * highest);
  }
  return found;
}

/// The seeds' shadow against the one that was carried, both with the tile's own vertex.
void expect_equal_shadow(const ArchiveReader& archive, const ShadowSeedReader& reader, double sun_deg,
                         double tolerance) {
  const TileShape& shape = archive.grid().shape();
  int shaded = 0;
  for (const LightTravel travel : {LightTravel::kEastward, LightTravel::kWestward}) {
    for_each_edge(archive, travel, sun_deg,
                  [&](TileIndex index, const TileCodes& tile, std::span<const double> wanted) {
                    const std::vector<double> found = shadow_at_edge(archive, reader, index, tile, travel, sun_deg);
                    const std::vector<double> own = archive.read_elevations(index);
                    ASSERT_EQ(found.size(), wanted.size());
                    for (std::size_t i = 0; i < found.size(); ++i) {
                      const int row = static_cast<int>(i) + 1;
                      const int column = travel == LightTravel::kEastward ? 1 : last_visible_column(shape, row);
                      double edge = own[static_cast<std::size_t>(row * shape.columns() + column)];
                      if (std::isnan(edge))
                        edge = archive.metadata().quantisation.offset;  // what lies lower shades nothing
                      const double here = std::max(edge, found[i]);
                      ASSERT_NEAR(here, std::max(edge, wanted[i]), tolerance)
                          << "tile " << index.column << "," << index.row << " row " << row << " sun " << sun_deg;
                      shaded += here > edge ? 1 : 0;
                    }
                  });
  }
  EXPECT_GT(shaded, sun_deg < 6.0 ? 50 : -1);
}

TEST(SeedStage, HullsGiveTheShadowThatIsCarriedFromTileToTile) {
  const test::TemporaryFolder folder;
  Ridges source;
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const ConvertSummary summary = convert(source, folder / "a.isohf", options_with({2.0}, type));
    ASSERT_GT(summary.metadata.grid.tile_columns(), 8);
    const ArchiveReader archive(folder / "a.isohf");
    const ShadowSeedReader reader(archive);
    EXPECT_EQ(reader.info().sun_min_deg, 2.0);
    EXPECT_EQ(reader.info().bytes, summary.seed_bytes);
    for (const double sun : {2.0, 3.3, 5.0, 12.0, 45.0, 80.0}) {
      // roundings of elevations of 300 to float
      expect_equal_shadow(archive, reader, sun, 1e-3);
    }
  }
}

TEST(SeedStage, FeetAndMetresAreKeptApart) {
  const test::TemporaryFolder folder;
  Ridges source;
  source.mutable_info().vertical_unit = "foot";
  source.mutable_info().metres_per_vertical_unit = 0.3048;
  source.mutable_info().georeference.unit = HorizontalUnit::kMetre;
  (void)convert(source, folder / "a.isohf", options_with({2.0}));
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_NEAR(ShadowSeedReader(archive).info().elevation_units_per_world_unit, 1.0 / 0.3048, 1e-12);
}

TEST(SeedStage, AWorldOfDegreesHasNoSeeds) {
  const test::TemporaryFolder folder;
  Ridges source;
  source.mutable_info().georeference.unit = HorizontalUnit::kDegree;
  ConvertOptions options = options_with({2.0});
  options.plan.ground.projection.is_auto = false;
  options.plan.ground.projection.kind = ProjectionKind::kNone;
  EXPECT_THROW((void)convert(source, folder / "a.isohf", options), Error);
  options.shadow_seeds.reset();
  EXPECT_NO_THROW((void)convert(source, folder / "a.isohf", options));
}

TEST(SeedStage, ArchivesWithSeedsVerifyAndUnzip) {
  const test::TemporaryFolder folder;
  Ridges source;
  (void)convert(source, folder / "a.isohf", options_with({2.0}));
  const VerifyReport report = verify_archive(folder / "a.isohf", {});
  for (const Finding& finding : report.findings) ADD_FAILURE() << finding_name(finding.id) << " " << finding.text;
  EXPECT_TRUE(report.passed());
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_FALSE(archive.reads_by_directory());
  EXPECT_EQ(static_cast<std::int64_t>(archive.members().size()) - 3, ShadowSeedReader(archive).info().members);
  if (!fs::exists("/usr/bin/unzip")) GTEST_SKIP() << "no unzip";
  const test::RunResult unzip = test::run_program({"/usr/bin/unzip", "-tqq", folder / "a.isohf"});
  EXPECT_EQ(unzip.exit_code, 0) << unzip.out << unzip.err;
}

TEST(SeedStage, AResumeFromAnyTileGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  Ridges source;
  ConvertOptions options = options_with({2.0});
  (void)convert(source, folder / "whole.isohf", options);
  const std::string whole = test::read_file(folder / "whole.isohf");
  // Interrupted before the last row of tiles; by one thread, which is never so far behind the reading that it has
  // written next to nothing.
  source.fail_from_row = 59;
  EXPECT_THROW((void)convert(source, folder / "a.isohf", options, {.threads = 1}), Error);
  source.fail_from_row = std::numeric_limits<std::int64_t>::max();
  const std::string part = test::read_file(folder / "a.isohf.part");
  const std::string journal = test::read_file(folder / "a.isohf.part.journal");
  options.resume = true;
  ASSERT_GT(journal.size(), 4000U);
  for (std::size_t kept = 0; kept <= journal.size(); kept += 1013) {
    fs::remove(folder / "a.isohf");
    test::write_file(folder / "a.isohf.part", part);
    test::write_file(folder / "a.isohf.part.journal", journal.substr(0, kept));
    (void)convert(source, folder / "a.isohf", options);
    ASSERT_TRUE(test::read_file(folder / "a.isohf") == whole) << kept << " bytes of the journal";
  }
}

TEST(SeedStage, RefusesSunsThatAreNone) {
  const test::TemporaryFolder folder;
  Ridges source(40, 40);
  for (const ShadowSeedRequest& request : std::vector<ShadowSeedRequest>{{0.0}, {90.0}, {NAN}}) {
    EXPECT_THROW((void)convert(source, folder / "a.isohf", options_with(request)), Error);
    EXPECT_FALSE(fs::exists(folder / "a.isohf"));
  }
}

TEST(SeedStage, BeginsAgainWhereARowsSeedsAreMissing) {
  const TileGrid grid = TileGrid::make(TileShape::make(5, 5, 1), 4, 3, 1.0, 1.0);
  const std::int64_t wanted[] = {0, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8};
  for (std::int64_t next = 0; next <= 12; ++next) EXPECT_EQ(SeedStage::first_tile_needed(grid, next), wanted[next]);
}

TEST(ShadowSeedReader, SaysWhereThereAreNoSeeds) {
  const test::TemporaryFolder folder;
  Ridges source(40, 40);
  ConvertOptions options = options_with({});
  options.shadow_seeds.reset();
  (void)convert(source, folder / "a.isohf", options);
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_THROW(ShadowSeedReader reader(archive), Error);
}

}  // namespace
}  // namespace isohf
