#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "isohf/restore/raster/sample_store.h"
#include "isohf/surface.h"

namespace isohf {

/// What samples a raster is to have, and what its format holds.
struct RasterRequest {
  std::string path;  ///< names the raster in messages
  SampleType type = SampleType::kFloat32;
  bool as_source = true;  ///< with the source's scale and offset; its decimals are kept where there is a scale
  std::optional<double> scale = {};  ///< elevation = raw * scale + offset
  std::optional<double> offset = {};
  bool clamps = false;         ///< samples that the type does not hold become its ends
  bool states_scale = false;   ///< the raster has a place for scale and offset
  bool needs_nodata = false;   ///< ... has a number for nodata in any case
  bool voids_are_nan = false;  ///< ... has no other value for nodata
  bool is_text = false;        ///< ... holds any number
  std::optional<RestoreMethod> method = {};
};

/// The samples of a raster that is made of an archive, raw, as its type has them.
class RasterSamples {
 public:
  RasterSamples() = default;
  RasterSamples(const RasterSamples&) = delete;
  RasterSamples& operator=(const RasterSamples&) = delete;
  virtual ~RasterSamples() = default;

  [[nodiscard]] const SampleMapping& mapping() const { return mapping_; }
  [[nodiscard]] std::optional<double> nodata() const { return nodata_; }
  /// Those since the last call.
  [[nodiscard]] std::vector<Warning> warnings() { return std::exchange(warnings_, {}); }

  /// Some whole rows from `first_row` on.
  using Take = std::function<void(std::int64_t first_row, std::span<const std::byte> rows)>;
  /// All rows, as often as it is called, on the caller's oneTBB arena. Throws Error{kInvalidArgument} for a sample that
  /// the type does not hold, naming column, row and remedy; kCorrupt, kCancelled.
  virtual void read_all(const Take& take) = 0;
  /// Of the last read_all().
  [[nodiscard]] virtual SampleStore::Result counts() const { return {}; }

 protected:
  SampleMapping mapping_;
  std::optional<double> nodata_;
  std::vector<Warning> warnings_;
};

/// Samples of the surface on a grid, by the method in the request or usual_method(). Elevations in uint8 and uint16 are
/// spread over all numbers of the type, unless scale or offset is given, or those of the source are kept: all of them
/// are then read once more. Stages "range", "export".
[[nodiscard]] std::unique_ptr<RasterSamples> surface_samples(const ArchiveReader& archive, const SampleGrid& grid,
                                                             const RasterRequest& request, const Job& job);

/// The samples that the archive keeps of its source, bit for bit, or in another type if it holds every one of them
/// exactly. Stage "export".
[[nodiscard]] std::unique_ptr<RasterSamples> source_samples(const ArchiveReader& archive, const RasterRequest& request,
                                                            const Job& job);

}  // namespace isohf
