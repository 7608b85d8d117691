#include "isohf/convert/texture_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>

#include "isohf/archive/picture_codec.h"
#include "isohf/base/error.h"
#include "isohf/convert/photo_placement.h"

namespace isohf {
namespace {

/// Decoded pixels that any photo may keep.
constexpr std::uint64_t kLeastCacheBytes = std::uint64_t{64} << 20U;
/// What OpenImageIO and the libraries that come with it take by themselves, measured with a photo of 64 x 64 pixels.
constexpr std::uint64_t kReaderBytes = 120000000;
/// A texel may be coarser than a pixel by rounding, as where a photo has exactly S-1 pixels a tile.
constexpr double kRounding = 1e-6;

void check(const TextureRequest& request, const PhotoInfo& photo) {
  const auto size = static_cast<unsigned>(std::max(request.max_size, 0));
  if (!std::has_single_bit(size) || request.max_size < kMinTextureSize || request.max_size > kMaxTextureSize) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--texture-size is {}, must be a power of two from {} to {}",
                                                         request.max_size, kMinTextureSize, kMaxTextureSize));
  }
  if (request.jpeg_quality < 1 || request.jpeg_quality > 100) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--texture-quality is {}, must be from 1 to 100", request.jpeg_quality));
  }
  if (photo.channels != 1 && photo.channels != 3 && photo.channels != 4) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: has {} channels; grey, RGB and RGBA are read", photo.path, photo.channels));
  }
}

/// The smallest size whose texels are no coarser than the photo's pixels.
int choose_size(const TileGrid& grid, const PhotoFrame& frame, int most) {
  const double pixels = std::max(grid.extent_x() / frame.spacing_x, grid.extent_z() / frame.spacing_z);
  int size = kMinTextureSize;
  while (size < most && static_cast<double>(size - 1) < pixels * (1.0 - kRounding)) size *= 2;
  return size;
}

TextureInfo describe(const Plan& plan, const TextureRequest& request, const PhotoPlacement& placement) {
  const PhotoInfo& photo = request.photo->info();
  TextureInfo info;
  info.format = request.format.value_or(photo.channels == 4 ? TextureFormat::kPng : TextureFormat::kJpeg);
  info.channels = info.format == TextureFormat::kJpeg ? std::min(photo.channels, 3) : photo.channels;
  info.size = choose_size(plan.grid, placement.frame, request.max_size);
  while ((info.size >> info.levels) >= kCoarsestTextureSize) ++info.levels;
  info.quality = request.jpeg_quality;
  info.photo_name = std::filesystem::path(photo.path).filename().string();
  info.photo_format = photo.format;
  info.photo_width = photo.width;
  info.photo_height = photo.height;
  info.placed_by = placement.by_georeference ? "georeference" : "source";
  info.placement = placement.bounds;
  return info;
}

/// Drops the alpha of an RGBA picture.
Picture without_alpha(const Picture& picture) {
  Picture rgb(picture.width, picture.height, 3);
  for (std::size_t i = 0; i < rgb.samples.size() / 3; ++i) {
    std::copy_n(picture.samples.data() + 4 * i, 3, rgb.samples.data() + 3 * i);
  }
  return rgb;
}

/// What the photo's reader should keep: pixels that are decoded once and asked for by several tiles. Where decoding
/// begins at the top, that is what a row of tiles needs, and the rows that tiles of the next one ask for early.
std::uint64_t cache_bytes(const PhotoInfo& photo, const TextureCutter& cutter, const TileGrid& grid, int threads) {
  std::int64_t rows = 0;
  for (const std::int64_t row : {std::int64_t{0}, grid.tile_rows() / 2}) {
    const auto [first, last] = cutter.rows_needed(photo, row);
    rows = std::max(rows, last - first + 1);
  }
  if (photo.random_access) rows = std::min<std::int64_t>(rows, 2 * (photo.block_height + 64) * threads);
  rows = std::min(rows + rows / 4 + 2 * photo.block_height, photo.height);
  return std::max(kLeastCacheBytes,
                  static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(photo.width) * photo.pixel_bytes);
}

}  // namespace

TextureStage::TextureStage(PhotoSource& photo, TextureInfo info, const TextureCutter& cutter)
    : photo_(photo), info_(std::move(info)), cutter_(cutter) {}

TextureStage TextureStage::make(const Plan& plan, const SourceInfo& source, const TextureRequest& request, int threads,
                                int tiles_at_once) {
  PhotoSource& photo = *request.photo;
  check(request, photo.info());
  PhotoPlacement placement = place_photo(photo.info(), source, plan.frame);
  const TextureInfo info = describe(plan, request, placement);
  TextureStage stage(photo, info, TextureCutter(plan.grid, placement.frame, {info.size, info.levels}));
  stage.warnings_ = photo.info().warnings;
  stage.warnings_.insert(stage.warnings_.end(), placement.warnings.begin(), placement.warnings.end());
  if (info.channels == 3 && photo.info().channels == 4) {
    stage.warnings_.push_back(fmt::format("{}: JPEG has no alpha, the photo's is dropped", photo.info().path));
  }
  const std::uint64_t cache = cache_bytes(photo.info(), stage.cutter_, plan.grid, threads);
  photo.set_cache_bytes(cache);
  // A cache holds a little more than it is told to, but no more than the photo.
  const std::uint64_t pixels = static_cast<std::uint64_t>(photo.info().width) *
                               static_cast<std::uint64_t>(photo.info().height) * photo.info().pixel_bytes;
  const std::uint64_t kept = std::min(cache + cache / 4, pixels);
  // Of each tile that is being cut: its levels and about 100 rows of floats; of each in flight: its members.
  const auto texels = static_cast<std::uint64_t>(info.size) * static_cast<std::uint64_t>(info.size);
  const auto channels = static_cast<std::uint64_t>(photo.info().channels);
  stage.memory_bytes_ =
      kReaderBytes + kept + static_cast<std::uint64_t>(threads) * texels * channels * 2 +
      static_cast<std::uint64_t>(tiles_at_once) * texels * channels / (info.format == TextureFormat::kPng ? 1 : 4);
  return stage;
}

double TextureStage::pixels_per_texel() const {
  return std::max(cutter_.pixels_per_texel_x(), cutter_.pixels_per_texel_z());
}

TextureStage::Encoded TextureStage::encode(TileIndex tile) const {
  Encoded encoded;
  if (!cutter_.touches(photo_.info(), tile)) return encoded;
  std::vector<Picture> levels = cutter_.cut(photo_, tile);
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    if (level->channels > info_.channels) *level = without_alpha(*level);
    encoded.push_back(info_.format == TextureFormat::kPng ? encode_png(*level) : encode_jpeg(*level, info_.quality));
  }
  return encoded;
}

void TextureStage::add(TileIndex tile, const Encoded& encoded, ArchiveWriter& writer) const {
  int level = info_.levels;
  for (const std::vector<std::byte>& member : encoded) {
    writer.add_member(texture_name(info_, tile, --level), member, false);
  }
}

TextureInfo TextureStage::info(const ArchiveWriter& writer) const {
  TextureInfo info = info_;
  const ArchiveWriter::MemberTotals totals = writer.members_in(kTextureFolder);
  info.members = totals.members;
  info.bytes = totals.bytes;
  return info;
}

}  // namespace isohf
