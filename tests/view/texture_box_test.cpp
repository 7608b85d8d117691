#include "paging/texture_box.h"

#include <gmock/gmock.h>

#include <array>
#include <chrono>
#include <cmath>
#include <thread>

#include "camera.h"
#include "gl/offscreen.h"
#include "gl_test.h"
#include "isohf/photo/texture_cutter.h"
#include "memory_tiles.h"
#include "paging/texture_overview.h"
#include "session.h"
#include "support/error_of.h"
#include "support/rasters/memory_photo.h"

namespace isohf::view {
namespace {

using test::MemoryPhoto;

/// A plain of height 0, 3 x 2 tiles of 100 world units, with the textures of a photo that covers all of it.
class TexturedPlain final : public TileSource {
 public:
  TexturedPlain(MemoryPhoto& photo, int size, int levels)
      : TileSource(facts_of(TileGrid::make(TileShape::make(20, 19, 2), 3, 2, 100.0, 100.0), test::MemoryTiles::kScale)),
        plain_(grid(),
               [](TileIndex, std::vector<std::uint16_t>& codes) { std::fill(codes.begin(), codes.end(), 10000); }),
        photo_(photo),
        cutter_(grid(), {150.0 / width(photo), 100.0 / height(photo), 300.0 / width(photo), 200.0 / height(photo)},
                {size, levels}) {
    TextureInfo info;
    info.channels = photo.info().channels;
    info.size = size;
    info.levels = levels;
    facts_.textures = info;
  }

  [[nodiscard]] TileBounds bounds(TileIndex tile) const override { return plain_.bounds(tile); }
  void read(TileIndex tile, std::span<std::uint16_t> codes) const override { plain_.read(tile, codes); }
  [[nodiscard]] bool has_texture(TileIndex tile) const override { return !(tile == without); }
  [[nodiscard]] Picture read_texture(TileIndex tile, int level) const override {
    if (tile == broken) throw Error(ErrorCode::kCorrupt, "member \"textures/0/1/64.png\": broken");
    const Picture found = cutter_.cut(photo_, tile)[static_cast<std::size_t>(level)];
    Picture rgba(found.width, found.height, 4);
    for (std::size_t i = 0; i < rgba.samples.size() / 4; ++i) {
      const auto channels = static_cast<std::size_t>(found.channels);
      for (std::size_t c = 0; c < 4; ++c)
        rgba.samples[4 * i + c] = c < channels ? found.samples[channels * i + c] : 255;
    }
    return rgba;
  }

  TileIndex without{-1, -1};
  TileIndex broken{-1, -1};

 private:
  static double width(const MemoryPhoto& photo) { return static_cast<double>(photo.info().width); }
  static double height(const MemoryPhoto& photo) { return static_cast<double>(photo.info().height); }

  test::MemoryTiles plain_;
  MemoryPhoto& photo_;
  TextureCutter cutter_;
};

/// The place at height 0 under the middle of a pixel, rows from the top.
WorldPoint ground_under(const ViewState& view, int x, int y) {
  const Mat4 camera = look_along(view.forward);
  const double half = std::tan(view.fov_y_rad / 2.0);
  const std::array<double, 3> ray{half * view.width / view.height * (2.0 * (x + 0.5) / view.width - 1.0),
                                  half * (1.0 - 2.0 * (y + 0.5) / view.height), -1.0};
  std::array<double, 3> world{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 3; ++i) {
      world[static_cast<std::size_t>(axis)] += camera.at(i, axis) * ray[static_cast<std::size_t>(i)];
    }
  }
  const double way = -view.eye.y / world[1];
  return {view.eye.x + way * world[0], view.eye.z + way * world[2]};
}

/// Up and down between 40 and 215 with a period of 64 pixels: 5.5 values a pixel, so that a shift shows.
int wave(std::int64_t at) {
  const auto phase = static_cast<double>((at % 64 + 64) % 64);
  return static_cast<int>(std::lround(40.0 + 175.0 * std::abs(phase - 32.0) / 32.0));
}

MemoryPhoto waves(int channels = 3) {
  return {600, 400, channels, [](std::int64_t column, std::int64_t row, int c) {
            if (c == 0) return wave(column);
            return c == 1 ? wave(row) : 255;
          }};
}

Options looking_down_options(int width, int height) {
  Options options;
  options.view.width = width;
  options.view.height = height;
  options.exaggeration = 1.0;
  options.sun.elevation_deg = 12.0;  // light that leaves white below 255, the same everywhere on a plain
  return options;
}

/// From `distance` above (x, z), straight down as far as the camera allows.
void look_down(Session& session, double x, double z, double distance) {
  session.camera.look_at({x, distance, z + 1e-3 * distance}, {x, 0.0, z});
}

/// The level that a tile's texture begins with; the number of levels where it has none.
int resident_level(const TextureBox& box, const TexturedPlain& source, TileIndex tile) {
  const GLuint texture = box.texture(tile);
  if (texture == 0) return source.textures()->levels;
  GLint width = 0;
  glBindTexture(GL_TEXTURE_2D, texture);
  glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_WIDTH, &width);
  int level = 0;
  while (source.textures()->level_size(level) > width) ++level;
  return level;
}

