#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "isohf/archive/textures/texture_info.h"
#include "isohf/archive/writer.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/stages/stage.h"
#include "isohf/photo/projected_photo.h"
#include "isohf/photo/texture_cutter.h"

namespace isohf {

/// Of JPEG textures.
inline constexpr int kTextureQuality = 90;

/// Textures in the pass that makes the tiles. A tile's texture depends on the photo alone; its members stand before the
/// tile, so that a conversion that is resumed goes on at the next tile.
class TextureStage final : public Stage {
 public:
  /// Decides place, size and format, and how much the photo may keep for `tiles_at_once`. Reads no pixel.
  /// Throws Error{kInvalidArgument} naming the option or the photo at fault.
  static TextureStage make(const Plan& plan, const SourceInfo& source, const TextureRequest& request, int threads,
                           int tiles_at_once);

  /// Peak memory, bytes; an estimate.
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }
  [[nodiscard]] const std::vector<Warning>& warnings() const { return warnings_; }
  /// Photo pixels under the side of a texel, the larger of both directions.
  [[nodiscard]] double pixels_per_texel() const { return pixels_per_texel_; }

  /// The members of a tile, the coarsest level first; none where the photo does not show it.
  [[nodiscard]] std::unique_ptr<Made> make(TileIndex tile, const TileCodes& codes,
                                           const EncodedTile& encoded) const override;
  void add_before(TileIndex tile, const Made* made, ArchiveWriter& writer) override;
  void describe(const ArchiveWriter& writer, Metadata& metadata, ConvertSummary& summary) const override;

 private:
  struct Layout;
  TextureStage(std::unique_ptr<PhotoSource> bordered, PhotoSource& photo, TextureInfo info, Layout layout);
  using Encoded = std::vector<std::vector<std::byte>>;
  [[nodiscard]] bool shows(TileIndex tile) const;

  std::unique_ptr<PhotoSource> bordered_;      ///< the user's photo, where it shows a part of the ground; or nullptr
  std::unique_ptr<ProjectedPhoto> projected_;  ///< of one of these; nullptr where its rows are the world's
  PhotoSource& photo_;                         ///< the last of these
  TextureInfo info_;
  TextureCutter cutter_;
  double pixels_per_texel_;
  std::vector<Warning> warnings_;
  std::uint64_t memory_bytes_ = 0;
};

}  // namespace isohf
