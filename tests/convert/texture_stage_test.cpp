#include "isohf/convert/stages/texture_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "isohf/archive.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/photo_placement.h"
#include "isohf/error.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::MemoryPhoto;
using test::noise;
using test::read_file;
using ::testing::HasSubstr;

/// Hills, with a corner of voids that leaves a tile empty.
class Hills : public test::MemorySource<float> {
 public:
  explicit Hills(std::int64_t width = 120, std::int64_t height = 90)
      : MemorySource(SampleType::kFloat32, width, height, [width](std::int64_t c, std::int64_t r) {
          if (c > width - 40 && r < 40) return std::numeric_limits<double>::quiet_NaN();
          return 20.0 * std::sin(static_cast<double>(c) * 0.1) * std::cos(static_cast<double>(r) * 0.07);
        }) {}
};

ConvertOptions options_for(MemoryPhoto& photo, TextureFormat format = TextureFormat::kPng) {
  ConvertOptions options;
  options.plan.shape = {20, 19};
  options.plan.levels = 1;
  options.overwrite = true;
  options.producer = "isohf test";
  options.z_range = {-30.0, 30.0};
  options.texture = TextureRequest{&photo, format, 64};
  return options;
}

std::string message_of(const std::function<void()>& action) {
  const Error error = test::error_of(action);
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  return error.what();
}

/// 30 m pixels from (500000, 4000000) on.
Georeference utm(double origin_x, double origin_y, double spacing, int epsg = 32632) {
  return test::place_at(Registration::kArea, HorizontalUnit::kMetre, origin_x, origin_y, spacing, epsg);
}

TEST(PhotoPlacement, CoversTheAreaOfPixelsOrTheSpanOfPosts) {
  Hills source(11, 21);
  MemoryPhoto photo(100, 200, 3, noise);
  source.mutable_info().georeference.registration = Registration::kArea;
  PhotoPlacement at = place_photo(photo.info(), source.info(), make_source_frame(source.info()));
  EXPECT_FALSE(at.by_georeference);
  EXPECT_DOUBLE_EQ(at.bounds.x0, 0.0);
  EXPECT_DOUBLE_EQ(at.bounds.x1, 11.0);
  EXPECT_DOUBLE_EQ(at.bounds.z1, 21.0);
  EXPECT_DOUBLE_EQ(at.frame.first_pixel_x, 0.055);
  EXPECT_TRUE(!at.warnings.empty());  // pixels of 0.11 x 0.105
  source.mutable_info().georeference.registration = Registration::kPoint;
  at = place_photo(photo.info(), source.info(), make_source_frame(source.info()));
  EXPECT_DOUBLE_EQ(at.bounds.x1, 10.0);
  EXPECT_DOUBLE_EQ(at.bounds.z1, 20.0);
  EXPECT_TRUE(at.warnings.empty());
}

TEST(PhotoPlacement, PutsOnePixelOnEverySampleWhereThereAreAsMany) {
  Hills source(30, 40);
  MemoryPhoto photo(30, 40, 1, noise);
  for (const Registration registration : {Registration::kPoint, Registration::kArea}) {
    source.mutable_info().georeference.registration = registration;
    const SourceFrame frame = make_source_frame(source.info());
    const PhotoPlacement at = place_photo(photo.info(), source.info(), frame);
    EXPECT_DOUBLE_EQ(at.frame.first_pixel_x, frame.first_sample_x);
    EXPECT_DOUBLE_EQ(at.frame.spacing_x, frame.spacing_x);
    EXPECT_DOUBLE_EQ(at.bounds.x0, registration == Registration::kPoint ? -0.5 : 0.0);
  }
}

