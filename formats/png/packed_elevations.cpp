#include "formats/png/packed_elevations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "formats/webtiles/tile_scheme.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"

namespace isohf {
namespace {

struct Encoding {
  const char* name;
  double scale;
  double offset;
  std::int32_t void_code;
};
constexpr std::int32_t kGsiVoid = -(1 << 23);
constexpr std::array<Encoding, 4> kTable = {{{"terrarium", 1.0 / 256.0, -32768.0, 0},
                                             {"mapbox", 0.1, -10000.0, 0},
                                             {"gsi", 0.01, 0.0, kGsiVoid},
                                             {"rgba-float", 1.0, 0.0, 0}}};

const Encoding& encoding_of(Packing packing) {
  return kTable[static_cast<std::size_t>(packing)];
}

}  // namespace

std::string to_string(Packing packing) {
  return encoding_of(packing).name;
}

std::optional<Packing> packing_from_string(const std::string& text) {
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    if (text == kTable[i].name) return static_cast<Packing>(i);
  }
  return std::nullopt;
}

std::optional<Packing> stated_packing(const OpenOptions& options) {
  const std::optional<Packing> packing = packing_from_string(options.encoding);
  if (packing || options.encoding.empty()) return packing;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("`encoding` is \"{}\", must be {}", options.encoding, kEncodings));
}

void describe_packing(Packing packing, std::size_t channels, int bits, const OpenOptions& options, SourceInfo& info) {
  const bool is_float = packing == Packing::kRgbaFloat;
  const bool has_opacity = channels % 2 == 0;
  if (bits != 8 || channels > 4 || (is_float && !has_opacity)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has {} channels of {} bits; encoding {} packs an elevation into {} of 8", info.path,
                            channels, bits, to_string(packing), is_float ? 4 : 3));
  }
  const Encoding& encoding = encoding_of(packing);
  info.channel = encoding.name;
  info.vertical_unit = "metre";
  info.void_values.clear();
  info.sample_type = is_float ? SampleType::kFloat32 : SampleType::kInt32;
  const bool states_interval = packing == Packing::kMapbox && options.z_scale && options.z_offset;
  info.z_scale = states_interval ? 1.0 : encoding.scale;
  info.z_offset = states_interval ? 0.0 : encoding.offset;
  if (is_float) return;
  info.void_values = {static_cast<double>(encoding.void_code)};
  if (has_opacity) info.valid_min = static_cast<double>(encoding.void_code) + 1.0;  // whatever `void_values` say
}

void unpack_elevations(Packing packing, std::size_t channels, std::span<const std::byte> pixels,
                       std::span<std::byte> samples) {
  const std::size_t next = channels < 3 ? 0 : 1;  // from red to green and from green to blue
  const bool has_opacity = channels % 2 == 0;
  const bool is_float = packing == Packing::kRgbaFloat;
  const auto void_code = static_cast<std::uint32_t>(encoding_of(packing).void_code);
  const std::uint32_t sign = packing == Packing::kGsi ? 1U << 23U : 0U;
  std::byte* out = samples.data();
  for (std::size_t at = 0; at + channels <= pixels.size(); at += channels, out += sizeof(std::uint32_t)) {
    const auto channel = [&](std::size_t i) { return std::to_integer<std::uint32_t>(pixels[at + i]); };
    const std::uint32_t opacity = has_opacity ? channel(channels - 1) : 255U;
    std::uint32_t code = channel(0) << 16U | channel(next) << 8U | channel(2 * next);
    code = is_float ? code << 8U | opacity : opacity == 0 ? void_code : (code ^ sign) - sign;
    std::memcpy(out, &code, sizeof(code));
  }
}

void place_web_tiles(int zoom, std::int64_t column, std::int64_t row, std::int64_t side, SourceInfo& info) {
  constexpr double kHalfMap = 20037508.342789244;  // metres: pi times WGS 84's semi-major axis
  Georeference& geo = info.georeference;
  geo.registration = Registration::kArea;
  geo.spacing_x = geo.spacing_y = std::ldexp(2.0 * kHalfMap, -zoom) / static_cast<double>(side);
  geo.has_origin = true;
  geo.origin_x = (static_cast<double>(column * side) + 0.5) * geo.spacing_x - kHalfMap;
  geo.origin_y = kHalfMap - (static_cast<double>(row * side) + 0.5) * geo.spacing_y;
  take_system("EPSG:3857", info);
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
    info.warnings.push_back(loss(
        fmt::format("is named like a tile of a web map, but its {0} x {0} samples are not a power of two, as if it had "
                    "a rim of its neighbours': its position is left out",
                    info.width)));
    return;
  }
  const TileScheme scheme = tile_scheme_of(name);
  if (scheme == TileScheme::kOtherMap) {
    info.warnings.push_back(loss("is a tile of another map than Web Mercator: its position is left out"));
    return;
  }
  const std::int64_t from_north = scheme == TileScheme::kFromSouth ? (std::int64_t{1} << zoom) - 1 - row : row;
  place_web_tiles(static_cast<int>(zoom), column, from_north, info.width, info);
}

}  // namespace isohf
