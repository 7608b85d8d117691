#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/plain_samples.h"
#include "formats/netcdf/cf_raster.h"
#include "formats/netcdf/netcdf_file.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/assert.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// One chunk is decoded whole.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30U;
/// What is kept of chunks unless less is asked for: two rows of them, as the first row of a raster may be any of one.
constexpr std::uint64_t kMostKeptBytes = std::uint64_t{64} << 20U;

constexpr int kInt64 = 10;  // as netcdf.h numbers the type; 11 is unsigned

class NetcdfSource final : public HeightSource {
 public:
  NetcdfSource(const std::string& path, const OpenOptions& options) {
    require_sound_netcdf(path);
    file_ = std::make_unique<NetcdfFile>(path);
    info_.path = path;
    info_.format = file_->is_hdf5() ? "netCDF-4" : "netCDF";
    raster_ = read_cf(*file_, options, info_);
    bound_undeclared_voids(info_);
    read_sidecars(info_, 0);  // GDAL looks nowhere else for the meaning of a variable
    read_chunks(std::min(options.buffer_bytes, kMostKeptBytes));
    apply_open_options(info_, options);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    Window stored = raster_.from_south ? turned(window, info_.height) : window;
    if (raster_.from_east) stored.column = info_.width - window.column - window.columns;
    const NetcdfFile::Variable& variable = *raster_.variable;
    const std::size_t rank = variable.sizes.size();
    std::vector<std::size_t> start(rank, 0);
    std::vector<std::size_t> count(rank, 1);
    const std::size_t row = raster_.by_columns ? rank - 1 : rank - 2;
    const std::size_t column = raster_.by_columns ? rank - 2 : rank - 1;
    start[row] = static_cast<std::size_t>(stored.row);
    count[row] = static_cast<std::size_t>(stored.rows);
    start[column] = static_cast<std::size_t>(stored.column);
    count[column] = static_cast<std::size_t>(stored.columns);
    const std::size_t size = size_bytes(info_.sample_type);
    if (raster_.by_columns || raster_.from_east) {
      buffer_.resize(samples.size());
      file_->read(variable, start, count, buffer_);
      rearrange(count[row], count[column], size, samples);
    } else {
      file_->read(variable, start, count, samples);
    }
    if (raster_.from_south) turn_rows(samples, count[column] * size);
    if (variable.type >= kInt64) widen_whole_numbers(info_.path, variable.type == kInt64, window, samples);
  }

  [[nodiscard]] std::uint64_t buffer_bytes() const override { return kept_bytes_; }

 private:
  /// Puts what buffer_ has column by column, or from East to West, into rows from West to East.
  void rearrange(std::size_t rows, std::size_t columns, std::size_t size, std::span<std::byte> samples) const {
    const std::size_t row_step = raster_.by_columns ? 1 : columns;
    const std::size_t column_step = raster_.by_columns ? rows : 1;
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t from = (raster_.from_east ? columns - 1 - c : c) * column_step;
      for (std::size_t r = 0; r < rows; ++r) {
        std::memcpy(samples.data() + (r * columns + c) * size, buffer_.data() + (from + r * row_step) * size, size);
      }
    }
  }

  void read_chunks(std::uint64_t most_kept_bytes) {
    info_.block_width = info_.width;
    const std::vector<std::size_t>& chunk = raster_.variable->chunk;
    if (chunk.empty()) return;
    auto bytes = static_cast<double>(size_bytes(info_.sample_type));
    for (const std::size_t size : chunk) bytes *= static_cast<double>(size);
    if (bytes > static_cast<double>(kMostChunkBytes)) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: its chunks have {:.3g} bytes, at most {} are read (nccopy -c makes smaller ones)",
                              info_.path, bytes, kMostChunkBytes));
    }
    const auto last = static_cast<std::int64_t>(chunk.back());
    const auto before = static_cast<std::int64_t>(chunk[chunk.size() - 2]);
    info_.block_height = std::clamp<std::int64_t>(raster_.by_columns ? last : before, 1, info_.height);
    info_.block_width = std::clamp<std::int64_t>(raster_.by_columns ? before : last, 1, info_.width);
    const auto chunk_bytes = static_cast<std::uint64_t>(bytes);
    const auto in_a_row = static_cast<std::uint64_t>((info_.width + info_.block_width - 1) / info_.block_width);
    kept_bytes_ = std::min(2 * in_a_row * chunk_bytes, std::max(most_kept_bytes, chunk_bytes));
    file_->keep_chunks(*raster_.variable, kept_bytes_, kept_bytes_ / chunk_bytes);
  }

  SourceInfo info_;
  std::unique_ptr<NetcdfFile> file_;
  CfRaster raster_;
  std::uint64_t kept_bytes_ = 0;  ///< of chunks
  std::vector<std::byte> buffer_;
};

bool looks_like_netcdf(std::span<const std::byte> head) {
  const std::string_view text = text_of(head);
  const bool is_classic = text.size() > 4 && text.starts_with("CDF") && (text[3] == 1 || text[3] == 2 || text[3] == 5);
  return is_classic || text.starts_with("\x89HDF\r\n\x1a\n");
}

std::unique_ptr<HeightSource> open_netcdf(const std::string& path, const OpenOptions& options) {
  return std::make_unique<NetcdfSource>(path, options);
}

}  // namespace

const Format kNetcdfFormat = {.name = "netCDF",
                              .extensions = {".nc", ".nc4", ".grd"},
                              .library = netcdf_library,
                              .note = "takes `channel`",
                              .open = open_netcdf,
                              .recognises = looks_like_netcdf};

}  // namespace isohf