TEST(PhotoPlacement, FollowsTheGeoreferences) {
  Hills source(100, 80);
  source.mutable_info().georeference = utm(500015.0, 3999985.0, 30.0);
  MemoryPhoto photo(400, 300, 3, noise);
  photo.mutable_info().georeference = utm(500305.0, 3999395.0, 10.0);
  const PhotoPlacement at = place_photo(photo.info(), source.info(), make_source_frame(source.info()));
  EXPECT_TRUE(at.by_georeference);
  EXPECT_DOUBLE_EQ(at.bounds.x0, 300.0);
  EXPECT_DOUBLE_EQ(at.bounds.x1, 4300.0);
  EXPECT_DOUBLE_EQ(at.bounds.z0, 600.0);
  EXPECT_DOUBLE_EQ(at.bounds.z1, 3600.0);
  EXPECT_DOUBLE_EQ(at.frame.spacing_z, 10.0);
}

TEST(PhotoPlacement, TurnsDegreesIntoTheSourcesMetres) {
  Hills source(100, 80);
  Georeference degrees = utm(7.0, 46.0, 1.0 / 3600, 4326);
  degrees.unit = HorizontalUnit::kDegree;
  source.mutable_info().georeference = degrees;
  MemoryPhoto photo(100, 80, 3, noise);
  photo.mutable_info().georeference = degrees;
  photo.mutable_info().georeference->origin_x += 10.0 / 3600;
  const SourceFrame frame = make_source_frame(source.info());
  const PhotoPlacement at = place_photo(photo.info(), source.info(), frame);
  EXPECT_NEAR(at.frame.first_pixel_x, frame.first_sample_x + 10.0 * frame.spacing_x, 1e-6);
  EXPECT_NEAR(at.frame.spacing_x, frame.spacing_x, 1e-9);
}

TEST(PhotoPlacement, RefusesAnotherReferenceSystemAndAnotherPlace) {
  Hills source(100, 80);
  source.mutable_info().georeference = utm(500015.0, 3999985.0, 30.0);
  MemoryPhoto photo(400, 300, 3, noise);
  const auto place = [&] { (void)place_photo(photo.info(), source.info(), make_source_frame(source.info())); };
  photo.mutable_info().georeference = utm(500305.0, 3999395.0, 10.0, 32633);
  EXPECT_THAT(message_of(place), HasSubstr("photo: is in EPSG:32633, memory in EPSG:32632"));
  photo.mutable_info().georeference->unit = HorizontalUnit::kDegree;
  photo.mutable_info().georeference->system.epsg.reset();
  EXPECT_THAT(message_of(place), HasSubstr("degrees"));
  // A world file names no system.
  photo.mutable_info().georeference->unit = HorizontalUnit::kUnknown;
  EXPECT_NO_THROW(place());
  photo.mutable_info().georeference->origin_x = 600000.0;
  EXPECT_THAT(message_of(place), HasSubstr("shows no ground of memory"));
}

TEST(PhotoPlacement, TakesTheRoundedFeetOfAnotherWriterAndAsksWhoUnderstandsTexts) {
  Hills source(100, 80);
  Georeference& ours = source.mutable_info().georeference = utm(500015.0, 3999985.0, 30.0);
  ours.metres_per_unit = 1200.0 / 3937.0;
  ours.system.epsg.reset();
  ours.system.wkt = "PROJCS[\"one\"]";
  MemoryPhoto photo(400, 300, 3, noise);
  photo.mutable_info().georeference = ours;
  Georeference& theirs = *photo.mutable_info().georeference;
  const auto place = [&](std::optional<bool> same_system) {
    (void)place_photo(photo.info(), source.info(), make_source_frame(source.info()), same_system);
  };
  for (const double foot : {0.3048006096012, 0.304800609601}) {
    theirs.metres_per_unit = foot;
    EXPECT_NO_THROW(place({})) << foot;
  }
  theirs.system.wkt = "PROJCS[\"another\"]";
  EXPECT_NO_THROW(place(true));
  EXPECT_THROW(place({}), Error);
  EXPECT_THROW(place(false), Error);
  theirs = ours;
  theirs.metres_per_unit = 0.3048;
  EXPECT_THROW(place(true), Error) << "of two feet, whatever is said of the systems";
}

