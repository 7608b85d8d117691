#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "formats/geotiff/tiff_file.h"
#include "formats/io/block_cache.h"
#include "formats/io/raw_file.h"
#include "isohf/raster.h"

namespace isohf {

/// Handles on one directory for any number of threads, opened when first needed.
class TiffHandlePool {
 public:
  TiffHandlePool(const RawFile& file, std::uint32_t directory) : file_(&file), directory_(directory) {}

  [[nodiscard]] std::unique_ptr<TiffHandle> take();
  void give_back(std::unique_ptr<TiffHandle> handle);

 private:
  const RawFile* file_;
  std::uint32_t directory_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<TiffHandle>> idle_;
};

/// Reads windows of one sample plane of a TIFF directory, in stored row order.
///
/// Three ways, chosen by the layout:
///  - strips whose bytes are the samples: read from the file straight into the window;
///  - tiles and strips of moderate size: decoded whole, in parallel, into a cache of two rows of blocks (or 16 MiB);
///  - compressed strips too large to hold: decoded row by row in order, the last 16 MiB of rows kept. Going back
///    beyond those decodes the strip again from its start.
class TiffBlocks {
 public:
  /// `channel` is the sample of each pixel of `image` to read. Checks every block's place in the file.
  /// Throws Error: kCorrupt for blocks that lie outside the file or are absurdly large, kUnsupported for sizes beyond
  /// isohf's bounds.
  TiffBlocks(const RawFile& file, const TiffLayout& layout, TiffMainImage image, int channel);

  /// Samples of blocks that are not stored; 0 without. One sample in host byte order.
  void set_fill(std::span<const std::byte> sample);

  /// Fills `samples` [window.columns * window.rows samples]. Throws Error{kCorrupt, kIo}.
  void read(const Window& window, std::span<std::byte> samples);

  [[nodiscard]] std::uint64_t block_count() const { return block_count_; }
  [[nodiscard]] std::uint64_t missing_blocks() const { return missing_; }
  /// A smaller bound for the cache: whole blocks that are read in order need none. Large strips that are decoded row by
  /// row keep theirs.
  void limit_cache(std::uint64_t bytes);
  /// What the cache takes at most within that bound.
  [[nodiscard]] std::uint64_t cache_bytes(std::uint64_t limit) const;
  /// Rows that decode together.
  [[nodiscard]] std::int64_t unit_rows() const { return mode_ == Mode::kDirect ? 1 : unit_rows_; }

 private:
  enum class Mode { kDirect, kBlocks, kRows };
  struct Unit;

  void choose_mode(std::uint64_t largest_block_bytes);
  void read_direct(const Window& window, std::span<std::byte> samples);
  void read_strip_rows(const Window& part, TiffBlockSpan strip, std::int64_t first_strip_row, std::byte* out,
                       std::vector<std::byte>& scratch);
  void read_units(const Window& window, std::span<std::byte> samples);
  void decode_units(std::span<Unit> units);
  void decode_unit(const Unit& unit, TiffHandle& handle) const;
  void decode_rows(const Unit& unit);
  void fill(std::byte* out, std::int64_t count) const;
  void pick_channel(const std::byte* pixels, std::byte* out, std::int64_t count) const;

  const RawFile& file_;
  TiffLayout layout_;
  std::uint32_t directory_;
  int channel_;
  std::int64_t plane_;  // of blocks, 0 where interleaved
  std::size_t sample_bytes_;
  Mode mode_ = Mode::kBlocks;
  std::int64_t unit_rows_ = 0;  // rows of one unit of the cache: a block, or some rows of a large strip
  std::uint64_t block_count_ = 0;
  std::uint64_t missing_ = 0;
  std::array<std::byte, 8> fill_ = {};
  std::optional<BlockCache> cache_;
  mutable TiffHandlePool handles_;
  std::unique_ptr<TiffHandle> in_order_;  // Mode::kRows
  std::int64_t next_row_ = -1;            // the row that in_order_ delivers next; -1: none
  bool map_strips_ = false;
  std::size_t since_forgotten_bytes_ = 0;
};

}  // namespace isohf
