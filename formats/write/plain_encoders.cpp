#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <type_traits>
#include <vector>

#include "formats/write/encoders.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The samples, little-endian, behind a header that may be empty. NaN in a grid of floats becomes its void value.
class PlainEncoder final : public RasterEncoder {
 public:
  PlainEncoder(OutputFile& out, const std::string& header, std::optional<float> void_value)
      : out_(out), void_value_(void_value) {
    if (!header.empty()) out_.append(header);
  }

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    if (!void_value_) return out_.append(rows);
    samples_.resize(rows.size() / sizeof(float));
    std::memcpy(samples_.data(), rows.data(), rows.size());
    std::replace_if(
        samples_.begin(), samples_.end(), [](float z) { return std::isnan(z); }, *void_value_);
    out_.append(std::as_bytes(std::span(samples_)));
  }
  void close() override {}

 private:
  OutputFile& out_;
  std::optional<float> void_value_;
  std::vector<float> samples_;
};

void require(const RasterSpec& spec, SampleType type, const char* format) {
  if (spec.sample_type == type && spec.channels == 1) return;
  const bool has_floats = spec.sample_type == SampleType::kFloat32 && spec.channels == 1;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{} one channel of {}, not {} of {}{}", format, to_string(type), spec.channels,
                          to_string(spec.sample_type), has_floats ? "; .r32 does" : ""));
}

/// NumPy's header, version 1 (NEP 1): blanks fill it up to a multiple of 64 bytes.
std::string npy_header(const RasterSpec& spec) {
  const char kind = is_floating(spec.sample_type) ? 'f' : to_string(spec.sample_type).front();
  const std::size_t size = size_bytes(spec.sample_type);
  const std::string shape = spec.channels == 1 ? fmt::format("({}, {})", spec.height, spec.width)
                                               : fmt::format("({}, {}, {})", spec.height, spec.width, spec.channels);
  std::string text = fmt::format("{{'descr': '{}{}{}', 'fortran_order': False, 'shape': {}, }}", size == 1 ? '|' : '<',
                                 kind, size, shape);
  constexpr std::size_t kAlignment = 64;
  constexpr std::size_t kBefore = 10;
  text.resize((kBefore + text.size() + kAlignment) / kAlignment * kAlignment - kBefore - 1, ' ');
  text += '\n';
  std::string header = "\x93NUMPY\x01";
  header += '\0';
  header += static_cast<char>(text.size() & 0xFFU);
  header += static_cast<char>(text.size() >> 8U);
  return header + text;
}

/// An ESRI ASCII grid: a line a row, every number in the fewest digits that give it back.
class AscEncoder final : public RasterEncoder {
 public:
  AscEncoder(OutputFile& out, const RasterSpec& spec)
      : out_(out), type_(spec.sample_type), width_(static_cast<std::size_t>(spec.width)), void_(grid_void(spec)) {
    out_.append(ascii_grid_header(spec));
  }

  void write(std::span<const std::byte> rows, std::int64_t count) override {
    const std::size_t row_bytes = width_ * size_bytes(type_);
    for (std::int64_t row = 0; row < count; ++row) {
      line_.clear();
      append_row(rows.subspan(static_cast<std::size_t>(row) * row_bytes, row_bytes));
      line_.data()[line_.size() - 1] = '\n';  // in the last blank's place
      out_.append(std::string_view(line_.data(), line_.size()));
    }
  }
  void close() override {}

 private:
  void append_row(std::span<const std::byte> row) {
    with_stored_type(type_, [&](auto sample) { append<decltype(sample)>(row); });
  }

  template <typename T>
  void append(std::span<const std::byte> row) {
    for (std::size_t at = 0; at < row.size(); at += sizeof(T)) {
      // The sign makes an int of what would pass for a character.
      auto number = +number_of(stored_at<T>(row.data() + at));
      if constexpr (std::is_floating_point_v<decltype(number)>) {
        if (!std::isfinite(number)) number = static_cast<decltype(number)>(void_);
      }
      fmt::format_to(std::back_inserter(line_), "{} ", number);
    }
  }

  OutputFile& out_;
  SampleType type_;
  std::size_t width_;
  double void_;
  fmt::memory_buffer line_;
};

}  // namespace

std::unique_ptr<RasterEncoder> encode_r16(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kUint16, ".r16 and .raw store");
  return std::make_unique<PlainEncoder>(out, "", std::nullopt);
}

std::unique_ptr<RasterEncoder> encode_r32(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kFloat32, ".r32 stores");
  return std::make_unique<PlainEncoder>(out, "", std::nullopt);
}

std::unique_ptr<RasterEncoder> encode_flt(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kFloat32, "GridFloat stores");
  return std::make_unique<PlainEncoder>(out, "", static_cast<float>(grid_void(spec)));
}

std::unique_ptr<RasterEncoder> encode_npy(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<PlainEncoder>(out, npy_header(spec), std::nullopt);
}

std::unique_ptr<RasterEncoder> encode_asc(OutputFile& out, const RasterSpec& spec) {
  if (spec.channels != 1) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("an ASCII grid stores one channel, not {}", spec.channels));
  }
  return std::make_unique<AscEncoder>(out, spec);
}

}  // namespace isohf
