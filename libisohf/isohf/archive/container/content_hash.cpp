#include "isohf/archive/container/content_hash.h"

#include <nettle/sha2.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "isohf/base/bytes.h"

namespace isohf {

struct Sha256::State {
  sha256_ctx context;
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  sha256_init(&state_->context);
}
Sha256::~Sha256() = default;

void Sha256::add(std::span<const std::byte> bytes) {
  sha256_update(&state_->context, bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()));
}

Digest Sha256::finish() {
  Digest digest;
  sha256_digest(&state_->context, digest.size(), reinterpret_cast<std::uint8_t*>(digest.data()));
  return digest;
}

Digest sha256(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.finish();
}

std::string hex(std::span<const std::byte> digest) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : digest) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    text += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

Digest tile_content_digest(const TileCodes& tile) {
  if (tile.type == CodeType::kU16) return sha256(std::as_bytes(std::span(tile.codes)));
  std::vector<std::byte> bytes;
  if (tile.type == CodeType::kU8) {
    bytes.reserve(tile.codes.size());
    for (const std::uint16_t code : tile.codes) bytes.push_back(static_cast<std::byte>(code & 0xFFU));
    return sha256(bytes);
  }
  bytes.resize(tile.heights.size() * sizeof(float));
  for (std::size_t i = 0; i < tile.heights.size(); ++i) {
    const float height = tile.heights[i];
    const std::uint32_t bits = std::isnan(height) ? 0x7FC00000U : std::bit_cast<std::uint32_t>(height);
    store_little(bytes.data() + i * sizeof(bits), bits);
  }
  return sha256(bytes);
}

void ContentHash::add_tile(std::int64_t flat, const Digest& digest) {
  std::array<std::byte, sizeof flat> index;
  store_little(index.data(), static_cast<std::uint64_t>(flat));
  hash_.add(index);
  hash_.add(digest);
}

std::string ContentHash::finish(const Metadata& metadata) {
  std::vector<std::byte> bytes;
  ByteWriter out(bytes);
  const TileGrid& grid = metadata.grid;
  out.write(static_cast<std::uint32_t>(grid.shape().columns()));
  out.write(static_cast<std::uint32_t>(grid.shape().rows()));
  out.write(static_cast<std::uint32_t>(grid.shape().levels()));
  out.write(static_cast<std::uint64_t>(grid.tile_columns()));
  out.write(static_cast<std::uint64_t>(grid.tile_rows()));
  out.write(grid.extent_x());
  out.write(grid.extent_z());
  out.write(static_cast<std::uint8_t>(metadata.quantisation.type));
  out.write(metadata.quantisation.offset);
  out.write(metadata.quantisation.scale);
  hash_.add(bytes);
  return hex(hash_.finish());
}

std::string ground_hash(const Metadata& metadata) {
  std::vector<std::byte> bytes;
  ByteWriter out(bytes);
  const auto text = [&](const std::string& value) {
    out.write(static_cast<std::uint32_t>(value.size()));
    out.write_bytes(std::as_bytes(std::span<const char>(value)));
  };
  const auto number = [&](const std::optional<double>& value) {
    out.write(static_cast<std::uint8_t>(value ? 1 : 0));
    out.write(value.value_or(0.0));
  };
  const auto code = [&](const std::optional<int>& value) { out.write(std::int32_t{value.value_or(0)}); };
  text(metadata.content_sha256);
  text(metadata.horizontal_unit);
  text(metadata.vertical_unit);
  out.write(static_cast<std::uint8_t>(metadata.wraps_x ? 1 : 0));
  out.write(static_cast<std::uint8_t>(metadata.projection ? 1 : 0));
  const SourceRecord& source = metadata.source;
  if (metadata.projection) {
    const ProjectionSpec& spec = metadata.projection->spec;
    text(to_string(spec.kind));
    for (const double value :
         {spec.ellipsoid.semi_major_axis_m, spec.ellipsoid.inverse_flattening, spec.longitude_0, spec.latitude_0,
          spec.parallel_1, spec.parallel_2, spec.scale_0, spec.false_easting, spec.false_northing}) {
      out.write(value);
    }
    out.write(std::int32_t{spec.utm_zone});
    if (spec.kind == ProjectionKind::kSystem) {
      text(spec.system.text);
      text(spec.system.operation);
      out.write(spec.system.metres_per_unit);
    }
    out.write(metadata.projection->origin.easting);
    out.write(metadata.projection->origin.northing);
  } else {
    for (const double value : {source.first_sample_x, source.first_sample_z, source.spacing_x, source.spacing_z}) {
      out.write(value);
    }
    number(source.origin_x);
    number(source.origin_y);
    out.write(source.crs_spacing_x);
    out.write(source.crs_spacing_y);
  }
  text(source.crs_unit);
  out.write(source.metres_per_unit);
  code(source.crs_epsg);
  text(source.crs_epsg ? "" : source.crs_wkt);
  text(source.body);
  number(source.semi_major_axis_m);
  number(source.inverse_flattening);
  text(source.vertical_datum);
  code(source.vertical_epsg);
  return hex(sha256(bytes));
}

}  // namespace isohf
