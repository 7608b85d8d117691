#include <fmt/core.h>

#include <array>
#include <bit>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/grids/described_source.h"
#include "formats/io/text.h"
#include "formats/netcdf/cf_file.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

using Variable = CfFile::Variable;

/// The header of netCDF's classic formats (CDF-1, 2 and 5; "The NetCDF Classic Format Specification"), big-endian.
class ClassicHeader final : public CfFile {
 public:
  explicit ClassicHeader(const RawFile& file) : file_(file) {
    std::array<std::byte, 4> magic{};
    read(magic);
    version_ = static_cast<int>(magic[3]);
    if (version_ != 1 && version_ != 2 && version_ != 5) corrupt("is of an unknown version of netCDF");
    (void)size();  // of records
    list(10, [&] { dimensions.push_back({name(), size()}); });
    attributes = read_attributes();
    list(11, [&] {
      Variable variable;
      variable.name = name();
      const std::uint64_t count = items();
      for (std::uint64_t i = 0; i < count; ++i) {
        variable.dimensions.push_back(static_cast<std::size_t>(size()));
        if (variable.dimensions.back() >= dimensions.size()) corrupt("has a variable of a dimension that is not there");
      }
      variable.attributes = read_attributes();
      variable.type = static_cast<int>(word());
      (void)size();
      variable.begin = version_ == 1 ? word() : long_word();
      variables.push_back(std::move(variable));
    });
  }

  [[nodiscard]] std::vector<double> numbers(const Variable& variable, std::uint64_t first,
                                            std::uint64_t count) override {
    at_ = variable.begin + first * bytes_of(variable.type);
    return values(variable.type, count);
  }

 private:
  [[noreturn]] void corrupt(const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} (byte {})", file_.path(), what, at_));
  }
  void read(std::span<std::byte> bytes) {
    if (at_ > file_.size_bytes() || bytes.size() > file_.size_bytes() - at_) corrupt("its header ends early");
    file_.read(at_, bytes);
    at_ += bytes.size();
  }
  std::uint64_t integer(std::size_t bytes) {
    std::array<std::byte, 8> stored{};
    read(std::span(stored).first(bytes));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | static_cast<std::uint64_t>(stored[i]);
    return value;
  }
  std::uint64_t word() { return integer(4); }
  std::uint64_t long_word() { return integer(8); }
  std::uint64_t size() { return version_ == 5 ? long_word() : word(); }
  /// How many items follow, each of four bytes at least. No raster's header has so many: reading them would take minutes.
  std::uint64_t items() {
    static constexpr std::uint64_t kMost = 65536;
    const std::uint64_t count = size();
    if (count > std::min(kMost, file_.size_bytes() / 4)) corrupt(fmt::format("says that {} items follow", count));
    return count;
  }
  std::string name() {
    const std::uint64_t length = items();
    std::string text(static_cast<std::size_t>(length), '\0');
    read(std::as_writable_bytes(std::span(text)));
    at_ += (4 - length % 4) % 4;
    return text;
  }
  template <typename Item>
  void list(std::uint64_t tag, Item item) {
    const std::uint64_t found = word();
    const std::uint64_t count = items();
    if (found == 0 && count == 0) return;
    if (found != tag) corrupt(fmt::format("has a list of the kind {}, must be {}", found, tag));
    for (std::uint64_t i = 0; i < count; ++i) item();
  }
  [[nodiscard]] static std::uint64_t bytes_of(int type) {
    static constexpr std::array<std::uint64_t, 12> kBytes = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    return type >= 1 && type < static_cast<int>(kBytes.size()) ? kBytes[static_cast<std::size_t>(type)] : 0;
  }
  /// Big-endian numbers, of which the file must have as many.
  std::vector<double> values(int type, std::uint64_t count) {
    const auto size = static_cast<std::size_t>(bytes_of(type));
    if (size == 0 || at_ > file_.size_bytes() || count > (file_.size_bytes() - at_) / size) corrupt("ends early");
    std::vector<std::byte> stored(static_cast<std::size_t>(count) * size);
    read(stored);
    std::vector<double> numbers;
    numbers.reserve(static_cast<std::size_t>(count));
    for (std::size_t at = 0; at < stored.size(); at += size) {
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < size; ++i) bits = bits << 8U | static_cast<std::uint64_t>(stored[at + i]);
      const auto as_signed = static_cast<std::int64_t>(bits << (64 - 8 * size)) >> (64 - 8 * size);
      if (type == 5) {
        numbers.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
      } else if (type == 6) {
        numbers.push_back(std::bit_cast<double>(bits));
      } else {
        numbers.push_back(type >= 7 && type != 10 ? static_cast<double>(bits) : static_cast<double>(as_signed));
      }
    }
    return numbers;
  }
  Attributes read_attributes() {
    Attributes found;
    list(12, [&] {
      const std::string key = name();
      const auto type = static_cast<int>(word());
      if (bytes_of(type) == 0) corrupt(fmt::format("has values of the type {}", type));
      const std::uint64_t count = size();
      const std::uint64_t bytes = count * bytes_of(type);
      static constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20U;
      if (count > kMostBytes || bytes > std::min(kMostBytes, file_.size_bytes()))
        corrupt(fmt::format("has an attribute of {} values", count));
      const std::uint64_t end = at_ + bytes + (4 - bytes % 4) % 4;
      if (type == 2) {
        std::string text(static_cast<std::size_t>(count), '\0');
        read(std::as_writable_bytes(std::span(text)));
        found.emplace(key, trimmed(text));
      } else {
        found.emplace(key, values(type, count));
      }
      at_ = end;
    });
    return found;
  }

  const RawFile& file_;
  std::uint64_t at_ = 0;
  int version_ = 1;
};

class NetcdfSource final : public DescribedSource {
 public:
  NetcdfSource(const std::string& path, const OpenOptions& options) : DescribedSource(path, "netCDF", path, options) {
    ClassicHeader header(*file_);
    layout_.big_endian = true;
    if (header.variable("z") != nullptr && header.variable("x_range") && header.variable("dimension")) {
      refuse(
          ErrorCode::kUnsupported,
          fmt::format("this is a GMT grid from before CF; gmt grdconvert {} OUT.nc makes a netCDF file of it", path));
    }
    const CfRaster raster = read_cf(header, info_, options);
    layout_.offset_bytes = raster.variable->begin;
    layout_.from_south = raster.from_south;
    if (raster.by_columns) {
      layout_.row_bytes = size_bytes(info_.sample_type);
      layout_.column_bytes = layout_.row_bytes * static_cast<std::uint64_t>(info_.height);
    }
    if (raster.variable->type >= 10) {
      layout_.stored_as = raster.variable->type == 10 ? StoredAs::kInt64 : StoredAs::kUint64;
    }
    finish(options, 0);  // GDAL looks nowhere else for the meaning of a variable
  }
};

}  // namespace

bool looks_like_netcdf(std::span<const std::byte> head) {
  const std::string_view text = text_of(head);
  return text.size() > 4 && text.starts_with("CDF") && (text[3] == 1 || text[3] == 2 || text[3] == 5);
}

std::unique_ptr<HeightSource> open_netcdf(const std::string& path, const OpenOptions& options) {
  return std::make_unique<NetcdfSource>(path, options);
}

}  // namespace isohf