class TextureBoxTest : public test::GlTest {
 protected:
  Workers workers_{2};

  /// What full blue has become under the light there is, 0...1: all colours shrink by their channel's share.
  static double share(const std::vector<std::uint8_t>& pixels, const std::vector<std::uint8_t>& white, std::size_t i) {
    return pixels[i] / static_cast<double>(white[i]);
  }

  /// `drawn`: the view as it was drawn.
  static std::vector<std::uint8_t> picture(const TileSource& source, const Options& options, double x, double z,
                                           double distance, ViewState* drawn = nullptr) {
    Session session(source, options);
    look_down(session, x, z, distance);
    const Offscreen target(options.view.width, options.view.height, GL_RGBA8);
    session.complete_frame();
    if (drawn != nullptr) *drawn = session.view;
    return target.read_rgba8();
  }
};

TEST_F(TextureBoxTest, ShowsThePhotosColourWhereThePhotoHasIt) {
  MemoryPhoto photo = waves();
  MemoryPhoto white_photo(60, 40, 3, [](auto, auto, int) { return 255; });
  // 1.25 texels a pixel of the photo, and 0.32: finer and coarser.
  for (const int size : {256, 64}) {
    const TexturedPlain source(photo, size, 4);
    const TexturedPlain white_source(white_photo, 64, 4);
    const Options options = looking_down_options(400, 400);
    // Straight above the corner of four tiles: 60 world units, 120 pixels of the photo, on 400 pixels.
    const double distance = 30.0 / std::tan(options.view.fov_y_rad / 2.0);
    ViewState view;
    const auto pixels = picture(source, options, 100.0, 100.0, distance, &view);
    const auto white = picture(white_source, options, 100.0, 100.0, distance);
    int compared = 0;
    double shift = 0.0;  // sum, in pixels of the photo
    for (int y = 0; y < 400; ++y) {
      for (int x = 0; x < 400; ++x) {
        const WorldPoint place = ground_under(view, x, y);
        const double column = place.x * 2.0 - 0.5;
        const double row = place.z * 2.0 - 0.5;
        const std::size_t i = static_cast<std::size_t>(y * 400 + x) * 4;
        const double texel = std::max(1.0, 200.0 / (size - 1));  // pixels of the photo
        const auto check = [&](double at, std::size_t channel) {
          // The turns of the wave are rounded off.
          if (std::abs(std::remainder(at, 32.0)) < 1.0 + 1.5 * texel) return;
          const double whole = std::floor(at);
          const auto k = static_cast<std::int64_t>(whole);
          const double expected = wave(k) + (wave(k + 1) - wave(k)) * (at - whole);
          // Means of light instead of values, and three roundings on the way.
          const double found = 255.0 * share(pixels, white, i + channel);
          ASSERT_NEAR(found, expected, size == 256 ? 2.5 : 4.0) << x << " " << y << " channel " << channel;
          shift += (found - expected) / (wave(k + 1) - wave(k));
          ++compared;
        };
        check(column, 0);
        if (HasFatalFailure()) return;
        check(row, 1);
        if (HasFatalFailure()) return;
      }
    }
    EXPECT_GT(compared, 100000);
    // A half texel would be 0.39 or 1.59.
    EXPECT_NEAR(shift / compared, 0.0, 0.02) << size;
  }
}

TEST_F(TextureBoxTest, ShowsElevationColoursWhereThereIsNoTexture) {
  MemoryPhoto clear(60, 40, 4, [](auto, auto, int c) { return c == 3 ? 0 : 200; });
  const TexturedPlain source(clear, 64, 4);
  Options options = looking_down_options(200, 120);
  const auto with = picture(source, options, 150.0, 100.0, 150.0);
  options.mode = ColourMode::kElevation;
  EXPECT_EQ(picture(source, options, 150.0, 100.0, 150.0), with);
  MemoryPhoto photo = waves();
  TexturedPlain holed(photo, 64, 4);
  holed.without = {1, 0};
  options.mode.reset();
  const auto half = picture(holed, options, 150.0, 50.0, 40.0);  // the middle of tile (1, 0)
  options.mode = ColourMode::kElevation;
  EXPECT_EQ(picture(holed, options, 150.0, 50.0, 40.0), half);
}

