#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/text.h"
#include "formats/module_loader.h"
#include "formats/netcdf/cf_file.h"
#include "formats/netcdf/netcdf_module.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// One chunk is decoded whole.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30U;
/// What is kept of chunks where nobody asks for less: two rows of them, as the first row of a raster may be any of one.
constexpr std::uint64_t kMostKeptBytes = std::uint64_t{64} << 20U;
constexpr std::uint64_t kMostAttributeBytes = std::uint64_t{1} << 20U;

const IsohfNetcdfModule& netcdf_module() {
  return *static_cast<const IsohfNetcdfModule*>(
      load_module({"isohf_netcdf.so", ISOHF_NETCDF_SYMBOL, ISOHF_NETCDF_ABI, "netCDF-4 files need the netCDF module",
                   "ISOHF_BUILD_NETCDF_MODULE"}));
}

/// A file that is open in the module.
class Netcdf4File final : public CfFile {
 public:
  explicit Netcdf4File(const std::string& path) : path_(path), module_(netcdf_module()) {
    IsohfNetcdfFile* opened = nullptr;
    IsohfNetcdfCounts counts{};
    const int result = module_.open(path.c_str(), &opened, &counts, &message_);
    file_.reset(opened);
    require(result);
    for (std::int32_t i = 0; i < counts.dimensions; ++i) {
      std::array<char, 257> name{};
      std::uint64_t size = 0;
      require(module_.dimension(opened, i, name.data(), &size, &message_));
      dimensions.push_back({name.data(), size});
    }
    attributes = attributes_of(-1, counts.attributes);
    for (std::int32_t i = 0; i < counts.variables; ++i) {
      IsohfNetcdfVariable found{};
      require(module_.describe(opened, i, &found, &message_));
      Variable variable;
      variable.name = found.name;
      variable.type = found.type;
      for (std::int32_t axis = 0; axis < found.rank; ++axis) {
        variable.dimensions.push_back(static_cast<std::size_t>(found.dimensions[axis]));
        if (variable.dimensions.back() >= dimensions.size()) {
          throw Error(ErrorCode::kCorrupt, path + ": has a variable of a dimension that is not there");
        }
      }
      variable.attributes = attributes_of(i, found.attributes);
      variables.push_back(std::move(variable));
      described_.push_back(found);
    }
  }

  [[nodiscard]] std::vector<double> numbers(const Variable& variable, std::uint64_t first,
                                            std::uint64_t count) override {
    std::vector<double> list(static_cast<std::size_t>(count));
    require(module_.numbers(file_.get(), index_of(variable), first, count, list.data(), &message_));
    return list;
  }

  [[nodiscard]] const IsohfNetcdfVariable& described(const Variable& variable) const {
    return described_[static_cast<std::size_t>(index_of(variable))];
  }
  void read(const Variable& variable, const std::vector<std::uint64_t>& start, const std::vector<std::uint64_t>& count,
            std::span<std::byte> samples) {
    require(module_.read(file_.get(), index_of(variable), start.data(), count.data(), samples.data(), &message_));
  }
  void keep(const Variable& variable, std::uint64_t bytes, std::uint64_t chunks) {
    module_.cache(file_.get(), index_of(variable), bytes, chunks);
  }

 private:
  struct Close {
    void operator()(IsohfNetcdfFile* file) const { netcdf_module().close(file); }
  };

  void require(int result) const {
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", path_, message_.text));
  }
  [[nodiscard]] std::int32_t index_of(const Variable& variable) const {
    return static_cast<std::int32_t>(&variable - variables.data());
  }

  Attributes attributes_of(std::int32_t variable, std::int32_t count) {
    Attributes found;
    for (std::int32_t i = 0; i < count; ++i) {
      IsohfNetcdfAttribute attribute{};
      require(module_.attribute(file_.get(), variable, i, &attribute, &message_));
      constexpr std::int32_t kText = 2;
      constexpr std::int32_t kLastNumber = 11;
      if (attribute.type > kLastNumber || attribute.count > kMostAttributeBytes) continue;
      std::string text(attribute.type == kText ? attribute.count : 0, '\0');
      std::vector<double> list(attribute.type == kText ? 0 : attribute.count);
      require(module_.value(file_.get(), variable, &attribute, text.data(), list.data(), &message_));
      if (attribute.type == kText) {
        found.emplace(attribute.name, trimmed(text));
      } else {
        found.emplace(attribute.name, std::move(list));
      }
    }
    return found;
  }

  std::string path_;
  const IsohfNetcdfModule& module_;
  std::unique_ptr<IsohfNetcdfFile, Close> file_;
  std::vector<IsohfNetcdfVariable> described_;
  mutable IsohfNetcdfMessage message_{};
};

