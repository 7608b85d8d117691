#include "formats/png/packed_elevations.h"

#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>

namespace isohf {
namespace {

constexpr std::array<const char*, 3> kNames = {"terrarium", "mapbox", "rgba-float"};
constexpr std::int32_t kVoid = -1;

std::int32_t at_i32(std::span<const std::byte> bytes, std::size_t i) {
  return std::to_integer<std::int32_t>(bytes[i]);
}

/// Whether four bytes are a float from 2^-10 to 2^15 in size, or 0.
bool is_a_height(std::span<const std::byte> bytes) {
  const std::int32_t exponent = (at_i32(bytes, 0) << 1 & 0xff) | at_i32(bytes, 1) >> 7;
  const bool is_zero = (at_i32(bytes, 0) & 0x7f) == 0 && at_i32(bytes, 1) == 0;
  return is_zero || (exponent >= 127 - 10 && exponent < 127 + 15);
}

}  // namespace

std::string to_string(Packing packing) {
  return kNames[static_cast<std::size_t>(packing)];
}

std::optional<Packing> packing_from_string(const std::string& text) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (text == kNames[i]) return static_cast<Packing>(i);
  }
  return std::nullopt;
}

void describe_packing(Packing packing, bool has_alpha, SourceInfo& info) {
  info.channel = to_string(packing);
  info.vertical_unit = "metre";
  info.void_values.clear();
  if (packing == Packing::kRgbaFloat) {
    info.sample_type = SampleType::kFloat32;
    return;
  }
  info.sample_type = SampleType::kInt32;
  info.z_scale = packing == Packing::kTerrarium ? 1.0 / 256.0 : 0.1;
  info.z_offset = packing == Packing::kTerrarium ? -32768.0 : -10000.0;
  if (has_alpha) info.void_values = {static_cast<double>(kVoid)};
}

void unpack_elevations(Packing packing, std::size_t channels, std::span<const std::byte> pixels,
                       std::span<std::byte> samples) {
  std::byte* out = samples.data();
  for (std::size_t at = 0; at + channels <= pixels.size(); at += channels, out += sizeof(std::int32_t)) {
    std::int32_t code = at_i32(pixels, at) << 16 | at_i32(pixels, at + 1) << 8 | at_i32(pixels, at + 2);
    if (packing == Packing::kRgbaFloat) {
      code = std::bit_cast<std::int32_t>(static_cast<std::uint32_t>(code) << 8U |
                                         std::to_integer<std::uint32_t>(pixels[at + 3]));
    } else if (channels == 4 && at_i32(pixels, at + 3) == 0) {
      code = kVoid;
    }
    std::memcpy(out, &code, sizeof(code));
  }
}

void PackingEvidence::add(std::span<const std::byte> row) {
  for (std::size_t at = 0; at + channels_ <= row.size(); at += channels_) {
    if (row[at] != row[at + 1] || row[at] != row[at + 2]) ++differing_;
    if (channels_ == 4) {
      alphas_.set(std::to_integer<std::size_t>(row[at + 3]));
      if (is_a_height(row.subspan(at, 4))) ++heights_;
    }
    red_ += at_i32(row, at);
    ++pixels_;
  }
  for (std::size_t at = channels_; at + channels_ <= row.size(); at += channels_) {
    std::int32_t code = 0;
    std::int32_t apart = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t step = at_i32(row, at + c) - at_i32(row, at + c - channels_);
      code = code * 256 + step;
      apart = apart * 256 + std::abs(step);
    }
    of_codes_ += std::abs(static_cast<double>(code));
    of_channels_ += apart;
  }
}

std::optional<Packing> PackingEvidence::packing() const {
  constexpr std::size_t kNoise = 16;
  if (pixels_ > 0 && heights_ == pixels_ && alphas_.count() >= kNoise) return Packing::kRgbaFloat;
  // In photographs the channels rise and fall together, and the two sums are nearly the same.
  if (pixels_ == 0 || of_channels_ == 0.0 || of_codes_ > 0.6 * of_channels_) return std::nullopt;
  const double red = static_cast<double>(red_) / static_cast<double>(pixels_);
  // Elevations of the Earth: -11000 to 9000 m are 85 to 163 in Terrarium, 0 to 2.9 in Mapbox.
  if (red >= 85.0 && red <= 163.0) return Packing::kTerrarium;
  if (red <= 3.0) return Packing::kMapbox;
  return std::nullopt;
}

}  // namespace isohf
