#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/mosaic/mosaic_layout.h"
#include "formats/mosaic/reader_pool.h"
#include "formats/mosaic/strip_reader.h"
#include "isohf/raster.h"

namespace isohf {

/// Which of several members shows where they overlap. Finer ones always lie over coarser ones.
enum class OverlapRule { kLast, kFirst };

/// Many rasters as one, whose samples are theirs bit for bit where they agree in kind and resolution.
///
/// Members of the finest resolution lie on the mosaic's grid. Coarser ones are interpolated bilinearly in double
/// between samples of their own resolution, across their files' borders, so that no seam is there; so are those of
/// another reference system, at the places to which PROJ brings the mosaic's samples. A void of one member
/// shows what lies below it.
/// Memory: one strip of whole rows (info().block_height of them), and what the readers keep that are open, which
/// buffer_bytes() counts; about 150 bytes and the path for each member. At most most_open_rasters() files are open.
/// Full-width windows from North to South open each member once for each strip that it reaches into, less where it is
/// still open.
class MosaicSource final : public HeightSource {
 public:
  /// `path` is what messages call the whole.
  MosaicSource(std::string path, MosaicPlan plan, const OpenOptions& options, OverlapRule rule);

  [[nodiscard]] const SourceInfo& info() const override { return plan_.info; }
  void read_window(const Window& window, std::span<std::byte> samples) override;
  /// Fewer readers stay open. Those that do keep what they like: strips do not begin where their blocks do.
  void limit_buffers(std::uint64_t bytes) override;
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override;

  [[nodiscard]] const MosaicPlan& plan() const { return plan_; }
  [[nodiscard]] std::int64_t times_opened() const { return pool_.times_opened(); }

 private:
  struct Part;
  using Orders = std::vector<std::int32_t>;  ///< places among the paths

  void choose_strips();
  void share_memory(std::uint64_t idle_bytes);
  void compose(const Window& window, std::span<std::byte> out);
  /// orders, where it is not empty: of each sample the file that shows, which layers of one resolution go by.
  void draw(std::size_t layer, const Window& window, std::span<std::byte> out, Orders& orders);
  void interpolate(std::size_t layer, const Window& window, std::span<std::byte> out, Orders& orders);
  void reproject(std::size_t layer, bool outer, const Window& window, std::span<std::byte> out, Orders& orders);
  void reproject_block(std::size_t layer, bool outer, const Window& block, const Window& window,
                       std::span<std::byte> out, Orders& orders);
  /// Empty where no other layer is of the layer's resolution.
  [[nodiscard]] Orders orders_for(std::size_t layer, const Window& window) const;
  /// Lays samples over others where their file is to be seen, void ones nowhere.
  void lay_by_order(std::span<const std::byte> upper, std::span<const std::int32_t> upper_orders,
                    std::span<std::byte> lower, std::span<std::int32_t> lower_orders) const;
  [[nodiscard]] bool has_void(const Window& block, const Window& window, std::span<const std::byte> out) const;
  [[nodiscard]] std::vector<Part> parts_in(std::size_t layer, const Window& window) const;
  void read_part(Part& part);
  [[nodiscard]] std::size_t bytes_of(const Window& window) const;

  MosaicPlan plan_;
  OverlapRule rule_;
  std::uint64_t unpacked_bytes_;  ///< that all members together may hold
  ReaderPool pool_;
  /// Of members that are read side by side; here because every thread's heap would grow.
  std::vector<std::byte> parts_;
  StripReader strips_;
};

}  // namespace isohf
