#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <type_traits>

#include "formats/write/raster_encoder.h"
#include "formats/write/raster_sidecars.h"
#include "isohf/error.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

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

std::unique_ptr<RasterEncoder> encode_asc(OutputFile& out, const RasterSpec& spec) {
  if (spec.channels != 1) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("an ASCII grid stores one channel, not {}", spec.channels));
  }
  return std::make_unique<AscEncoder>(out, spec);
}

}  // namespace isohf
