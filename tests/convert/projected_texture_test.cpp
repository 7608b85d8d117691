/// Photos in degrees on projected archives: colours at known places, whatever the projection.

#include <gtest/gtest.h>

#include <cmath>

#include "isohf/archive.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/convert.h"
#include "isohf/projection/projection.h"
#include "isohf/verify.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using Source = test::MemorySource<float>;
using test::MemoryPhoto;

constexpr double kDegree = M_PI / 180.0;

struct Raster {
  GeoExtent extent;
  std::int64_t width;
  std::int64_t height;

  [[nodiscard]] double dx() const { return (extent.east - extent.west) / static_cast<double>(width); }
  [[nodiscard]] double dy() const { return (extent.north - extent.south) / static_cast<double>(height); }
  [[nodiscard]] Georeference place() const {
    Georeference place = test::place_at(Registration::kArea, HorizontalUnit::kDegree, extent.west + dx() / 2.0,
                                        extent.north - dy() / 2.0, dx(), 4326);
    place.spacing_y = dy();
    return place;
  }
};

/// 0...255 over the whole body without a step anywhere, about 110 of them over 8 degrees.
double colour(double longitude, double latitude, int channel) {
  if (channel == 0) return 127.5 + 100.0 * std::sin(9.0 * longitude * kDegree);
  if (channel == 1) return 127.5 + 100.0 * std::cos(11.0 * latitude * kDegree);
  return 127.5 + 60.0 * std::sin(4.0 * longitude * kDegree) + 60.0 * std::cos(7.0 * latitude * kDegree);
}

std::unique_ptr<Source> source_over(const Raster& raster) {
  auto source = std::make_unique<Source>(SampleType::kFloat32, raster.width, raster.height,
                                         [](std::int64_t c, std::int64_t r) { return static_cast<double>(c % 7 + r); });
  source->mutable_info().georeference = raster.place();
  return source;
}

std::unique_ptr<MemoryPhoto> photo_over(const Raster& raster, int channels = 3) {
  auto photo =
      std::make_unique<MemoryPhoto>(raster.width, raster.height, channels, [&](std::int64_t c, std::int64_t r, int k) {
        const double longitude = raster.extent.west + (static_cast<double>(c) + 0.5) * raster.dx();
        const double latitude = raster.extent.north - (static_cast<double>(r) + 0.5) * raster.dy();
        return k == 3 ? 200 : static_cast<int>(std::lround(colour(longitude, latitude, k)));
      });
  photo->mutable_info().georeference = raster.place();
  return photo;
}

ConvertOptions options_for(const std::string& projection, PhotoSource& photo) {
  ConvertOptions options;
  options.plan.shape = {36, 35};
  options.plan.levels = 2;
  options.plan.ground.projection = ProjectionRequest::parse(projection);
  options.step = 0.02;
  options.overwrite = true;
  options.producer = "isohf test";
  TextureRequest& texture = options.texture.emplace();
  texture.photo = &photo;
  texture.format = TextureFormat::kPng;
  texture.max_size = 256;
  return options;
}

/// Largest difference, in steps of colour, of the texels of level 0 whose places lie inside `ground`; counts them.
double worst_colour(const ArchiveReader& archive, const GeoExtent& ground, std::int64_t& compared,
                    double alpha = 200.0) {
  const TextureReader textures(archive);
  const Metadata& metadata = archive.metadata();
  const Projection map(metadata.projection->spec);
  const TileGrid& grid = archive.grid();
  const int size = textures.info().size;
  double worst = 0.0;
  for (std::int64_t t = 0; t < grid.tile_count(); ++t) {
    const TileIndex tile = grid.tile_at(t);
    if (!textures.has(tile)) continue;
    const Picture picture = textures.read(tile, 0);
    for (int j = 0; j < size; j += 3) {
      for (int i = 0; i < size; i += 5) {
        // docs/archive_format.md: the first and the last texel lie on the tile's edges.
        const double x = (static_cast<double>(tile.column) + static_cast<double>(i) / (size - 1)) * grid.extent_x();
        const double z = (static_cast<double>(tile.row) + static_cast<double>(j) / (size - 1)) * grid.extent_z();
        const GeoPoint at =
            map.inverse({metadata.projection->origin.easting + x, metadata.projection->origin.northing - z});
        double longitude = at.longitude;
        while (longitude < ground.west) longitude += 360.0;
        if (std::isnan(longitude) || longitude > ground.east) continue;
        if (at.latitude < ground.south || at.latitude > ground.north) continue;
        for (int c = 0; c < picture.channels; ++c) {
          const double expected = c == 3 ? alpha : colour(longitude, at.latitude, c);
          worst = std::max(worst, std::abs(picture.pixel(i, j)[c] - expected));
        }
        ++compared;
      }
    }
  }
  return worst;
}

struct Case {
  const char* projection;
  Raster source;
  Raster photo;
  int channels = 3;
  bool is_placed = true;  ///< or covers the source
};

const Raster kFrance{{-3.0, 42.0, 5.0, 50.0}, 160, 160};
const Raster kFrancePhoto{{-3.0, 42.0, 5.0, 50.0}, 640, 800};
const Raster kAcross{{176.0, 60.0, 184.0, 66.0}, 160, 120};
const Raster kCap{{-180.0, 60.0, 180.0, 90.0}, 360, 60};
const Raster kGlobe{{-180.0, -90.0, 180.0, 90.0}, 2880, 1440};

