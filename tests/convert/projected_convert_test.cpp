/// Archives of sources in degrees: heights at their places, joined globes.

#include <gtest/gtest.h>

#include <cmath>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/projection/projection.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using Source = test::MemorySource<float>;
constexpr double kDegree = M_PI / 180.0;

double land(double longitude, double latitude) {
  return 500.0 + 300.0 * std::sin(0.9 * longitude) * std::cos(1.1 * latitude) + 8.0 * latitude;
}

struct Ground {
  const char* body;
  Ellipsoid ellipsoid;
  GeoExtent extent;
};

std::unique_ptr<Source> source_over(const Ground& ground, std::int64_t width, std::int64_t height,
                                    Registration registration = Registration::kArea) {
  const GeoExtent& e = ground.extent;
  const bool area = registration == Registration::kArea;
  const double dx = (e.east - e.west) / static_cast<double>(area ? width : width - 1);
  const double dz = (e.north - e.south) / static_cast<double>(area ? height : height - 1);
  const double first_x = e.west + (area ? dx / 2.0 : 0.0);
  const double first_y = e.north - (area ? dz / 2.0 : 0.0);
  auto source = std::make_unique<Source>(SampleType::kFloat32, width, height, [&](std::int64_t c, std::int64_t r) {
    return land(first_x + static_cast<double>(c) * dx, first_y - static_cast<double>(r) * dz);
  });
  Georeference& place = source->mutable_info().georeference;
  place = test::place_at(registration, HorizontalUnit::kDegree, first_x, first_y, dx);
  place.spacing_y = dz;
  place.system.body = ground.body;
  place.system.semi_major_axis_m = ground.ellipsoid.semi_major_axis_m;
  place.system.inverse_flattening = ground.ellipsoid.inverse_flattening;
  source->mutable_info().vertical_unit = "metre";
  return source;
}

ConvertOptions options_for(const std::string& projection) {
  ConvertOptions options;
  options.plan.shape = {36, 35};
  options.plan.levels = 2;
  options.plan.ground.projection = ProjectionRequest::parse(projection);
  options.step = 0.02;
  options.producer = "isohf test";
  return options;
}

const Ground kGrounds[] = {{"Earth", {}, {-3.0, 42.0, 5.0, 50.0}},
                           {"Mars", {3396190.0, 169.894447223612}, {130.0, -12.0, 142.0, -2.0}}};

/// The map place of a stored vertex.
GeoPoint place_of(const Metadata& metadata, const Projection& map, TileIndex tile, GridVertex vertex) {
  const WorldPoint world = metadata.grid.world_from_lattice(metadata.grid.lattice_vertex(tile, vertex));
  return map.inverse({metadata.projection->origin.easting + world.x, metadata.projection->origin.northing - world.z});
}

TEST(ProjectedArchive, HeightsLieAtTheirLongitudeAndLatitude) {
  const test::TemporaryFolder folder;
  for (const Ground& ground : kGrounds) {
    for (const std::string kind : {"equirectangular", "local", "transverse-mercator", "utm", "lambert-conformal"}) {
      if (kind == "utm" && std::string(ground.body) != "Earth") continue;
      SCOPED_TRACE(kind + " on " + ground.body);
      const auto source = source_over(ground, 300, 300);
      ConvertOptions options = options_for(kind);
      options.overwrite = true;
      (void)convert(*source, folder / "a.isohf", options);
      const ArchiveReader archive(folder / "a.isohf");
      const Metadata& metadata = archive.metadata();
      const Projection map(metadata.projection->spec);
      EXPECT_EQ(metadata.projection->spec.ellipsoid.semi_major_axis_m, ground.ellipsoid.semi_major_axis_m);
      EXPECT_NEAR(metadata.projection->worst_scale_error, worst_scale_error(map, ground.extent).worst, 1e-9);
      std::int64_t compared = 0;
      for (std::int64_t t = 0; t < metadata.grid.tile_count(); ++t) {
        const std::vector<double> heights = archive.read_elevations(metadata.grid.tile_at(t));
        const TileShape& shape = metadata.grid.shape();
        for (int r = 0; r < shape.rows(); ++r) {
          for (int c = 0; c < shape.columns(); ++c) {
            const GeoPoint at = place_of(metadata, map, metadata.grid.tile_at(t), {c, r});
            const GeoExtent& e = ground.extent;
            const double margin = 0.1;  // two samples: mirrored taps bend at the edge
            if (at.longitude < e.west + margin || at.longitude > e.east - margin) continue;
            if (at.latitude < e.south + margin || at.latitude > e.north - margin) continue;
            // Slopes of up to 340 a degree: 0.01 sample is 0.14; a waves' 0.03 of a radian a sample errs by 0.01.
            ASSERT_NEAR(heights[static_cast<std::size_t>(r * shape.columns() + c)], land(at.longitude, at.latitude),
                        0.2);
            ++compared;
          }
        }
      }
      EXPECT_GT(compared, 50000);
    }
  }
}

