#include "formats/png/packed_elevations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "isohf/error.h"

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

void describe_packing(Packing packing, std::size_t channels, int bits, SourceInfo& info) {
  const std::size_t least = packing == Packing::kRgbaFloat ? 4 : 3;
  if (channels < least || channels > 4 || bits != 8) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has {} channels of {} bits; encoding {} packs an elevation into {} of 8", info.path,
                            channels, bits, to_string(packing), least));
  }
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
  if (channels == 4) {
    info.void_values = {static_cast<double>(kVoid)};
    info.valid_min = static_cast<double>(kVoid) + 1.0;  // void whatever `void_values` say
  }
}

void place_web_tiles(int zoom, std::int64_t column, std::int64_t row, std::int64_t side, SourceInfo& info) {
  constexpr double kHalfMap = 20037508.342789244;  // metres: pi times WGS 84's semi-major axis
  Georeference& geo = info.georeference;
  geo.registration = Registration::kArea;
  geo.unit = HorizontalUnit::kMetre;
  geo.spacing_x = geo.spacing_y = std::ldexp(2.0 * kHalfMap, -zoom) / static_cast<double>(side);
  geo.has_origin = true;
  geo.origin_x = (static_cast<double>(column * side) + 0.5) * geo.spacing_x - kHalfMap;
  geo.origin_y = kHalfMap - (static_cast<double>(row * side) + 0.5) * geo.spacing_y;
  geo.system.name = "WGS 84 / Pseudo-Mercator";
  geo.system.epsg = 3857;
  geo.system.body = "Earth";
}

void place_web_tile(SourceInfo& info) {
  if (info.georeference.has_origin) return;
  std::filesystem::path name(info.path);
  std::array<std::int64_t, 3> numbers{};  // row, column, zoom
  for (std::int64_t& number : numbers) {
    const std::string text = name.stem().string();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || number < 0 || (end != text.data() + text.size() && *end != '@')) return;
    name = name.parent_path();
  }
  const auto [row, column, zoom] = numbers;
  if (zoom > kMostZoom || std::max(row, column) >> zoom != 0 || info.width != info.height) return;
  if (!std::has_single_bit(static_cast<std::uint64_t>(info.width))) {
    info.warnings.push_back(loss(fmt::format(
        "is called as a tile of a web map, but its {0} x {0} samples are no power of two, as where tiles have a rim of "
        "their neighbours': where it lies is left out",
        info.width)));
    return;
  }
  place_web_tiles(static_cast<int>(zoom), column, row, info.width, info);
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

void PackingEvidence::add_wide(std::span<const std::byte> row) {
  for (std::size_t at = 0; at + 2 * channels_ <= row.size(); at += 2 * channels_) {
    const auto channel = [&](std::size_t c) { return row.subspan(at + 2 * c, 2); };
    if (!std::ranges::equal(channel(0), channel(1)) || !std::ranges::equal(channel(0), channel(2))) ++differing_;
    ++pixels_;
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

std::optional<Packing> PackingEvidence::decide(const std::string& names, SourceInfo& info) const {
  if (const std::optional<Packing> found = packing()) {
    info.warnings.push_back(
        fmt::format("its colours are packed elevations, as their bytes show: decoded as with `encoding` {0}; give "
                    "`encoding` {0} to say so, or `channel` R for one channel alone",
                    to_string(*found)));
    return found;
  }
  if (!is_grey()) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("{}: is a colour picture with channels {}; say which one holds elevations (`channel` R), or "
                    "how they are packed into all (`encoding` terrarium, mapbox or rgba-float)",
                    info.path, names));
  }
  info.warnings.emplace_back("colour picture in greys: channel R is read");
  return std::nullopt;
}

}  // namespace isohf
