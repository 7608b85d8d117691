#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/mosaic/mosaic_plan.h"
#include "formats/mosaic/reader_pool.h"
#include "isohf/raster.h"

namespace isohf {

/// Which of several members shows where they overlap. Finer ones always lie over coarser ones.
enum class OverlapRule { kLast, kFirst };

/// Many rasters as one, whose samples are theirs bit for bit if they agree in kind and resolution.
///
/// Members of the finest resolution lie on the mosaic's grid. Coarser ones are interpolated bilinearly in double
/// between samples of their own resolution, across their files' borders, so that no seam is there; so are those of
/// another reference system, at the positions to which PROJ brings the mosaic's samples. A void of one member
/// shows what lies below it.
/// Memory: one strip of whole rows (info().block_height of them), and what the readers keep that are open, which
/// buffer_bytes() counts; about 150 bytes and the path for each member. At most most_open_rasters() files are open.
/// Full-width windows from North to South open each member once for each strip that it reaches into, less if it is
/// still open.
class MosaicSource final : public HeightSource {
 public:
  /// `path` is what messages call the whole.
  MosaicSource(std::string path, MosaicPlan plan, const OpenOptions& options, OverlapRule rule);

  [[nodiscard]] const SourceInfo& info() const override { return plan_.info; }
  void read_window(const Window& window, std::span<std::byte> samples) override;
  [[nodiscard]] bool is_gap(const Window& window) const override;
  [[nodiscard]] std::uint64_t buffer_bytes() const override;

  [[nodiscard]] const MosaicPlan& plan() const { return plan_; }
  [[nodiscard]] std::int64_t times_opened() const { return pool_.times_opened(); }

 private:
  struct Part;
  struct Canvas;

  void compose(const Window& window, std::span<std::byte> out);
  [[nodiscard]] std::vector<Part> parts_in(std::size_t layer, const Window& window) const;
  void read_part(const Part& part);
  void draw(std::size_t layer, Canvas& canvas);
  void interpolate(std::size_t layer, bool outer, bool below, Canvas& canvas);
  void interpolate_block(std::size_t layer, bool outer, bool below, const Window& block, Canvas& canvas);
  void lay(std::span<const std::byte> upper, std::span<const std::int32_t> orders, std::int64_t row,
           std::int64_t column, Canvas& canvas) const;
  [[nodiscard]] bool has_void(const Window& block, const Canvas& canvas) const;
  [[nodiscard]] std::size_t bytes_of(const Window& window) const;

  MosaicPlan plan_;
  OverlapRule rule_;
  std::uint64_t idle_bytes_;  ///< that readers which are not in use keep at most
  ReaderPool pool_;
  std::vector<std::byte> parts_;  ///< of members that are read side by side
  /// Rows that are kept for windows of fewer, in the columns of the last window; without rows: none.
  Window strip_;
  std::vector<std::byte> strip_samples_;
};

}  // namespace isohf