TEST(TextureStage, StoresWhatTheCutterCutsForEveryTileWithGround) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(500, 400, 3, noise);
  const ConvertSummary summary = convert(source, folder / "a.isohf", options_for(photo));
  ASSERT_TRUE(texture_info(summary.metadata));
  EXPECT_GT(summary.tiles_void, 0);
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_EQ(archive.metadata().textures, std::vector<std::string>{"textures/ROW/COLUMN/SIZE.png"});
  const TextureReader reader(archive);
  EXPECT_EQ(reader.info().size, 64);
  EXPECT_EQ(reader.info().levels, 4);
  EXPECT_EQ(reader.info().photo_width, 500);
  EXPECT_EQ(reader.info().members, 4 * (summary.tiles_written - summary.tiles_void));
  EXPECT_EQ(reader.info().bytes, summary.texture_bytes);
  const Plan plan = make_plan(source.info(), options_for(photo).plan);
  const TextureCutter cutter(plan.grid, place_photo(photo.info(), source.info(), plan.frame).frame, {64, 4});
  for (std::int64_t flat = 0; flat < archive.grid().tile_count(); ++flat) {
    const TileIndex tile = archive.grid().tile_at(flat);
    ASSERT_EQ(reader.has(tile), archive.tile_entry(tile).stored);
    if (!reader.has(tile)) continue;
    const std::vector<Picture> expected = cutter.cut(photo, tile);
    for (int level = 0; level < 4; ++level) {
      EXPECT_EQ(reader.read(tile, level), expected[static_cast<std::size_t>(level)]);
      const Picture rgba = reader.read_rgba(tile, level);
      EXPECT_EQ(rgba.channels, 4);
      EXPECT_EQ(rgba.pixel(3, 5)[2], expected[static_cast<std::size_t>(level)].pixel(3, 5)[2]);
      EXPECT_EQ(rgba.pixel(3, 5)[3], 255);
    }
  }
  EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
}

TEST(TextureStage, ChoosesTexelsNoCoarserThanPixels) {
  const test::TemporaryFolder folder;
  Hills source(106, 106);  // 2 x 2 tiles
  ConvertOptions options;
  options.plan.fit = true;
  options.plan.shape = {52, 67};
  const Plan plan = make_plan(source.info(), options.plan);
  const auto size_for = [&](int pixels, int most) {
    MemoryPhoto photo(pixels, pixels, 1, [](auto, auto, int) { return 9; });
    const TextureStage stage = TextureStage::make(plan, source.info(), TextureRequest{&photo, {}, most}, 1, 1);
    EXPECT_GE(photo.cache_bytes, 64U << 20U);
    EXPECT_GT(stage.memory_bytes(), 100000000U);
    const double spans = 2.0 * stage.pixels_per_texel();
    return static_cast<int>(std::lround(pixels / spans)) + 1;
  };
  EXPECT_EQ(size_for(10, 1024), 64);
  EXPECT_EQ(size_for(2 * 63, 1024), 64);
  EXPECT_EQ(size_for(2 * 63 + 2, 1024), 128);
  EXPECT_EQ(size_for(2 * 255, 1024), 256);
  EXPECT_EQ(size_for(2 * 600, 512), 512);
  EXPECT_EQ(size_for(2 * 600, 4096), 1024);
}

TEST(TextureStage, RefusesOptionsOutOfRange) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(50, 40, 3, noise);
  for (const int size : {0, -64, 32, 65, 100, 8192}) {
    ConvertOptions options = options_for(photo);
    options.texture->max_size = size;
    EXPECT_THAT(message_of([&] { (void)convert(source, folder / "a.isohf", options); }), HasSubstr("`max_size`"));
  }
  EXPECT_TRUE(folder.names().empty());
}

