/// Mosaics, --bbox, globes, --geoid, --fill and every --to-crs in one conversion, against the ground they show.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "formats/registry.h"
#include "isohf/archive.h"
#include "isohf/projection/projection.h"
#include "isohf/raster.h"
#include "support/rasters/degree_grid.h"
#include "support/rasters/raster.h"
#include "support/rasters/small_geoid.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using Words = std::vector<std::string>;

constexpr double kDegree = M_PI / 180.0;
constexpr float kNoData = -9999.0F;

/// A grid of areas in degrees, and what a sample of it is.
struct Ground {
  std::int64_t columns;
  std::int64_t rows;
  double west;
  double south;
  double cell;
  std::function<double(double longitude, double latitude)> height;
  std::function<bool(double longitude, double latitude)> is_void;

  [[nodiscard]] double longitude(std::int64_t column) const {
    return west + (static_cast<double>(column) + 0.5) * cell;
  }
  [[nodiscard]] double latitude(std::int64_t row) const {
    return south + (static_cast<double>(rows - row) - 0.5) * cell;
  }
  [[nodiscard]] float sample(std::int64_t column, std::int64_t row) const {
    const double x = longitude(column);
    const double y = latitude(row);
    return is_void(x, y) ? kNoData : static_cast<float>(height(x, y));
  }
  /// A part of it as GridFloat.
  void write(const std::string& stem, const Window& part) const {
    write_gridfloat(stem, part.columns, part.rows, west + static_cast<double>(part.column) * cell,
                    south + static_cast<double>(rows - part.row - part.rows) * cell, cell,
                    [&](std::int64_t c, std::int64_t r) { return sample(part.column + c, part.row + r); });
  }
  /// The whole, and a folder of pieces that do not fit tiles.
  void write_whole_and_pieces(const TemporaryFolder& folder) const {
    write(folder / "whole", {0, 0, columns, rows});
    std::filesystem::create_directory(folder / "pieces");
    const std::int64_t c = columns * 2 / 5;
    const std::int64_t r = rows / 3;
    write(folder / "pieces/nw", {0, 0, c, r});
    write(folder / "pieces/ne", {c, 0, columns - c, r});
    write(folder / "pieces/sw", {0, r, c, rows - r});
    write(folder / "pieces/se", {c, r, columns - c, rows - r});
  }
};

/// Undulation in metres, smooth enough for a grid of one degree.
double geoid_height(double longitude, double latitude) {
  return 30.0 + 15.0 * std::cos(longitude * kDegree) + 10.0 * std::sin(2.0 * latitude * kDegree);
}

double distance_in_turn(double a, double b) {
  return std::abs(std::remainder(a - b, 360.0));
}

/// Options of one run, and what its surface must be.
struct Combination {
  std::string kind;
  bool fill = false;
  bool geoid = false;
  std::optional<std::array<double, 4>> box;
  Words more;
  std::string step = "0.01";

