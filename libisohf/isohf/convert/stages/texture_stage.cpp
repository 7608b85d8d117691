#include "isohf/convert/stages/texture_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/base/handed_in.h"
#include "isohf/convert/frame/photo_placement.h"
#include "isohf/error.h"
#include "isohf/photo/bordered_photo.h"

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
    throw Error(ErrorCode::kInvalidArgument, fmt::format("`max_size` is {}, must be a power of two from {} to {}",
                                                         request.max_size, kMinTextureSize, kMaxTextureSize));
  }
  if (photo.channels != 1 && photo.channels != 3 && photo.channels != 4) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: has {} channels; grey, RGB and RGBA are read", photo.path, photo.channels));
  }
  require_size(photo.path, photo.width, photo.height);
  const Georeference place = photo.georeference.value_or(Georeference{});
  for (const double length : {place.spacing_x, place.spacing_y, place.metres_per_unit}) {
    if (std::isfinite(length) && length > 0.0) continue;
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: a length of its georeference is {}, must be above 0", photo.path, length));
  }
}

/// The smallest size whose texels are no coarser than the photo's pixels.
int choose_size(const TileGrid& grid, const PhotoFrame& frame, int most) {
  const double pixels = std::max(grid.extent_x() / frame.spacing_x, grid.extent_z() / frame.spacing_z);
  int size = kMinTextureSize;
  while (size < most && static_cast<double>(size - 1) < pixels * (1.0 - kRounding)) size *= 2;
  return size;
}

TextureInfo texture_info(const Plan& plan, const TextureRequest& request, const PhotoPlacement& placement) {
  const PhotoInfo& photo = request.photo->info();
  TextureInfo info;
  info.format = request.format.value_or(photo.channels == 4 ? TextureFormat::kPng : TextureFormat::kJpeg);
  info.channels = info.format == TextureFormat::kJpeg ? std::min(photo.channels, 3) : photo.channels;
  info.size = choose_size(plan.grid, placement.frame, request.max_size);
  while ((info.size >> info.levels) >= kCoarsestTextureSize) ++info.levels;
  info.quality = kTextureQuality;
  info.photo_name = std::filesystem::path(photo.path).filename().string();
  info.photo_format = photo.format;
  info.photo_width = photo.width;
  info.photo_height = photo.height;
  info.placed_by = placement.by_georeference ? "georeference" : "source";
  info.placement = placement.bounds;
  return info;
}

/// Whether anything of an RGBA picture is seen.
bool has_opacity(const Picture& picture) {
  for (std::size_t i = 3; i < picture.samples.size(); i += 4) {
    if (picture.samples[i] != 0) return true;
  }
  return false;
}

/// Drops the alpha of an RGBA picture.
Picture without_alpha(const Picture& picture) {
  Picture rgb(picture.width, picture.height, 3);
  for (std::size_t i = 0; i < rgb.samples.size() / 3; ++i) {
    std::copy_n(picture.samples.data() + 4 * i, 3, rgb.samples.data() + 3 * i);
  }
  return rgb;
}

/// Rows of the photo that a row of tiles reads, at most.
std::int64_t rows_below_tiles(const PhotoInfo& photo, const PhotoPlacement& placement, const TextureCutter& cutter,
                              const TileGrid& grid) {
  std::int64_t rows = 0;
  if (!placement.warp) {
    for (const std::int64_t row : {std::int64_t{0}, grid.tile_rows() / 2}) {
      const auto [first, last] = cutter.rows_needed(photo, row);
      rows = std::max(rows, last - first + 1);
    }
    return rows;
  }
  const auto last = static_cast<double>(photo.height - 1);
  const auto inside = [&](double v, double otherwise) { return std::isnan(v) ? otherwise : std::clamp(v, 0.0, last); };
  for (const SourceWarp::RowBounds& bounds : SourceWarp(grid, *placement.warp, HUGE_VAL).reading_bounds()) {
    rows = std::max(rows, static_cast<std::int64_t>(inside(bounds.most, last) - inside(bounds.least, 0.0)) + 3);
  }
  return rows;
}

/// What the photo's reader should keep: pixels that are decoded once and asked for by several tiles. Where decoding
/// begins at the top, that is what a row of tiles needs, and the rows that tiles of the next one ask for early.
std::uint64_t cache_bytes(const PhotoInfo& photo, std::int64_t rows, int threads) {
  if (photo.random_access) rows = std::min<std::int64_t>(rows, 2 * (photo.block_height + 64) * threads);
  rows = std::min(rows + rows / 4 + 2 * photo.block_height, photo.height);
  return std::max(kLeastCacheBytes,
                  static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(photo.width) * photo.pixel_bytes);
}

/// Texels beyond the outermost that the coarsest level reads.
std::int64_t margin_of(const TextureInfo& info) {
  return (std::int64_t{1} << (info.levels - 1)) / 2;
}

/// One pixel on every texel of the whole texture and its margins: the cutter then takes them as they are.
PhotoFrame frame_of_texels(const TileGrid& grid, const TextureInfo& info) {
  const double spacing_x = grid.extent_x() / (info.size - 1);
  const double spacing_z = grid.extent_z() / (info.size - 1);
  const auto margin = static_cast<double>(margin_of(info));
  return {-margin * spacing_x, -margin * spacing_z, spacing_x, spacing_z};
}

}  // namespace