TEST(TextureStage, PicksTheFormatByAlpha) {
  const test::TemporaryFolder folder;
  Hills source(40, 40);
  for (const int channels : {1, 3, 4}) {
    MemoryPhoto photo(40, 40, channels, noise);
    ConvertOptions options = options_for(photo);
    options.texture->format.reset();
    const ConvertSummary summary = convert(source, folder / "a.isohf", options);
    EXPECT_EQ(texture_info(summary.metadata)->format, channels == 4 ? TextureFormat::kPng : TextureFormat::kJpeg);
    EXPECT_EQ(texture_info(summary.metadata)->channels, channels);
    EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
    options.texture->format = TextureFormat::kJpeg;
    const ConvertSummary jpeg = convert(source, folder / "a.isohf", options);
    EXPECT_EQ(texture_info(jpeg.metadata)->channels, std::min(channels, 3));
    EXPECT_EQ(jpeg.warnings.size(), channels == 4 ? 1U : 0U);
    EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
  }
}

// Pixels of a metre, a photo of the ground's middle: beyond it textures are transparent, not its border drawn out.
TEST(TextureStage, ShowsNothingBeyondAPhotoOfAPartOfTheGround) {
  const test::TemporaryFolder folder;
  Hills source(60, 60);
  source.mutable_info().georeference = utm(500000.5, 3999999.5, 1.0);
  for (const int channels : {1, 3, 4}) {
    MemoryPhoto photo(20, 24, channels, [](std::int64_t, std::int64_t, int channel) {
      return static_cast<std::uint8_t>(channel == 3 ? 255 : 180);
    });
    photo.mutable_info().georeference = utm(500010.5, 3999979.5, 1.0);  // columns 10 to 29, rows 20 to 43
    ConvertOptions options = options_for(photo);
    options.texture->format.reset();
    const ConvertSummary summary = convert(source, folder / "a.isohf", options);
    EXPECT_EQ(texture_info(summary.metadata)->format, TextureFormat::kPng);
    EXPECT_EQ(texture_info(summary.metadata)->photo_width, 20);
    EXPECT_TRUE(verify_archive(folder / "a.isohf", {}).passed());
    const ArchiveReader archive(folder / "a.isohf");
    const TextureReader reader(archive);
    int inside = 0;
    int beyond = 0;
    for (std::int64_t flat = 0; flat < archive.grid().tile_count(); ++flat) {
      const TileIndex tile = archive.grid().tile_at(flat);
      if (!reader.has(tile)) continue;
      const Picture texels = reader.read_rgba(tile, 0);
      for (int row = 0; row < texels.height; ++row) {
        for (int column = 0; column < texels.width; ++column) {
          const double x =
              (static_cast<double>(tile.column) + column / (texels.width - 1.0)) * archive.grid().extent_x();
          const double z = (static_cast<double>(tile.row) + row / (texels.height - 1.0)) * archive.grid().extent_z();
          const double depth = std::min(std::min(x - 10.0, 30.0 - x), std::min(z - 20.0, 44.0 - z));
          if (depth > 1.0) {
            ASSERT_EQ(texels.pixel(column, row)[3], 255) << x << ' ' << z;
            ASSERT_EQ(texels.pixel(column, row)[0], 180) << x << ' ' << z;
            ++inside;
          }
          if (depth < -1.0) {
            ASSERT_EQ(texels.pixel(column, row)[3], 0) << x << ' ' << z;
            ++beyond;
          }
        }
      }
    }
    EXPECT_GT(inside, 300);
    EXPECT_GT(beyond, 300);
    // JPEG has no way to say so.
    options.texture->format = TextureFormat::kJpeg;
    EXPECT_EQ(texture_info(convert(source, folder / "a.isohf", options).metadata)->channels, std::min(channels, 3));
  }
}

/// Breaks off where a tile's row of pixels is asked for.
class FailingPhoto final : public PhotoSource {
 public:
  FailingPhoto(MemoryPhoto& photo, std::int64_t pixels) : photo_(photo), left_(pixels) {}
  [[nodiscard]] const PhotoInfo& info() const override { return photo_.info(); }
  void set_cache_bytes(std::uint64_t) override {}
  void read_window(const Window& window, std::span<std::uint8_t> out) override {
    left_ -= window.columns * window.rows;
    if (left_ < 0) throw Error(ErrorCode::kCancelled, "interrupted");
    photo_.read_window(window, out);
  }