  [[nodiscard]] Words geoid_option(const TemporaryFolder& folder) const {
    return geoid ? Words{"--geoid", folder / "geoid.pgm"} : Words{};
  }
  [[nodiscard]] Words options(const TemporaryFolder& folder) const {
    Words words = geoid_option(folder);
    if (box) {
      words.insert(words.end(), {"--bbox", std::to_string((*box)[0]) + "," + std::to_string((*box)[1]) + "," +
                                               std::to_string((*box)[2]) + "," + std::to_string((*box)[3])});
    }
    words.insert(words.end(), {"--to-crs", kind, "--step", step});
    if (fill) words.insert(words.end(), {"--fill=10"});
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

RunResult run_with(Words command, const Words& options) {
  command.insert(command.end(), options.begin(), options.end());
  return run_isohf(command);
}

class GeographicCombinations : public testing::Test {
 protected:
  GeographicCombinations() { write_geoid(folder / "geoid.pgm", 360, 181, geoid_height); }

  void choose(Ground chosen) {
    ground = std::move(chosen);
    ground.write_whole_and_pieces(folder);
  }

  [[nodiscard]] double expected(const Combination& at, double longitude, double latitude) const {
    longitude = std::remainder(longitude, 360.0);
    return ground.height(longitude, latitude) + (at.geoid ? geoid_height(longitude, latitude) : 0.0);
  }

  /// Converts whole and pieces to the same elevations, which every check passes.
  void convert(const Combination& at) {
    const RunResult whole =
        run_with({"convert", folder / "whole.flt", folder / "whole.isohf", "--overwrite"}, at.options(folder));
    ASSERT_EQ(whole.exit_code, 0) << whole.err;
    const RunResult pieces =
        run_with({"convert", folder / "pieces", folder / "a.isohf", "--overwrite"}, at.options(folder));
    ASSERT_EQ(pieces.exit_code, 0) << pieces.err;
    EXPECT_EQ(ArchiveReader(folder / "whole.isohf").metadata().content_sha256,
              ArchiveReader(folder / "a.isohf").metadata().content_sha256);
    for (const std::string& input : {folder / "whole.flt", folder / "pieces"}) {
      const RunResult verified =
          run_with({"verify", folder / "a.isohf", "--against", input, "--json"}, at.geoid_option(folder));
      ASSERT_EQ(verified.exit_code, 0) << verified.out << verified.err;
      const json against = json::parse(verified.out).at("against");
      EXPECT_EQ(against.at("vertices").at("wrong"), 0);
      EXPECT_EQ(against.at("lost_inside"), 0);
      EXPECT_LT(against.at("max").get<double>(), fill_tolerance);
    }
  }

  /// `hole` is the middle of the void and `clear` degrees around it are not looked at.
  void samples_hold(const Combination& at, const std::vector<GeoPoint>& places, const GeoPoint& hole) {
    for (const GeoPoint& place : places) {
      const RunResult sampled = run_isohf({"sample", folder / "a.isohf", "--in", "lonlat", "--at",
                                           std::to_string(place.longitude) + "," + std::to_string(place.latitude)});
      ASSERT_EQ(sampled.exit_code, 0) << sampled.err;
      ASSERT_TRUE(sampled.out.find_first_of("0123456789") == 0 || sampled.out[0] == '-')
          << sampled.out << place.longitude << " " << place.latitude;
      EXPECT_NEAR(std::stod(sampled.out), expected(at, place.longitude, place.latitude), tolerance)
          << place.longitude << " " << place.latitude;
    }
    const RunResult sampled = run_isohf({"sample", folder / "a.isohf", "--in", "lonlat", "--at",
                                         std::to_string(hole.longitude) + "," + std::to_string(hole.latitude)});
    if (!at.fill) {
      EXPECT_EQ(sampled.out, "void\n");
    } else {
      EXPECT_NEAR(std::stod(sampled.out), expected(at, hole.longitude, hole.latitude), fill_tolerance);
    }
  }

  /// Every sample of a raster of the archive, by its own georeference. `inside`: ground that must have elevations.
  void raster_holds(const Combination& at, const std::string& path,
                    const std::function<bool(double longitude, double latitude)>& inside, bool on_map = false) {
    const Metadata metadata = ArchiveReader(folder / "a.isohf").metadata();
    const Raster raster = read_raster(path);
    const SourceInfo& info = raster.info;
    const Georeference& place = info.georeference;
    ASSERT_TRUE(place.has_origin);
    EXPECT_EQ(place.unit == HorizontalUnit::kMetre, on_map);
    std::optional<Projection> map;
    if (on_map) map.emplace(metadata.projection->spec);
    std::int64_t compared = 0;
    double worst = 0.0;
    for (std::int64_t r = 0; r < info.height; ++r) {
      for (std::int64_t c = 0; c < info.width; ++c) {
        const double x = place.origin_x + static_cast<double>(c) * place.spacing_x;
        const double y = place.origin_y - static_cast<double>(r) * place.spacing_y;
        const GeoPoint there = map ? map->inverse({x, y}) : GeoPoint{x, y};
        if (!inside(there.longitude, there.latitude)) continue;
        const float height = raster.at(c, r);
        ++compared;
        const double error = std::abs(height - expected(at, there.longitude, there.latitude));
        if (!(error <= worst)) worst = error;  // a NaN stays
        ASSERT_LT(error, tolerance) << path << ": " << c << "," << r << " at " << there.longitude << ","
                                    << there.latitude;
      }
    }
    EXPECT_GT(compared, info.width * info.height / 4) << path;
    RecordProperty("worst", std::to_string(worst));
  }

  /// The source's samples, the surface's, and those of the archive's own map.
  void exports_hold(const Combination& at, const std::function<bool(double, double)>& inside) {
    const Metadata metadata = ArchiveReader(folder / "a.isohf").metadata();
    const bool warped = at.kind != "none" && metadata.projection->spec.kind != ProjectionKind::kEquirectangular;
    for (const Words& more : {Words{}, Words{"--raw-scale", "1"}, Words{"--to-crs", "none"}}) {
      const RunResult made = run_with({"export", folder / "a.isohf", folder / "a.tif", "--overwrite"}, more);
      ASSERT_EQ(made.exit_code, 0) << made.err;
      EXPECT_EQ(made.err, "");
      raster_holds(at, folder / "a.tif", inside, warped && more == Words{"--to-crs", "none"});
      if (HasFatalFailure()) return;
    }
  }

  TemporaryFolder folder;
  Ground ground;
  double tolerance = 0.0;
  double fill_tolerance = 0.0;
};

/// The four runs in which every two of three switches meet in every way.
constexpr std::array<std::array<bool, 3>, 4> kPairs = {
    {{false, false, false}, {false, true, true}, {true, false, true}, {true, true, false}}};

TEST_F(GeographicCombinations, PiecesBoxesGeoidsAndFillsGoThroughEveryProjection) {
  constexpr GeoPoint kHole{9.81, 47.19};  // across the borders of the pieces, at 9.9 and 47.15
  choose({96, 64, 8.0, 45.0, 0.05,
          [](double longitude, double latitude) {
            return 800.0 + 400.0 * std::sin(0.3 * longitude) * std::cos(0.35 * latitude);
          },
          [&](double longitude, double latitude) {
            return std::hypot(longitude - kHole.longitude, latitude - kHole.latitude) < 0.16;
          }});
  // Bends by 36 m a square degree each way at most: cells of 0.05 degrees lose 0.05 * 0.05 * 36 / 8 a direction, in the
  // samples' interpolation and in the triangles, a little more where splines ring; half a code; the geoid's own
  // interpolation and its steps of 3 mm.
  tolerance = 5.0 * 0.05 * 0.05 * 36.0 / 8.0 + 0.005 + 0.01;
  fill_tolerance = 2.0;  // a mean over rays of 0.16 degrees on slopes of up to 150 m a degree
  std::size_t run = 0;
  for (const std::string kind : {"auto", "equirectangular", "local", "transverse-mercator", "utm:32N",
                                 "lambert-conformal", "polar-stereographic:45", "none"}) {
    for (const auto& [box, fill, geoid] : kPairs) {
      if (kSanitized && run++ % 5 != 0) continue;  // each kind once or twice, in turn with each pair
      Combination at{kind, fill, geoid, {}, {}};
      if (box) at.box = {8.6, 45.35, 12.25, 47.9};
      SCOPED_TRACE(kind + (box ? " bbox" : "") + (fill ? " fill" : "") + (geoid ? " geoid" : ""));
      ASSERT_NO_FATAL_FAILURE(convert(at));
      ASSERT_NO_FATAL_FAILURE(samples_hold(
          at, {{8.7, 45.45}, {12.2, 45.4}, {8.65, 47.85}, {12.21, 47.81}, {10.0, 47.0}, {371.5, 46.0}}, kHole));
      const double west = box ? 8.6 : 8.0;
      const double south = box ? 45.35 : 45.0;
      const double east = box ? 12.25 : 12.8;
      const double north = box ? 47.9 : 48.2;
      // Three cells from the edge nothing of what goes on beyond it is left; around the hole triangles are void or
      // filled.
      ASSERT_NO_FATAL_FAILURE(exports_hold(at, [&](double longitude, double latitude) {
        return longitude > west + 0.15 && longitude < east - 0.15 && latitude > south + 0.15 &&
               latitude < north - 0.15 && std::hypot(longitude - kHole.longitude, latitude - kHole.latitude) > 0.4;
      }));
    }
  }
}

TEST_F(GeographicCombinations, AGlobeHasNoSeamAtTheAntimeridian) {
  constexpr GeoPoint kHole{179.0, 21.0};
  choose({180, 90, -180.0, -90.0, 2.0,
          [](double longitude, double latitude) {
            // Steep across the antimeridian.
            return 3000.0 * std::sin(longitude * kDegree) * std::cos(latitude * kDegree) +
                   1000.0 * std::cos(longitude * kDegree + 0.5);
          },
          [&](double longitude, double latitude) {
            return std::hypot(std::remainder(longitude - kHole.longitude, 360.0), latitude - kHole.latitude) < 4.5;
          }});
  // Bends by up to 4000 * (pi / 180)^2 a square degree, which triangles of 2 degrees lose 0.6 of either way; half a
  // code; the geoid. Rows that end in mirrors at the seam err by 8 there.
  tolerance = 2.0 * 2.0 * 2.0 * 4000.0 * kDegree * kDegree / 8.0 + 0.1 + 0.05;
  fill_tolerance = 60.0;
  for (const auto& [box, fill, geoid] : kPairs) {
    Combination at{"equirectangular", fill, geoid, {}, {}, "0.2"};
    if (box) at.box = {-180.0, -60.0, 180.0, 70.0};
    SCOPED_TRACE(std::string(box ? " bbox" : "") + (fill ? " fill" : "") + (geoid ? " geoid" : ""));
    ASSERT_NO_FATAL_FAILURE(convert(at));
    ASSERT_NO_FATAL_FAILURE(samples_hold(
        at, {{180.0, 0.0}, {-180.0, 40.0}, {-179.3, -30.0}, {179.3, -30.0}, {179.99, 10.0}, {0.0, 50.0}}, kHole));
    const double south = box ? -60.0 : -90.0;
    const double north = box ? 70.0 : 90.0;
    ASSERT_NO_FATAL_FAILURE(exports_hold(at, [&](double longitude, double latitude) {
      return latitude > south + 6.2 && latitude < north - 6.2 &&
             std::hypot(distance_in_turn(longitude, kHole.longitude), latitude - kHole.latitude) > 11.0;
    }));
  }
}

TEST_F(GeographicCombinations, LosslessKeepsTheFilesOwnSamplesBehindBoxAndFill) {
  choose({73, 30, -180.0, -70.0, 5.0,
          [](double longitude, double latitude) {
            return 3000.0 * std::sin(longitude * kDegree) * std::cos(latitude * kDegree);
          },
          [&](double longitude, double latitude) { return std::hypot(longitude - 22.0, latitude - 11.0) < 9.0; }});
  const Words options = {"--to-crs", "equirectangular", "--fill=10", "--wrap-x",
                         "--bbox",   "-180,-50,185,60", "--lossless"};
  const RunResult made = run_with({"convert", folder / "pieces", folder / "a.isohf"}, options);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const RunResult restored = run_isohf({"export", folder / "a.isohf", folder / "a.tif"});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  const auto raster = open_raster(folder / "a.tif", {});
  ASSERT_EQ(raster->info().width, 72) << "without the repeated column";
  ASSERT_EQ(raster->info().height, 22);
  EXPECT_DOUBLE_EQ(raster->info().georeference.origin_x, -177.5);
  EXPECT_DOUBLE_EQ(raster->info().georeference.origin_y, 57.5);
  std::vector<float> samples(72 * 22);
  raster->read_window({0, 0, 72, 22}, std::as_writable_bytes(std::span(samples)));
  int voids = 0;
  for (std::int64_t r = 0; r < 22; ++r) {
    for (std::int64_t c = 0; c < 72; ++c) {
      const float value = samples[static_cast<std::size_t>(r * 72 + c)];
      ASSERT_EQ(value, ground.sample(c, r + 4)) << c << "," << r;
      voids += value == kNoData ? 1 : 0;
    }
  }
  EXPECT_GT(voids, 5);
}

}  // namespace
}  // namespace isohf::test
