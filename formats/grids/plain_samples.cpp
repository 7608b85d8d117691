#include "formats/grids/plain_samples.h"

#include <fmt/core.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>
#include <vector>

#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kMostFileBytes = 0x1p60;
/// What is read at once of samples that lie between others.
constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20U;

/// Copies `count` samples of kSize bytes, `from_step` and `to_step` bytes apart.
template <std::size_t kSize>
void copy_samples(const std::byte* from, std::size_t from_step, std::byte* to, std::size_t to_step, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * to_step, from + i * from_step, kSize);
}

void copy_samples(std::size_t size, const std::byte* from, std::size_t from_step, std::byte* to, std::size_t to_step,
                  std::size_t count) {
  switch (size) {
    case 1:
      return copy_samples<1>(from, from_step, to, to_step, count);
    case 2:
      return copy_samples<2>(from, from_step, to, to_step, count);
    case 4:
      return copy_samples<4>(from, from_step, to, to_step, count);
    default:
      return copy_samples<8>(from, from_step, to, to_step, count);
  }
}

template <typename Whole>
void widen(const std::string& path, const Window& window, std::span<std::byte> samples) {
  // 2^63 and 2^64 are not in the types' ranges, but what their largest numbers round to.
  constexpr double kEnd = std::numeric_limits<Whole>::is_signed ? 0x1p63 : 0x1p64;
  for (std::size_t at = 0; at < samples.size(); at += sizeof(Whole)) {
    Whole number{};
    std::memcpy(&number, samples.data() + at, sizeof number);
    const auto value = static_cast<double>(number);
    if (value >= kEnd || static_cast<Whole>(value) != number) {
      const auto index = static_cast<std::int64_t>(at / sizeof(Whole));
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("{}: sample ({}, {}) is {}, which float64 does not hold; store the samples as float64", path,
                      window.column + index % window.columns, window.row + index / window.columns, number));
    }
    std::memcpy(samples.data() + at, &value, sizeof value);
  }
}

}  // namespace

float float_from_vax(std::uint32_t stored) {
  const std::uint32_t bits = stored >> 16U | stored << 16U;
  const auto exponent = static_cast<int>(bits >> 23U & 0xFFU);
  const bool negative = bits >> 31U != 0;
  if (exponent == 0) return negative ? std::numeric_limits<float>::quiet_NaN() : 0.0F;
  const double magnitude = std::ldexp(static_cast<double>((bits & 0x7FFFFFU) | 0x800000U), exponent - 128 - 24);
  return static_cast<float>(negative ? -magnitude : magnitude);
}

void widen_whole_numbers(const std::string& path, bool is_signed, const Window& window, std::span<std::byte> samples) {
  return is_signed ? widen<std::int64_t>(path, window, samples) : widen<std::uint64_t>(path, window, samples);
}

void PlainLayout::take_band(const SourceInfo& info, BandOrder order, std::int64_t band, std::int64_t bands,
                            const std::string& header, std::uint64_t more_bytes) {
  const std::uint64_t size = size_bytes(info.sample_type);
  const auto at = static_cast<std::uint64_t>(band);
  const std::uint64_t together = order == BandOrder::kSamples ? static_cast<std::uint64_t>(bands) : 1;
  const double all = (static_cast<double>(info.width) * static_cast<double>(size) + static_cast<double>(more_bytes)) *
                     static_cast<double>(info.height) * static_cast<double>(bands);
  if (!(all < kMostFileBytes)) throw Error(ErrorCode::kCorrupt, header + ": says more samples than are in any file");
  const std::uint64_t line = static_cast<std::uint64_t>(info.width) * size * together + more_bytes;
  column_bytes = size * together;
  row_bytes = order == BandOrder::kLines ? line * static_cast<std::uint64_t>(bands) : line;
  offset_bytes += order == BandOrder::kSamples ? at * size
                  : order == BandOrder::kLines ? at * line
                                               : at * line * static_cast<std::uint64_t>(info.height);
}

double PlainLayout::end_bytes(const SourceInfo& info) const {
  const auto size = static_cast<double>(size_bytes(info.sample_type));
  const auto width = static_cast<double>(info.width);
  const double across = column_bytes == 0 ? size : static_cast<double>(column_bytes);
  const double down = row_bytes == 0 ? across * width : static_cast<double>(row_bytes);
  const double end =
      static_cast<double>(offset_bytes) + static_cast<double>(info.height - 1) * down + (width - 1.0) * across + size;
  return end < kMostFileBytes ? end : std::numeric_limits<double>::infinity();
}

void read_plain_samples(const RawFile& file, const SourceInfo& info, const PlainLayout& layout, const Window& window,
                        std::span<std::byte> samples) {
  const std::size_t size = size_bytes(info.sample_type);
  ISOHF_ASSERT(is_window_of(info, window, samples.size()));
  if (samples.empty()) return;
  const Window stored = layout.from_south ? turned(window, info.height) : window;
  const std::uint64_t across = layout.column_bytes == 0 ? size : layout.column_bytes;
  const std::uint64_t down = layout.row_bytes == 0 ? across * static_cast<std::uint64_t>(info.width) : layout.row_bytes;
  const std::uint64_t first = layout.offset_bytes + static_cast<std::uint64_t>(stored.row) * down +
                              static_cast<std::uint64_t>(stored.column) * across;
  const auto columns = static_cast<std::size_t>(window.columns);
  const auto rows = static_cast<std::size_t>(window.rows);
  const std::size_t run = columns * size;
  if (across == size && run == down) {  // whole rows lie together in the file as in the window
    file.read(first, samples);
  } else {
    // Along rows, or along columns where their samples are nearer to each other.
    const bool by_columns = down < across;
    const auto [lines, line_step, line_to] =
        by_columns ? std::tuple(columns, across, size) : std::tuple(rows, down, run);
    const auto [length, step, to] = by_columns ? std::tuple(rows, down, run) : std::tuple(columns, across, size);
    const auto most = static_cast<std::size_t>(std::max<std::uint64_t>(1, kPieceBytes / step));
    std::vector<std::byte> piece;
    for (std::size_t line = 0; line < lines; ++line) {
      for (std::size_t at = 0; at < length; at += most) {
        const std::size_t count = std::min(most, length - at);
        const std::uint64_t begin = first + line * line_step + at * step;
        std::byte* const out = samples.data() + line * line_to + at * to;
        if (step == size && to == size) {
          file.read(begin, {out, count * size});
        } else {
          piece.resize((count - 1) * step + size);
          file.read(begin, piece);
          copy_samples(size, piece.data(), step, out, to, count);
        }
      }
    }
  }
  if (layout.big_endian) swap_byte_order(samples, size);
  if (layout.from_south) turn_rows(samples, run);
  if (layout.stored_as == StoredAs::kVaxFloat) {
    for (std::size_t at = 0; at < samples.size(); at += sizeof(float)) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, samples.data() + at, sizeof bits);
      const float value = float_from_vax(bits);
      std::memcpy(samples.data() + at, &value, sizeof value);
    }
  } else if (layout.stored_as != StoredAs::kItself) {
    widen_whole_numbers(info.path, layout.stored_as == StoredAs::kInt64, window, samples);
  }
}

}  // namespace isohf
