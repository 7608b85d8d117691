#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/metadata.h"

namespace isohf {

/// SHA-256 of any bytes.
[[nodiscard]] Digest sha256(std::span<const std::byte> bytes);
/// SHA-256 of bytes that come in parts.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  void add(std::span<const std::byte> bytes);
  [[nodiscard]] Digest finish();  ///< call once

 private:
  struct State;
  std::unique_ptr<State> state_;
};
/// Lower-case hexadecimal text of a digest.
[[nodiscard]] std::string hex(std::span<const std::byte> digest);

/// SHA-256 of one tile's elevations: kU16 as 16-bit little-endian codes, kU8 as bytes, kF32 as 32-bit floats with every
/// NaN written as 0x7FC00000; row by row, padding and voids included.
[[nodiscard]] Digest tile_content_digest(const TileCodes& tile);

/// metadata.content_sha256 and what says where on which ground it lies, as text (docs/archive_format.md, "Ground hash").
[[nodiscard]] std::string ground_hash(const Metadata& metadata);

/// The hash of a whole dataset's elevations and of what places them; independent of threads, codec and compression.
///
/// SHA-256 over, little-endian: u64 flat index and digest of each stored tile in flat order; then u32 C, u32 R, u32 Λ,
/// u64 tile columns, u64 tile rows, f64 extent x, f64 extent z, u8 code type (0 u16, 1 u8, 2 f32), f64 offset, f64
/// scale.
class ContentHash {
 public:
  /// Adds the next stored tile in flat order.
  void add_tile(std::int64_t flat, const Digest& digest);
  /// The hash as text; uses grid and quantisation of the metadata. Call once.
  [[nodiscard]] std::string finish(const Metadata& metadata);

 private:
  Sha256 hash_;
};

}  // namespace isohf
