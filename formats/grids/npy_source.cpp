#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16U;
constexpr std::int64_t kMostNpySide = std::int64_t{1} << 31;

/// How NumPy calls the types of samples.
struct NpyType {
  std::string_view name;
  SampleType sample;
  StoredAs stored_as = StoredAs::kItself;
};
constexpr NpyType kTypes[] = {{"u1", SampleType::kUint8},
                              {"i1", SampleType::kInt8},
                              {"u2", SampleType::kUint16},
                              {"i2", SampleType::kInt16},
                              {"u4", SampleType::kUint32},
                              {"i4", SampleType::kInt32},
                              {"u8", SampleType::kFloat64, StoredAs::kUint64},
                              {"i8", SampleType::kFloat64, StoredAs::kInt64},
                              {"f2", SampleType::kFloat16},
                              {"f4", SampleType::kFloat32},
                              {"f8", SampleType::kFloat64}};

class NpySource final : public PlainSource {
 public:
  NpySource(const std::string& path, const OpenOptions& options) : PlainSource(path, "NumPy") {
    header_ = read_header();
    const std::string shape = read_shape();
    const bool by_columns = value_of("fortran_order").starts_with("True");
    if (!by_columns && !value_of("fortran_order").starts_with("False")) refuse_header("says no fortran_order");
    read_type();
    info_.block_width = info_.width;
    info_.block_height = by_columns ? std::min<std::int64_t>(info_.height, 256) : 1;
    if (by_columns) {
      layout_.row_bytes = size_bytes(info_.sample_type);
      layout_.column_bytes = static_cast<std::uint64_t>(info_.height) * layout_.row_bytes;
    }
    const double wanted = layout_.end_bytes(info_);
    const auto there = static_cast<double>(file_->size_bytes());
    if (there < wanted) {
      fail(ErrorCode::kCorrupt, fmt::format("ends early: {} bytes, an array of {} {} needs {:.0f}", there, shape,
                                            to_string(info_.sample_type), wanted));
    }
    if (there > wanted) info_.warnings.push_back(loss(fmt::format("{:.0f} bytes follow the array", there - wanted)));
    (void)choose_band(info_, options, 1);
    read_sidecars(info_, 1);
    apply_open_options(info_, options);
  }

 private:
  [[noreturn]] void refuse_header(const std::string& what) const {
    fail(ErrorCode::kCorrupt, "the array's header " + what);
  }

  /// The text of a Python dictionary: {'descr': '<i2', 'fortran_order': False, 'shape': (2, 3), }
  std::string read_header() {
    std::array<unsigned char, 12> start = {};
    file_->read(0, std::as_writable_bytes(std::span(start).first(10)));
    const unsigned version = start[6];
    if (version < 1 || version > 3) {
      fail(ErrorCode::kUnsupported, fmt::format("NumPy format {}, must be 1 to 3", version));
    }
    if (version > 1) file_->read(10, std::as_writable_bytes(std::span(start).subspan(10)));
    const std::size_t length = start[8] | start[9] << 8U | start[10] << 16U | std::size_t{start[11]} << 24U;
    if (length > kMostHeaderBytes) {
      refuse_header(fmt::format("has {} bytes, must be at most {}", length, kMostHeaderBytes));
    }
    std::string text(length, '\0');
    layout_.offset_bytes = (version > 1 ? 12U : 10U) + length;
    file_->read(layout_.offset_bytes - length, std::as_writable_bytes(std::span(text)));
    return text;
  }

  /// What follows a key of the header.
  [[nodiscard]] std::string_view value_of(const std::string& key) const {
    for (const char quote : {'\'', '"'}) {
      const std::string quoted = quote + key + quote;
      const std::size_t found = header_.find(quoted);
      if (found == header_.npos) continue;
      const std::size_t at = header_.find_first_not_of(" :", found + quoted.size());
      if (at != header_.npos) return std::string_view(header_).substr(at);
    }
    refuse_header(fmt::format("says no {}", key));
  }

  /// Width and height; dimensions of one element are none: (1, rows, columns) is a raster as well. Returns the shape.
  std::string read_shape() {
    const std::string_view text = value_of("shape");
    const std::size_t end = text.find(')');
    if (!text.starts_with('(') || end == text.npos) refuse_header("says no shape");
    const std::string shape(text.substr(0, end + 1));
    std::vector<std::int64_t> sides;
    for (const std::string& item : list_of(std::string_view(shape).substr(1, end - 1))) {
      if (item.empty()) continue;
      std::int64_t side = 0;
      const auto [at, error] = std::from_chars(item.data(), item.data() + item.size(), side);
      if (error != std::errc{} || at != item.data() + item.size()) refuse_header("has the shape " + printable(shape));
      sides.push_back(side);
    }
    while (sides.size() > 2 && std::ranges::find(sides, 1) != sides.end()) sides.erase(std::ranges::find(sides, 1));
    if (sides.size() != 2) {
      fail(ErrorCode::kUnsupported, fmt::format("the array's shape is {}, must have 2 dimensions", printable(shape)));
    }
    if (!std::ranges::all_of(sides, [](std::int64_t side) { return side >= 1 && side <= kMostNpySide; })) {
      fail(ErrorCode::kCorrupt, fmt::format("the array's shape is {}, must be from 1 to {}", shape, kMostNpySide));
    }
    info_.height = sides[0];
    info_.width = sides[1];
    return shape;
  }

  void read_type() {
    const std::string_view text = value_of("descr");
    const std::string_view quoted = text.substr(0, text.size() > 1 ? text.find(text[0], 1) : 0);
    const std::string_view name = quoted.substr(std::min<std::size_t>(2, quoted.size()));
    const char order = quoted.size() > 1 ? quoted[1] : '?';
    const NpyType* const type = std::ranges::find(kTypes, name, &NpyType::name);
    if (type == std::end(kTypes) || std::string_view("<>=|").find(order) == std::string_view::npos ||
        (order == '|' && size_bytes(type->sample) > 1)) {
      fail(ErrorCode::kUnsupported,
           fmt::format("the array's type is {}; integers of 8 to 64 bits and floats of 16 to 64 are read",
                       printable(text.substr(0, text.find_first_of(",}")))));
    }
    info_.sample_type = type->sample;
    layout_.stored_as = type->stored_as;
    layout_.big_endian = order == '>';
  }

  std::string header_;
};

bool looks_like_npy(std::span<const std::byte> head) {
  return text_of(head).starts_with(kNpyMagic);
}

std::unique_ptr<HeightSource> open_npy(const std::string& path, const OpenOptions& options) {
  return std::make_unique<NpySource>(path, options);
}

}  // namespace

const Format kNpyFormat = {.name = "NumPy", .extensions = {".npy"}, .open = open_npy, .recognises = looks_like_npy};

}  // namespace isohf
