#include "formats/readers.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/georeference/raster_description.h"
#include "formats/grids/grid_header.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

struct TypeName {
  std::string_view name;
  SampleType type;
};

constexpr std::array<TypeName, 8> kRawTypes = {{
    {"u8", SampleType::kUint8},
    {"i8", SampleType::kInt8},
    {"u16", SampleType::kUint16},
    {"i16", SampleType::kInt16},
    {"u32", SampleType::kUint32},
    {"i32", SampleType::kInt32},
    {"f32", SampleType::kFloat32},
    {"f64", SampleType::kFloat64},
}};

[[noreturn]] void refuse_layout(std::string_view text) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("found '{}', must be WxH:TYPE as in 200x200:u16le: columns, rows, and u8, i8, or u16, i16, "
                          "u32, i32, f32, f64 with le or be for the byte order",
                          text));
}

/// Takes a whole number of at least 1 off the front of `text`.
bool take_count(std::string_view& text, std::int64_t& count) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc{} || count < 1) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool take(std::string_view& text, std::string_view front) {
  if (text.substr(0, front.size()) != front) return false;
  text.remove_prefix(front.size());
  return true;
}

/// "200x200:u16le" where `bytes` are the samples of a square, else an empty text.
std::string square(std::uint64_t bytes, std::string_view type, std::size_t sample_bytes) {
  if (bytes % sample_bytes != 0) return {};
  const std::uint64_t samples = bytes / sample_bytes;
  const auto side = static_cast<std::uint64_t>(std::llround(std::sqrt(static_cast<double>(samples))));
  return side * side == samples ? fmt::format("{}x{}:{}", side, side, type) : std::string();
}

[[noreturn]] void refuse_without_layout(const std::string& path) {
  const std::uint64_t bytes = RawFile(path).size_bytes();
  const std::string ending = lower_case(path.substr(std::min(path.find_last_of('.') + 1, path.size())));
  std::string example;
  if (ending == "r8") {
    example = square(bytes, "u8", 1);
  } else if (ending == "r32" || ending == "f32") {
    example = square(bytes, "f32le", 4);
  } else if (ending == "f64") {
    example = square(bytes, "f64le", 8);
  } else {
    example = square(bytes, "u16le", 2);
    if (example.empty() && ending == "raw") example = square(bytes, "u8", 1);
  }
  const std::string hint =
      example.empty() ? "as in `raw` 200x300:u16le" : fmt::format("its {} bytes would be `raw` {}", bytes, example);
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: raw samples have no header; `raw` WxH:TYPE must say what they are ({})", path, hint));
}

class RawSource final : public PlainSource {
 public:
  RawSource(const std::string& path, const RawLayout& layout, const RasterDescription* description,
            const OpenOptions& options)
      : PlainSource(path, "raw samples", options) {
    (void)choose_band(info_, options, 1);
    try {
      require_size("raw samples", layout.width, layout.height);
    } catch (const Error& error) {
      throw Error(description != nullptr ? ErrorCode::kCorrupt : error.code(), path + ": " + error.what());
    }
    info_.width = layout.width;
    info_.height = layout.height;
    info_.sample_type = layout.type;
    info_.block_width = layout.width;
    layout_.row_bytes = static_cast<std::uint64_t>(layout.width) * size_bytes(layout.type);
    layout_.big_endian = layout.big_endian;
    const std::uint64_t bytes = layout_.row_bytes * static_cast<std::uint64_t>(layout.height);
    if (bytes != file_->size_bytes()) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: the file has {} bytes, {} x {} samples of {} bytes take {}", path,
                              file_->size_bytes(), layout.width, layout.height, size_bytes(layout.type), bytes),
                  {path, fmt::format("{} bytes", file_->size_bytes()), fmt::format("{} bytes", bytes), ""});
    }
    if (description != nullptr) {
      description->describe(info_);
    } else {
      read_place_beside(info_, 1);
    }
    if (is_floating(layout.type)) {
      info_.valid_min = -kBeyondAnyHeight;
      info_.valid_max = kBeyondAnyHeight;
    }
    apply_open_options(info_, options);
    if (options.raw) warn_of_byte_order(*options.raw);
  }

 private:
  /// Ground is smooth in one byte order alone. Looks at some rows.
  void warn_of_byte_order(RawLayout layout) {
    if (is_floating(layout.type) || size_bytes(layout.type) == 1) return;
    constexpr std::int64_t kRows = 16;
    constexpr double kMuchSmoother = 8.0;
    const double as_given = roughness(kRows, false);
    if (!(as_given > kMuchSmoother * roughness(kRows, true))) return;
    const char* order = layout.big_endian ? "le" : "be";
    for (const TypeName& row : kRawTypes) {
      if (row.type != layout.type) continue;
      info_.warnings.emplace_back(
          fmt::format("the other byte order would be far smoother ground: perhaps the samples are `raw` {}x{}:{}{}",
                      layout.width, layout.height, row.name, order));
    }
  }

  /// The mean step from a sample to the next of its row, over the range of all; 0 of level ground, or of little.
  [[nodiscard]] double roughness(std::int64_t most_rows, bool is_swapped) const {
    const LoadSample load = load_sample(info_.sample_type);
    const std::size_t bytes = size_bytes(info_.sample_type);
    const std::int64_t rows = std::min(most_rows, info_.height);
    const std::int64_t columns = std::min<std::int64_t>(info_.width, 4096);
    if (rows * columns < 512) return 0.0;
    std::vector<std::byte> row(static_cast<std::size_t>(columns) * bytes);
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    double steps = 0.0;
    for (std::int64_t i = 0; i < rows; ++i) {
      read_plain_samples(*file_, info_, layout_, {0, info_.height * i / rows, columns, 1}, row);
      if (is_swapped) swap_byte_order(row, bytes);
      double before = load(row.data());
      for (std::size_t at = 0; at < row.size(); at += bytes) {
        const double sample = load(row.data() + at);
        steps += std::abs(sample - before);
        low = std::min(low, sample);
        high = std::max(high, sample);
        before = sample;
      }
    }
    return high > low ? steps / static_cast<double>(rows * columns) / (high - low) : 0.0;
  }
};

}  // namespace

RawLayout raw_layout_from_string(std::string_view text) {
  RawLayout layout;
  std::string_view rest = text;
  if (!take_count(rest, layout.width) || (!take(rest, "x") && !take(rest, "X")) || !take_count(rest, layout.height) ||
      !take(rest, ":")) {
    refuse_layout(text);
  }
  // f64 samples of this many are 2^62 bytes; no file has more.
  if (layout.width > (std::int64_t{1} << 59U) / layout.height) refuse_layout(text);
  for (const TypeName& row : kRawTypes) {
    if (!take(rest, row.name)) continue;
    layout.type = row.type;
    if (size_bytes(row.type) == 1 && rest.empty()) return layout;
    if (rest == "le" || rest == "be") {
      layout.big_endian = rest == "be";
      return layout;
    }
    break;
  }
  refuse_layout(text);
}

std::unique_ptr<HeightSource> open_raw(const std::string& path, const OpenOptions& options) {
  if (options.raw) return std::make_unique<RawSource>(path, *options.raw, nullptr, options);
  if (!has_raster_description(path)) refuse_without_layout(path);
  const RasterDescription description(path);
  return std::make_unique<RawSource>(path, description.layout(), &description, options);
}

}  // namespace isohf