struct TextureStage::Layout {
  std::unique_ptr<ProjectedPhoto> projected;
  TextureCutter cutter;
  double pixels_per_texel;

  static Layout make(PhotoSource& photo, const TileGrid& grid, const PhotoPlacement& placement,
                     const TextureInfo& info) {
    const TextureShape shape{info.size, info.levels};
    const TextureCutter cutter(grid, placement.frame, shape);
    const double pixels = std::max(cutter.pixels_per_texel_x(), cutter.pixels_per_texel_z());
    if (!placement.warp) return {nullptr, cutter, pixels};
    const PhotoFrame frame = frame_of_texels(grid, info);
    const auto texels = [&](std::int64_t tiles) { return tiles * (info.size - 1) + 1 + 2 * margin_of(info); };
    return {std::make_unique<ProjectedPhoto>(photo, *placement.warp, frame, texels(grid.tile_columns()),
                                             texels(grid.tile_rows())),
            TextureCutter(grid, frame, shape), pixels};
  }
};

TextureStage::TextureStage(std::unique_ptr<PhotoSource> bordered, PhotoSource& photo, TextureInfo info, Layout layout)
    : bordered_(std::move(bordered)),
      projected_(std::move(layout.projected)),
      photo_(projected_ ? *projected_ : photo),
      info_(std::move(info)),
      cutter_(layout.cutter),
      pixels_per_texel_(layout.pixels_per_texel) {}

TextureStage TextureStage::make(const Plan& plan, const SourceInfo& source, const TextureRequest& request, int threads,
                                int tiles_at_once) {
  check(request, request.photo->info());
  PhotoPlacement placement = place_photo(request.photo->info(), source, plan.frame, request.same_system);
  TextureInfo info = texture_info(plan, request, placement);
  // Beyond a photo of a part of the ground nothing is shown, which takes alpha: where JPEG is asked for, its border goes on.
  std::unique_ptr<PhotoSource> bordered;
  if (placement.is_part && request.format != TextureFormat::kJpeg) {
    bordered = std::make_unique<BorderedPhoto>(*request.photo);
    placement = place_photo(bordered->info(), source, plan.frame, request.same_system);
    info.format = TextureFormat::kPng;
    info.channels = 4;
  }
  PhotoSource& photo = bordered ? *bordered : *request.photo;
  Layout layout = Layout::make(photo, plan.grid, placement, info);
  TextureStage stage(std::move(bordered), photo, info, std::move(layout));
  stage.warnings_ = photo.info().warnings;
  stage.warnings_.insert(stage.warnings_.end(), placement.warnings.begin(), placement.warnings.end());
  if (info.channels == 3 && photo.info().channels == 4) {
    stage.warnings_.push_back(loss(fmt::format("{}: JPEG has no alpha, the photo's is dropped", photo.info().path)));
  }
  const std::int64_t rows = rows_below_tiles(photo.info(), placement, stage.cutter_, plan.grid);
  const std::uint64_t cache = cache_bytes(photo.info(), rows, threads);
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
  if (stage.projected_) {
    // 64 rows of places at once, of 16 bytes.
    const auto places = static_cast<std::uint64_t>(info.size + 2 * margin_of(info) + 1) * 65 * 16;
    stage.memory_bytes_ += static_cast<std::uint64_t>(threads) * (places + ProjectedPhoto::kWindowBytes);
  }
  return stage;
}

bool TextureStage::shows(TileIndex tile) const {
  if (!projected_) return cutter_.touches(photo_.info(), tile);
  const std::int64_t span = info_.size - 1;
  const std::int64_t margin = margin_of(info_);
  return projected_->shows({tile.column * span + margin, tile.row * span + margin, info_.size, info_.size});
}

std::unique_ptr<Stage::Made> TextureStage::make(TileIndex tile, const TileCodes& /*codes*/,
                                                const EncodedTile& encoded) const {
  if (encoded.is_empty || !shows(tile)) return nullptr;
  std::vector<Picture> levels = cutter_.cut(photo_, tile);
  // A transparent border alone shows nothing.
  if (bordered_ && std::none_of(levels.begin(), levels.end(), has_opacity)) return nullptr;
  Encoded members;
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    if (level->channels > info_.channels) *level = without_alpha(*level);
    members.push_back(info_.format == TextureFormat::kPng ? encode_png(*level) : encode_jpeg(*level, info_.quality));
  }
  return std::make_unique<MadeOf<Encoded>>(std::move(members));
}

void TextureStage::add_before(TileIndex tile, const Made* made, ArchiveWriter& writer) {
  if (made == nullptr) return;
  int level = info_.levels;
  for (const std::vector<std::byte>& member : static_cast<const MadeOf<Encoded>*>(made)->value) {
    writer.add_member(texture_name(info_, tile, --level), member, false);
  }
}

void TextureStage::describe(const ArchiveWriter& writer, Metadata& metadata, ConvertSummary& summary) const {
  TextureInfo info = info_;
  const MemberTotals totals = writer.members_in(kTextureFolder);
  info.members = totals.members;
  summary.texture_bytes = info.bytes = totals.bytes;
  summary.pixels_per_texel = pixels_per_texel_;
  metadata.textures = {texture_name_pattern(info.format)};
  metadata.extensions.emplace_back(kTileTexturesName, format_texture_info(info));
}

}  // namespace isohf
