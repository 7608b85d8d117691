#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/raster_description.h"
#include "formats/georeference/sidecars.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/sample.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// "u8", "i16", ...: as samples are called in a layout, without their byte order.
std::string short_name(SampleType type) {
  const char kind = is_floating(type) ? 'f' : to_string(type).front();
  return fmt::format("{}{}", kind, 8 * size_bytes(type));
}

std::string layout_text(const RawLayout& layout) {
  const char* const order = size_bytes(layout.type) == 1 ? "" : layout.big_endian ? "be" : "le";
  return fmt::format("{}x{}:{}{}", layout.width, layout.height, short_name(layout.type), order);
}

/// Suggests a layout if the samples make a square.
[[noreturn]] void refuse_without_layout(const std::string& path) {
  using enum SampleType;
  const std::string ending = extension_of(path);
  const auto bytes = static_cast<std::int64_t>(RawFile(path).size_bytes());
  std::vector<SampleType> types = {kUint16};
  if (ending == ".r8") types = {kUint8};
  if (ending == ".raw") types = {kUint16, kUint8};
  if (ending == ".r32" || ending == ".f32") types = {kFloat32};
  if (ending == ".f64") types = {kFloat64};
  std::string hint = "as in `raw` 200x300:u16le";
  for (const SampleType type : types) {
    const auto size = static_cast<std::int64_t>(size_bytes(type));
    const std::int64_t side = std::llround(std::sqrt(static_cast<double>(bytes / size)));
    if (side * side * size != bytes) continue;
    hint = fmt::format("its {} bytes would be `raw` {}", bytes, layout_text({side, side, type, false}));
    break;
  }
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: raw samples have no header; `raw` WxH:TYPE must say what they are ({})", path, hint));
}

class RawSource final : public PlainSource {
 public:
  RawSource(const std::string& path, const RawLayout& layout, const RasterDescription* description,
            const OpenOptions& options)
      : PlainSource(path, "raw samples") {
    (void)choose_band(info_, options, 1);
    try {
      require_size("raw samples", layout.width, layout.height);
    } catch (const Error& error) {
      fail(description != nullptr ? ErrorCode::kCorrupt : error.code(), error.what());
    }
    info_.width = layout.width;
    info_.height = layout.height;
    info_.sample_type = layout.type;
    info_.block_width = layout.width;
    layout_.big_endian = layout.big_endian;
    const double bytes = layout_.end_bytes(info_);
    if (bytes != static_cast<double>(file_->size_bytes())) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: the file has {} bytes, {} x {} samples of {} bytes take {:.0f}", path,
                              file_->size_bytes(), layout.width, layout.height, size_bytes(layout.type), bytes),
                  {path, fmt::format("{} bytes", file_->size_bytes()), fmt::format("{:.0f} bytes", bytes), ""});
    }
    if (description != nullptr) {
      description->describe(info_);
    } else {
      read_sidecars(info_, 1);
    }
    bound_undeclared_voids(info_);
    apply_open_options(info_, options);
    if (options.raw) warn_of_byte_order(*options.raw);
  }

 private:
  /// Terrain is smooth in one byte order alone. Looks at some rows.
  void warn_of_byte_order(RawLayout layout) {
    if (is_floating(layout.type) || size_bytes(layout.type) == 1) return;
    constexpr double kMuchSmoother = 8.0;
    const double as_given = roughness();
    layout_.big_endian = !layout.big_endian;
    const double swapped = roughness();
    layout_.big_endian = layout.big_endian;
    if (as_given <= kMuchSmoother * swapped) return;
    layout.big_endian = !layout.big_endian;
    info_.warnings.emplace_back("the other byte order would be far smoother ground: perhaps the samples are `raw` " +
                                layout_text(layout));
  }

  /// The mean step from a sample to the next of its row, over the range of all; 0 for level ground, or too little of it.
  [[nodiscard]] double roughness() {
    const LoadSample load = load_sample(info_.sample_type);
    const std::size_t bytes = size_bytes(info_.sample_type);
    const std::int64_t rows = std::min<std::int64_t>(16, info_.height);
    const std::int64_t columns = std::min<std::int64_t>(info_.width, 4096);
    std::vector<std::byte> row(static_cast<std::size_t>(columns) * bytes);
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    double steps = 0.0;
    for (std::int64_t i = 0; i < rows; ++i) {
      read_window({0, info_.height * i / rows, columns, 1}, row);
      double before = load(row.data());
      for (std::size_t at = 0; at < row.size(); at += bytes) {
        const double sample = load(row.data() + at);
        steps += std::abs(sample - before);
        low = std::min(low, sample);
        high = std::max(high, sample);
        before = sample;
      }
    }
    return high > low && rows * columns >= 512 ? steps / static_cast<double>(rows * columns) / (high - low) : 0.0;
  }
};

std::unique_ptr<HeightSource> open_raw(const std::string& path, const OpenOptions& options) {
  if (options.raw) return std::make_unique<RawSource>(path, *options.raw, nullptr, options);
  if (!has_raster_description(path)) refuse_without_layout(path);
  const RasterDescription description(path);
  return std::make_unique<RawSource>(path, description.layout(), &description, options);
}

}  // namespace

const Format kRawFormat = {.name = "raw samples",
                           .extensions = {".r8", ".r16", ".r32", ".f32", ".f64", ".raw"},
                           .note = "needs `raw`, or isohf's .json beside",
                           .open = open_raw,
                           .goes_by_name = true};

RawLayout raw_layout_from_string(std::string_view text) {
  using enum SampleType;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto take_count = [&](std::int64_t& count, std::string_view separators) {
    const auto [stop, error] = std::from_chars(at, end, count);
    if (error != std::errc{} || count < 1 || stop == end || separators.find(*stop) == separators.npos) return false;
    at = stop + 1;
    return true;
  };
  RawLayout layout;
  // float64 samples of 2^59 are 2^62 bytes; no file has more.
  if (take_count(layout.width, "xX") && take_count(layout.height, ":") &&
      layout.width <= (std::int64_t{1} << 59U) / layout.height) {
    for (const SampleType type : {kUint8, kInt8, kUint16, kInt16, kUint32, kInt32, kFloat32, kFloat64}) {
      for (const bool big_endian : {false, true}) {
        layout.type = type;
        layout.big_endian = big_endian && size_bytes(type) > 1;
        if (layout_text(layout).ends_with(':' + std::string(at, end))) return layout;
      }
    }
  }
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("found '{}', must be WxH:TYPE as in 200x200:u16le: columns, rows, and u8, i8, or u16, i16, "
                          "u32, i32, f32, f64 with le or be for the byte order",
                          text));
}

}  // namespace isohf