TEST(ProjectedArchive, PassesEveryCheckAgainstItsSource) {
  const test::TemporaryFolder folder;
  const Ground cap{"Earth", {}, {-180.0, 60.0, 180.0, 90.0}};
  const Ground across{"Earth", {}, {178.0, 60.0, 185.0, 66.0}};
  for (const auto& [kind, ground] : {std::pair{"local", kGrounds[0]}, std::pair{"lambert-conformal", kGrounds[1]},
                                     std::pair{"transverse-mercator", across}, std::pair{"polar-stereographic", cap}}) {
    for (const char* filter : {"bilinear", "limited-cubic", "bspline3"}) {
      SCOPED_TRACE(std::string(kind) + " " + filter);
      const auto source = source_over(ground, 240, 150);
      for (int i = 0; i < 40; ++i) source->at(37 + i % 8, 60 + i / 8) = std::numeric_limits<float>::quiet_NaN();
      ConvertOptions options = options_for(kind);
      options.filter = filter_from_string(filter);
      options.overwrite = true;
      (void)convert(*source, folder / "a.isohf", options);
      EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
      const ArchiveReader archive(folder / "a.isohf");
      const VertexReport vertices = check_vertices(archive, *source);
      EXPECT_EQ(vertices.wrong, 0);
      EXPECT_GT(vertices.vertices, 10000);
      const AccuracyReport accuracy = compare_with_source(archive, *source);
      EXPECT_EQ(accuracy.samples, 240 * 150);
      EXPECT_EQ(accuracy.samples_void, 40);
      EXPECT_EQ(accuracy.lost_inside, 0);
      EXPECT_EQ(accuracy.invented_inside, 0);
      EXPECT_GT(accuracy.samples_compared, 240 * 150 - 400);
      // Waves of 7 degrees are 4.7 samples on the cap, and over a hundred elsewhere.
      EXPECT_LT(accuracy.rms, std::string(kind) == "polar-stereographic" ? 100.0 : 30.0);
    }
  }
}

TEST(ProjectedArchive, LosslessDoesNotDecideTheProjection) {
  const test::TemporaryFolder folder;
  const auto source = source_over(kGrounds[0], 200, 220);
  ConvertOptions options = options_for("auto");
  const Metadata without = convert(*source, folder / "a.isohf", options).metadata;
  EXPECT_NE(without.projection->spec.kind, ProjectionKind::kEquirectangular);
  options.lossless = true;
  const Metadata with = convert(*source, folder / "b.isohf", options).metadata;
  EXPECT_EQ(with.projection->spec, without.projection->spec);
  options.plan.ground.projection = ProjectionRequest::parse("local");
  EXPECT_EQ(convert(*source, folder / "c.isohf", options).metadata.projection->spec.kind, ProjectionKind::kLocal);
}

