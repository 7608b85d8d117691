#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "formats/write/raster_encoder.h"
#include "formats/write/raster_sidecars.h"
#include "isohf/error.h"

namespace isohf {
namespace {

static_assert(std::endian::native == std::endian::little, "samples are written as they lie in memory");

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
  throw Error(ErrorCode::kInvalidArgument, fmt::format("{} stores one channel of {}, not {} of {}", format,
                                                       to_string(type), spec.channels, to_string(spec.sample_type)));
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

}  // namespace

std::unique_ptr<RasterEncoder> encode_r16(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kUint16, ".r16");
  return std::make_unique<PlainEncoder>(out, "", std::nullopt);
}

std::unique_ptr<RasterEncoder> encode_r32(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kFloat32, ".r32");
  return std::make_unique<PlainEncoder>(out, "", std::nullopt);
}

std::unique_ptr<RasterEncoder> encode_flt(OutputFile& out, const RasterSpec& spec) {
  require(spec, SampleType::kFloat32, "GridFloat");
  return std::make_unique<PlainEncoder>(out, "", static_cast<float>(grid_void(spec)));
}

std::unique_ptr<RasterEncoder> encode_npy(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<PlainEncoder>(out, npy_header(spec), std::nullopt);
}

}  // namespace isohf