 private:
  MemoryPhoto& photo_;
  std::atomic<std::int64_t> left_;
};

TEST(TextureStage, ResumesToTheSameBytesWhereverItWasCut) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(300, 220, 3, noise);
  for (const bool with_seeds : {false, true}) {
    ConvertOptions options = options_for(photo);
    if (with_seeds) options.shadow_seeds.emplace();
    const Job job{.threads = 2};
    EXPECT_GT(convert(source, folder / "whole.isohf", options, job).plane_bytes, 0U);
    const std::string whole = read_file(folder / "whole.isohf");
    photo.pixels_read = 0;
    (void)convert(source, folder / "whole.isohf", options, job);
    const std::int64_t all = photo.pixels_read;
    for (const double share : {0.0, 0.1, 0.35, 0.6, 0.9, 0.99}) {
      FailingPhoto failing(photo, static_cast<std::int64_t>(share * static_cast<double>(all)));
      options.texture->photo = &failing;
      options.resume = false;
      EXPECT_THROW((void)convert(source, folder / "cut.isohf", options, job), Error);
      options.texture->photo = &photo;
      options.resume = true;
      (void)convert(source, folder / "cut.isohf", options, job);
      EXPECT_EQ(read_file(folder / "cut.isohf"), whole) << share;
    }
  }
}

TEST(TextureStage, WillNotResumeWithAnotherTexture) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(300, 220, 3, noise);
  FailingPhoto failing(photo, 100000);
  ConvertOptions options = options_for(photo);
  options.texture->photo = &failing;
  EXPECT_THROW((void)convert(source, folder / "cut.isohf", options), Error);
  options.texture->photo = &photo;
  options.resume = true;
  options.texture->max_size = 128;
  EXPECT_THAT(message_of([&] { (void)convert(source, folder / "cut.isohf", options); }), HasSubstr("other options"));
}

TEST(TextureStage, CountsAgainstTheMemoryAllowed) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(300, 220, 3, noise);
  ConvertOptions options = options_for(photo);
  const Job job{.memory_bytes = 110000000};  // the photo's reader alone takes more
  EXPECT_THROW((void)convert(source, folder / "a.isohf", options, job), Error);
  options.texture.reset();
  EXPECT_NO_THROW((void)convert(source, folder / "a.isohf", options, job));
}

/// Findings of kTexture after the file's bytes were changed.
std::vector<std::string> textures_found_wrong(const std::string& path) {
  std::vector<std::string> found;
  for (const Finding& finding : verify_archive(path, {}).findings) {
    if (finding_name(finding.id) == "ISOHF-0021") found.push_back(finding.text);
  }
  return found;
}

TEST(TextureStage, VerifyNamesADamagedTexture) {
  const test::TemporaryFolder folder;
  Hills source;
  MemoryPhoto photo(300, 220, 3, noise);
  for (const TextureFormat format : {TextureFormat::kPng, TextureFormat::kJpeg}) {
    (void)convert(source, folder / "a.isohf", options_for(photo, format));
    const std::string name = format == TextureFormat::kPng ? "textures/1/2/32.png" : "textures/1/2/32.jpg";
    const std::string bytes = read_file(folder / "a.isohf");
    const std::size_t header = bytes.find(name) - 30;
    ASSERT_LT(header, bytes.size());
    std::string bad = bytes;
    bad[header + 30 + name.size() + 200] ^= 0x55;
    test::write_file(folder / "b.isohf", bad);
    const auto found = textures_found_wrong(folder / "b.isohf");
    ASSERT_EQ(found.size(), 1U);
    EXPECT_THAT(found[0], HasSubstr(name));
  }
}

}  // namespace
}  // namespace isohf
