#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/restore/place_mesh.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/restore/scattered_surface.h"
#include "isohf/restore/surface_rows.h"

namespace isohf {

/// The metadata's "lossless" member: what is needed beside the residual members to have the source's samples again.
struct LosslessRecord {
  SampleMapping mapping;
  std::int64_t width = 0;
  std::int64_t height = 0;
  RestoreMethod method = RestoreMethod::kHex;  ///< how samples are predicted
  bool at_places = false;                      ///< by triangles at the places of member kPlacesName instead
  std::int64_t rows_per_member = 0;
  std::vector<double> void_values;   ///< as SourceInfo has them
  std::uint64_t residual_bytes = 0;  ///< of all residual members, compressed
  std::string sha256;                ///< over all raw samples, little-endian, row by row
};

inline constexpr const char* kLosslessName = "lossless";

/// The member's JSON text, and back; nullopt where the archive has no residuals. Throws Error{kCorrupt}.
[[nodiscard]] std::string format_lossless(const LosslessRecord& record);
[[nodiscard]] std::optional<LosslessRecord> lossless_record(const Metadata& metadata);

/// "residual/00000000": the member that starts with source row `first_row`.
[[nodiscard]] std::string residual_name(std::int64_t first_row);

/// Where the samples of a source that was projected lie: a PlaceMesh's values, as doubles.
inline constexpr const char* kPlacesName = "residual/places";
[[nodiscard]] std::vector<std::byte> bytes_of(const PlaceMesh& places);
/// Throws Error{kCorrupt} where the bytes are no mesh of that size.
[[nodiscard]] PlaceMesh places_from_bytes(std::int64_t width, std::int64_t height, std::span<const std::byte> bytes);

/// Predicts the samples of a source, row by row from North to South: on its own grid, or at places of their own.
class SamplePredictor {
 public:
  /// places: nullopt where the source's rows are rows of the world.
  SamplePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, SurfaceRows::ReadTile read_tile,
                  const SampleGrid& samples, RestoreMethod method, std::optional<PlaceMesh> places);

  /// As SurfaceRows::read.
  void read(std::int64_t first, std::int64_t rows, std::span<double> predicted);

 private:
  SampleGrid samples_;
  std::optional<PlaceMesh> places_;
  std::unique_ptr<SurfaceRows> rows_;
  std::unique_ptr<ScatteredSurface> scattered_;
};

/// The source's own samples out of an archive with residuals, from its first row to its last.
class LosslessReader {
 public:
  /// Throws Error{kCorrupt} where the record does not fit the rest of the metadata.
  LosslessReader(const ArchiveReader& archive, const LosslessRecord& record);

  [[nodiscard]] bool at_end() const { return next_row_ == record_.height; }
  /// The rows of the next member, in the source's sample type. Throws Error{kCorrupt} naming the member.
  [[nodiscard]] std::vector<std::byte> read_next();

 private:
  const ArchiveReader& archive_;
  LosslessRecord record_;
  SamplePredictor surface_;
  std::int64_t next_row_ = 0;
};

}  // namespace isohf