TEST(ProjectedTexture, ShowsEveryPlaceInItsColour) {
  const test::TemporaryFolder folder;
  int cases = 0;
  for (const Case& with : {
           Case{"auto", kFrance, kFrancePhoto, 4},
           Case{"equirectangular", kFrance, kFrancePhoto},
           Case{"local", kFrance, kFrancePhoto},
           Case{"local", kFrance, kFrancePhoto, 3, false},
           Case{"transverse-mercator", kFrance, kFrancePhoto},
           Case{"utm", kFrance, kFrancePhoto},
           Case{"lambert-conformal", kFrance, kFrancePhoto},
           Case{"lambert-conformal", kAcross, kGlobe},
           Case{"transverse-mercator", kAcross, {{-185.0, 60.0, -175.0, 66.0}, 400, 300}},
           Case{"polar-stereographic", kCap, kGlobe, 4},
       }) {
    if (test::kSanitized && cases++ % 3 != 0) continue;
    SCOPED_TRACE(with.projection);
    const auto source = source_over(with.source);
    const auto photo = photo_over(with.photo, with.channels);
    if (!with.is_placed) photo->mutable_info().georeference.reset();
    const ConvertSummary summary = convert(*source, folder / "a.isohf", options_for(with.projection, *photo));
    EXPECT_EQ(texture_info(summary.metadata)->placed_by, with.is_placed ? "georeference" : "source");
    const ArchiveReader archive(folder / "a.isohf");
    // A photo's pixel beside its border, where that goes on.
    GeoExtent inside = with.source.extent;
    inside.west += with.photo.dx();
    inside.east -= with.photo.dx();
    inside.south += with.photo.dy();
    // Around a pole a texel covers many longitudes, and many of these colours.
    inside.north = std::min(inside.north - with.photo.dy(), 80.0);
    std::int64_t compared = 0;
    // Half a step in the photo, half in the texture, and what the waves bend over a texel.
    EXPECT_LT(worst_colour(archive, inside, compared), 1.35);
    EXPECT_GT(compared, 4000);
    EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
  }
}

TEST(ProjectedTexture, AveragesThePixelsBelowATexel) {
  // Stripes of one pixel, black and white: their mean in light is half, which is 188 in sRGB.
  const test::TemporaryFolder folder;
  const auto source = source_over(kFrance);
  const Raster fine{kFrance.extent, 4000, 4000};
  MemoryPhoto photo(fine.width, fine.height, 1,
                    [](std::int64_t c, std::int64_t r, int) { return (c + r) % 2 == 0 ? 0 : 255; });
  photo.mutable_info().georeference = fine.place();
  ConvertOptions options = options_for("lambert-conformal", photo);
  options.texture->max_size = 64;
  const ConvertSummary summary = convert(*source, folder / "a.isohf", options);
  EXPECT_GT(summary.pixels_per_texel, 5.0);
  const ArchiveReader archive(folder / "a.isohf");
  const Picture middle =
      TextureReader(archive).read({archive.grid().tile_columns() / 2, archive.grid().tile_rows() / 2}, 0);
  for (const std::uint8_t value : middle.samples) ASSERT_NEAR(value, 188, 6);
}

TEST(ProjectedTexture, GivesTilesBesideThePhotoNone) {
  const test::TemporaryFolder folder;
  const auto source = source_over(kFrance);
  const Raster part{{-1.0, 44.0, 1.0, 46.0}, 200, 200};
  const auto photo = photo_over(part);
  const ConvertSummary summary = convert(*source, folder / "a.isohf", options_for("lambert-conformal", *photo));
  const ArchiveReader archive(folder / "a.isohf");
  const TextureReader textures(archive);
  std::int64_t with = 0;
  for (std::int64_t t = 0; t < archive.grid().tile_count(); ++t) with += textures.has(archive.grid().tile_at(t));
  EXPECT_GT(with, 0);
  EXPECT_LT(with, archive.grid().tile_count() / 2);
  std::int64_t compared = 0;
  EXPECT_LT(worst_colour(archive, {-0.98, 44.02, 0.98, 45.98}, compared, 255.0), 1.35);
  EXPECT_GT(compared, 500);
  // The rectangle around it: 2 degrees of latitude, 222 km and the parallels' bend.
  const WorldBounds shown = texture_info(summary.metadata)->placement;
  EXPECT_NEAR(shown.z1 - shown.z0, 223000.0, 2000.0);
  EXPECT_NEAR(shown.x1 - shown.x0, 160000.0, 2000.0);
}

TEST(ProjectedTexture, BytesDoNotDependOnThreads) {
  const test::TemporaryFolder folder;
  const auto source = source_over(kFrance);
  const std::int64_t side = test::kSanitized ? 300 : 900;
  MemoryPhoto photo(side, side, 3, test::noise);
  photo.mutable_info().georeference = Raster{kFrance.extent, side, side}.place();
  std::string first;
  for (const int threads : {1, 2, 5}) {
    ConvertOptions options = options_for("lambert-conformal", photo);
    options.texture->format = TextureFormat::kJpeg;
    options.shadow_seeds.emplace();
    options.lossless = true;
    (void)convert(*source, folder / "a.isohf", options, {.threads = threads});
    const std::string found = test::read_file(folder / "a.isohf");
    if (first.empty()) first = found;
    EXPECT_EQ(found, first);
  }
}

}  // namespace
}  // namespace isohf
