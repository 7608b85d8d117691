#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/geotiff/tiff_file.h"
#include "formats/io/block_cache.h"
#include "isohf/raster.h"

namespace isohf {

/// Reads windows of one sample of each pixel of a TIFF directory, or of all of them interleaved, in stored row order.
/// Blocks are decoded whole, in parallel, into a cache of two rows of blocks (16 MiB at least, if there are so many).
/// Samples of 1 bit become bytes of 0 and 1.
class TiffBlocks {
 public:
  static constexpr int kAllSamples = -1;

  /// `channel` is the sample to read. cache_bytes  most bytes of decoded samples to keep, but for two blocks. Throws
  /// Error: kCorrupt for blocks outside the file, or too short for what they must hold; kUnsupported for blocks too
  /// large to decode whole.
  TiffBlocks(std::string path, const TiffLayout& layout, TiffMainImage image, int channel,
             std::uint64_t cache_bytes = UINT64_MAX);

  /// One sample in host byte order, for blocks that are not stored; 0 without.
  void set_fill(std::span<const std::byte> sample);

  /// Fills `samples` [window.columns * window.rows pixels]. Throws Error{kCorrupt}.
  void read(const Window& window, std::span<std::byte> samples);

  [[nodiscard]] std::uint64_t block_count() const { return block_count_; }
  [[nodiscard]] std::uint64_t missing_blocks() const { return missing_; }
  /// Most bytes of the cache.
  [[nodiscard]] std::uint64_t buffer_bytes() const { return cache_->capacity() * cache_->block_bytes(); }

 private:
  struct Unit {
    std::int64_t across = 0;
    std::int64_t down = 0;
    std::byte* bytes = nullptr;  ///< in the cache, or of the window that is read
    bool is_decoded = false;
    bool is_in_place = false;  ///< decoded where it is delivered
  };

  void check_blocks(TiffHandle& handle);
  void decode(std::vector<Unit>& units);
  void decode(const Unit& unit, TiffHandle& handle) const;
  [[nodiscard]] bool can_read_in_place(const Unit& unit, const Window& window) const;
  /// Whether the decoded bytes of a block are those of its delivered pixels.
  [[nodiscard]] bool is_stored_as_delivered() const;
  void copy_out(const Unit& unit, const Window& window, std::span<std::byte> samples) const;
  [[nodiscard]] std::unique_ptr<TiffHandle> take_handle();
  void give_back(std::unique_ptr<TiffHandle> handle);

  std::string path_;
  TiffLayout layout_;
  std::uint32_t directory_;
  int channel_;
  std::size_t sample_bytes_;
  std::size_t pixel_bytes_;  ///< delivered
  std::uint64_t block_count_ = 0;
  std::uint64_t missing_ = 0;
  std::array<std::byte, 8> fill_ = {};
  std::optional<BlockCache> cache_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<TiffHandle>> idle_;  ///< one for each thread that has decoded
};

}  // namespace isohf