class Netcdf4Source final : public HeightSource {
 public:
  Netcdf4Source(const std::string& path, const OpenOptions& options) {
    info_.path = path;
    info_.format = "netCDF-4";
    file_ = std::make_unique<Netcdf4File>(path);
    raster_ = read_cf(*file_, info_, options);
    bound_undeclared_voids(info_);
    read_files_beside(info_, 0);  // GDAL looks nowhere else for the meaning of a variable
    read_chunks();
    apply_open_options(info_, options);
    limit_buffers(kMostKeptBytes);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    const Window stored = raster_.from_south ? turned(window, info_.height) : window;
    const CfFile::Variable& variable = *raster_.variable;
    const std::size_t rank = variable.dimensions.size();
    std::vector<std::uint64_t> start(rank, 0);
    std::vector<std::uint64_t> count(rank, 1);
    const std::size_t row = raster_.by_columns ? rank - 1 : rank - 2;
    const std::size_t column = raster_.by_columns ? rank - 2 : rank - 1;
    start[row] = static_cast<std::uint64_t>(stored.row);
    count[row] = static_cast<std::uint64_t>(stored.rows);
    start[column] = static_cast<std::uint64_t>(stored.column);
    count[column] = static_cast<std::uint64_t>(stored.columns);
    const std::size_t size = size_bytes(info_.sample_type);
    if (raster_.by_columns) {
      buffer_.resize(samples.size());
      file_->read(variable, start, count, buffer_);
      const auto rows = static_cast<std::size_t>(window.rows);
      const auto columns = static_cast<std::size_t>(window.columns);
      for (std::size_t c = 0; c < columns; ++c) {
        for (std::size_t r = 0; r < rows; ++r) {
          std::memcpy(samples.data() + (r * columns + c) * size, buffer_.data() + (c * rows + r) * size, size);
        }
      }
    } else {
      file_->read(variable, start, count, samples);
    }
    if (raster_.from_south) turn_rows(samples, static_cast<std::size_t>(window.columns) * size);
    if (variable.type >= 10) widen_whole_numbers(info_.path, variable.type == 10, window, samples);
  }

  void limit_buffers(std::uint64_t bytes) override {
    if (row_of_chunks_bytes_ == 0) return;
    const std::uint64_t kept = buffer_bytes(bytes);
    file_->keep(*raster_.variable, kept, kept / chunk_bytes_);
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return std::min(2 * row_of_chunks_bytes_, std::max(limit, chunk_bytes_));
  }

 private:
  void read_chunks() {
    const IsohfNetcdfVariable& described = file_->described(*raster_.variable);
    const auto rank = static_cast<std::size_t>(described.rank);
    info_.block_width = info_.width;
    if (described.chunk[0] == 0) return;
    const double size = static_cast<double>(size_bytes(info_.sample_type));
    double bytes = size;
    for (std::size_t i = 0; i < rank; ++i) bytes *= static_cast<double>(described.chunk[i]);
    if (!(bytes <= static_cast<double>(kMostChunkBytes))) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: its chunks have {:.3g} bytes, at most {} are read (nccopy -c makes smaller ones)",
                              info_.path, bytes, kMostChunkBytes));
    }
    const auto rows = static_cast<std::int64_t>(described.chunk[raster_.by_columns ? rank - 1 : rank - 2]);
    const auto columns = static_cast<std::int64_t>(described.chunk[raster_.by_columns ? rank - 2 : rank - 1]);
    info_.block_height = std::clamp<std::int64_t>(rows, 1, info_.height);
    info_.block_width = std::clamp<std::int64_t>(columns, 1, info_.width);
    chunk_bytes_ = static_cast<std::uint64_t>(bytes);
    row_of_chunks_bytes_ =
        chunk_bytes_ * static_cast<std::uint64_t>((info_.width + info_.block_width - 1) / info_.block_width);
  }

  SourceInfo info_;
  std::unique_ptr<Netcdf4File> file_;
  CfRaster raster_;
  std::uint64_t chunk_bytes_ = 1;
  std::uint64_t row_of_chunks_bytes_ = 0;
  std::vector<std::byte> buffer_;
};

}  // namespace

bool looks_like_hdf5(std::span<const std::byte> head) {
  return text_of(head).starts_with("\x89HDF\r\n\x1a\n");
}

std::unique_ptr<HeightSource> open_netcdf4(const std::string& path, const OpenOptions& options) {
  return std::make_unique<Netcdf4Source>(path, options);
}

std::string netcdf_library() {
  try {
    return netcdf_module().library();
  } catch (const Error&) {
    return "the module isohf_netcdf.so, which is not there";
  }
}

}  // namespace isohf