TEST(JoinedGlobe, TilesAcrossTheJoinShareTheirVertices) {
  const test::TemporaryFolder folder;
  const auto round_land = [](double longitude, double latitude) {
    return 100.0 * std::cos(latitude * kDegree) * std::cos(3.0 * longitude * kDegree) +
           40.0 * std::sin(longitude * kDegree);
  };
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    for (const char* filter : {"bilinear", "limited-cubic", "bspline3"}) {
      SCOPED_TRACE(filter);
      Source source(SampleType::kFloat32, 360, 181, [&](std::int64_t c, std::int64_t r) {
        return round_land(static_cast<double>(c) - 180.0, 90.0 - static_cast<double>(r));
      });
      source.mutable_info().georeference = test::place_at(registration, HorizontalUnit::kDegree, -180.0, 90.0, 1.0);
      ConvertOptions options = options_for("auto");
      options.plan.ground.wrap = Wrap::kAlways;
      options.filter = filter_from_string(filter);
      options.overwrite = true;
      (void)convert(source, folder / "a.isohf", options);
      const ArchiveReader archive(folder / "a.isohf");
      const TileGrid& grid = archive.grid();
      EXPECT_TRUE(archive.metadata().wraps_x);
      // A whole number of tiles goes round.
      EXPECT_NEAR(grid.world_width(), 2.0 * M_PI * 6378137.0, 1e-3);
      const TileShape& shape = grid.shape();
      std::int64_t shared = 0;
      for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
        const std::vector<double> east = archive.read_elevations({grid.tile_columns() - 1, row});
        const std::vector<double> west = archive.read_elevations({0, row});
        const std::int64_t round = grid.tile_columns() * 2 * shape.cell_columns();
        for (int r = 0; r < shape.rows(); ++r) {
          for (int c = 0; c < shape.columns(); ++c) {
            for (int other = 0; other < shape.columns(); ++other) {
              const LatticeVertex a = grid.lattice_vertex({grid.tile_columns() - 1, row}, {c, r});
              const LatticeVertex b = grid.lattice_vertex({0, row}, {other, r});
              if (a.x != b.x + round) continue;
              ++shared;
              const double here = east[static_cast<std::size_t>(r * shape.columns() + c)];
              const double there = west[static_cast<std::size_t>(r * shape.columns() + other)];
              ASSERT_TRUE(here == there || (std::isnan(here) && std::isnan(there))) << here << " " << there;
            }
          }
        }
        // No seam: heights at the join are the land's, though every tap East of it lies on the other side.
        for (int r = 1; r < shape.rows() - 1; ++r) {
          const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex({0, row}, {1, r}));
          const double latitude = 90.0 - world.z / (6378137.0 * (1.0 - 0.00669438) * kDegree) +
                                  (registration == Registration::kArea ? 0.5 : 0.0);
          if (std::abs(latitude) > 87.0) continue;
          const double longitude = registration == Registration::kArea ? -180.5 : -180.0;
          EXPECT_NEAR(west[static_cast<std::size_t>(r * shape.columns() + 1)], round_land(longitude, latitude), 1.0);
        }
      }
      EXPECT_GE(shared, grid.tile_rows() * shape.rows() * 3);
      EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
      EXPECT_EQ(check_vertices(archive, source).wrong, 0);
    }
  }
}

TEST(JoinedGlobe, AnInputThatDoesNotGoRoundIsRefused) {
  const test::TemporaryFolder folder;
  const auto source = source_over(kGrounds[0], 200, 220);
  ConvertOptions options = options_for("auto");
  options.plan.ground.wrap = Wrap::kAlways;
  EXPECT_STREQ(test::error_of([&] { (void)convert(*source, folder / "a.isohf", options); }).what(),
               "memory: `wrap_x` needs columns all the way round, 360 degrees; this input's 200 columns 0.04 apart "
               "make 8");
}

}  // namespace
}  // namespace isohf