TEST_F(TextureBoxTest, KeepsToBudgetAndBound) {
  MemoryPhoto photo = waves();
  const TexturedPlain source(photo, 256, 6);
  const std::uint64_t bound = std::uint64_t{8} << 20U;
  TextureBox box(source, bound, workers_);
  const TileRange range{{0, 0}, {3, 2}};
  ViewState view;
  view.eye = {150.0, 2.0, 100.0};
  view.height = 2000;
  // A budget of nothing is a texture a frame.
  constexpr std::uint64_t kWhole = 4 * (256 * 256 + 128 * 128 + 64 * 64 + 32 * 32 + 16 * 16 + 8 * 8);
  for (int frame = 0; frame < 100000 && (frame == 0 || box.figures().to_come > 0); ++frame) {
    box.update(range, view, 0);
    EXPECT_LE(box.figures().upload_bytes, kWhole);
    EXPECT_LE(box.figures().resident_bytes, bound);
    if (box.figures().upload_bytes == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  EXPECT_EQ(resident_level(box, source, {1, 1}), 0);
  EXPECT_EQ(box.figures().resident, 6);
  // From far away the fine levels are not wanted; what is there may stay, what comes is coarse.
  TextureBox far(source, bound, workers_);
  view.eye.y = 20000.0;
  far.finish(range, view);
  EXPECT_GE(resident_level(far, source, {1, 1}), 3);
  EXPECT_LT(far.figures().resident_bytes, 6U * 4 * 32 * 32 * 2);
}

TEST_F(TextureBoxTest, GetsCoarserWhereMemoryEnds) {
  MemoryPhoto photo = waves();
  const TexturedPlain source(photo, 256, 6);
  const TileRange range{{0, 0}, {3, 2}};
  ViewState view;
  view.eye = {150.0, 1.0, 100.0};
  view.height = 4000;
  int last = 0;
  for (const std::uint64_t bound : {4000000U, 1500000U, 400000U, 60000U, 12000U}) {
    TextureBox box(source, bound, workers_);
    for (int step = 0; step < 6; ++step) {
      // There and back: what was fine must make room.
      view.eye.x = 30.0 + 48.0 * step;
      box.finish(range, view);
      EXPECT_LE(box.figures().resident_bytes, bound);
    }
    EXPECT_GE(resident_level(box, source, {2, 0}), last);
    last = resident_level(box, source, {2, 0});
  }
  EXPECT_GE(last, 4);
  EXPECT_THROW(TextureBox(source, 2000, workers_), Error);
}

TEST_F(TextureBoxTest, LeavesTilesThatLeaveTheRange) {
  MemoryPhoto photo = waves();
  const TexturedPlain source(photo, 64, 4);
  TextureBox box(source, 1U << 20U, workers_);
  ViewState view;
  view.eye = {150.0, 30.0, 100.0};
  box.finish({{0, 0}, {3, 2}}, view);
  EXPECT_EQ(box.figures().resident, 6);
  const std::uint64_t all = box.figures().resident_bytes;
  box.finish({{2, 0}, {3, 1}}, view);
  EXPECT_EQ(box.figures().resident, 1);
  EXPECT_EQ(box.texture({0, 0}), 0U);
  EXPECT_NE(box.texture({2, 0}), 0U);
  EXPECT_LT(box.figures().resident_bytes, all / 3);
}

TEST_F(TextureBoxTest, NamesATextureThatCannotBeRead) {
  MemoryPhoto photo = waves();
  TexturedPlain source(photo, 64, 4);
  source.broken = {1, 0};
  Session session(source, looking_down_options(64, 64));
  const Error error = test::error_of([&] { session.complete_frame(); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_THAT(error.what(), testing::HasSubstr("textures/0/1/64.png"));
  EXPECT_EQ(session.textures()->figures().resident, 5);
}

TEST_F(TextureBoxTest, AnOverviewHoldsEveryTileAtTheLevelThatFits) {
  MemoryPhoto photo = waves();
  TexturedPlain plain(photo, 64, 4);
  plain.without = {2, 1};
  const auto texels_of = [](GLuint texture, int width, int height) {
    std::vector<std::uint8_t> texels(static_cast<std::size_t>(width * height * 4));
    glBindTexture(GL_TEXTURE_2D, texture);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    return texels;
  };
  // 3 x 2 tiles of 64 x 64 texels, a third for mip levels, and as much on its way are 229376 bytes.
  for (const auto& [bytes, level] : {std::pair{229376U, 0}, {229375U, 1}, {3584U, 3}}) {
    TextureOverview overview(plain, bytes, workers_);
    overview.finish();
    EXPECT_TRUE(overview.is_whole());
    const int size = 64 >> level;
    const auto texels = texels_of(overview.texture(), 3 * size, 2 * size);
    for (const TileIndex tile : {TileIndex{0, 0}, {1, 0}, {2, 0}, {0, 1}, {1, 1}, {2, 1}}) {
      const Picture expected = plain.has_texture(tile) ? read_texels(plain, tile, level) : Picture(size, size, 4);
      for (int row = 0; row < size; ++row) {
        const auto at = static_cast<std::size_t>(((tile.row * size + row) * 3 + tile.column) * size * 4);
        ASSERT_TRUE(std::equal(expected.row(row), expected.row(row) + size * 4,
                               texels.begin() + static_cast<std::ptrdiff_t>(at)))
            << tile.column << " " << tile.row << " " << row;
      }
    }
  }
  EXPECT_EQ(TextureOverview(plain, 3583, workers_).texture(), 0U);
  plain.broken = {1, 0};
  TextureOverview broken(plain, 229376, workers_);
  broken.finish();
  EXPECT_EQ(broken.error(), "member \"textures/0/1/64.png\": broken");
}

}  // namespace
}  // namespace isohf::view
