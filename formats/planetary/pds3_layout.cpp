#include "formats/planetary/pds3_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::int64_t kMostSamples = std::int64_t{1} << 31;
constexpr std::int64_t kMostBands = 65535;
constexpr std::int64_t kMostMarginBytes = std::int64_t{1} << 31;
constexpr double kMostBytes = 1125899906842624.0;  // 2^50

struct SampleKind {
  const char* name;
  char kind;  ///< i: signed, u: unsigned, f: IEEE float, v: VAX F-float, g: another VAX float
  bool big_endian;
};

// PDS Data Dictionary, SAMPLE_TYPE, with its synonyms.
constexpr std::array<SampleKind, 22> kSampleKinds = {{{"MSB_INTEGER", 'i', true},
                                                      {"INTEGER", 'i', true},
                                                      {"SUN_INTEGER", 'i', true},
                                                      {"MAC_INTEGER", 'i', true},
                                                      {"LSB_INTEGER", 'i', false},
                                                      {"PC_INTEGER", 'i', false},
                                                      {"VAX_INTEGER", 'i', false},
                                                      {"MSB_UNSIGNED_INTEGER", 'u', true},
                                                      {"UNSIGNED_INTEGER", 'u', true},
                                                      {"SUN_UNSIGNED_INTEGER", 'u', true},
                                                      {"MAC_UNSIGNED_INTEGER", 'u', true},
                                                      {"LSB_UNSIGNED_INTEGER", 'u', false},
                                                      {"PC_UNSIGNED_INTEGER", 'u', false},
                                                      {"VAX_UNSIGNED_INTEGER", 'u', false},
                                                      {"IEEE_REAL", 'f', true},
                                                      {"REAL", 'f', true},
                                                      {"FLOAT", 'f', true},
                                                      {"SUN_REAL", 'f', true},
                                                      {"MAC_REAL", 'f', true},
                                                      {"PC_REAL", 'f', false},
                                                      {"VAX_REAL", 'v', false},
                                                      {"VAXG_REAL", 'g', false}}};

SampleType sample_type(char kind, std::int64_t bits, const LabelFields& image) {
  if (kind == 'v') {
    if (bits == 32) return SampleType::kFloat32;
    image.refuse("SAMPLE_BITS", "32 for VAX floats");
  }
  if (kind == 'f') {
    if (bits == 32) return SampleType::kFloat32;
    if (bits == 64) return SampleType::kFloat64;
    image.refuse("SAMPLE_BITS", "32 or 64 for floats");
  }
  if (bits == 8) return kind == 'u' ? SampleType::kUint8 : SampleType::kInt8;
  if (bits == 16) return kind == 'u' ? SampleType::kUint16 : SampleType::kInt16;
  if (bits == 32) return kind == 'u' ? SampleType::kUint32 : SampleType::kInt32;
  image.refuse("SAMPLE_BITS", "8, 16 or 32 for integers");
}

void read_sample_type(const LabelFields& image, Pds3Layout& layout) {
  std::string type = image.word("SAMPLE_TYPE").value_or("");
  std::replace(type.begin(), type.end(), ' ', '_');
  const auto* const kind =
      std::find_if(kSampleKinds.begin(), kSampleKinds.end(), [&](const SampleKind& k) { return type == k.name; });
  if (kind == kSampleKinds.end() || kind->kind == 'g') {
    throw Error(ErrorCode::kUnsupported, fmt::format("{}: SAMPLE_TYPE is \"{}\"; MSB_, LSB_ and UNSIGNED integers, "
                                                     "IEEE_REAL, PC_REAL and VAX_REAL are read",
                                                     image.path(), type));
  }
  layout.type = sample_type(kind->kind, image.count("SAMPLE_BITS", 1, 64), image);
  layout.big_endian = kind->big_endian;
  layout.vax = kind->kind == 'v';
}

}  // namespace

Pds3Layout pds3_layout(const LabelFields& image) {
  const std::string coding = image.word("ENCODING_TYPE").value_or("N/A");
  if (coding != "N/A" && coding != "NONE") {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: ENCODING_TYPE is {}; only plain samples are read", image.path(), coding));
  }
  if (image.word("LINE_DISPLAY_DIRECTION").value_or("DOWN") != "DOWN") image.refuse("LINE_DISPLAY_DIRECTION", "DOWN");
  if (image.word("SAMPLE_DISPLAY_DIRECTION").value_or("RIGHT") != "RIGHT") {
    image.refuse("SAMPLE_DISPLAY_DIRECTION", "RIGHT");
  }
  Pds3Layout layout;
  read_sample_type(image, layout);
  layout.columns = image.count("LINE_SAMPLES", 1, kMostSamples);
  layout.rows = image.count("LINES", 1, kMostSamples);
  layout.bands = image.count("BANDS", 1, kMostBands, 1);
  const std::int64_t prefix = image.count("LINE_PREFIX_BYTES", 0, kMostMarginBytes, 0);
  const std::int64_t suffix = image.count("LINE_SUFFIX_BYTES", 0, kMostMarginBytes, 0);
  const auto size = static_cast<std::int64_t>(size_bytes(layout.type));
  const std::string order = image.word("BAND_STORAGE_TYPE").value_or("BAND_SEQUENTIAL");
  const bool by_sample = layout.bands > 1 && order == "SAMPLE_INTERLEAVED";
  const bool by_line = layout.bands > 1 && order == "LINE_INTERLEAVED";
  if (layout.bands > 1 && !by_sample && !by_line && order != "BAND_SEQUENTIAL") {
    image.refuse("BAND_STORAGE_TYPE", "BAND_SEQUENTIAL, LINE_INTERLEAVED or SAMPLE_INTERLEAVED");
  }
  // At most 2^50: the factors are bounded.
  const std::int64_t line = prefix + layout.columns * size * (by_sample ? layout.bands : 1) + suffix;
  const std::int64_t lines_of_a_row = by_sample ? 1 : layout.bands;
  const double total = static_cast<double>(line) * static_cast<double>(layout.rows * lines_of_a_row);
  if (!(total < kMostBytes)) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: {} x {} samples in {} bands need {:.3g} bytes, must be below 2^50", image.path(),
                            layout.columns, layout.rows, layout.bands, total));
  }
  layout.offset_bytes = static_cast<std::uint64_t>(prefix);
  layout.sample_stride_bytes = by_sample ? size * layout.bands : size;
  layout.line_stride_bytes = by_line ? line * layout.bands : line;
  layout.band_stride_bytes = by_sample ? size : by_line ? line : line * layout.rows;
  layout.total_bytes = static_cast<std::uint64_t>(line * layout.rows * lines_of_a_row);
  return layout;
}

}  // namespace isohf
