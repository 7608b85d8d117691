#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "isohf/archive/tile/predict/sample_lattice.h"
#include "isohf/archive/tile/residuals/residual_streams.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"

/// What the kernels of the tile codec are measured on.
namespace isohf::bench {

inline const TileShape kShape = TileShape::make(212, 243, 4);
inline constexpr std::size_t kTiles = 8;

/// Hills with valleys and noise that grows with their slope: contexts differ, as on real terrain.
[[nodiscard]] std::vector<float> terrain(std::size_t tile);

/// Tiles of a sample type at every stage of their way.
struct Coded {
  Coded(CodeType of, PayloadVersion version);

  CodeType type;
  std::vector<TileCodes> tiles;
  std::vector<EncodedTile> encoded;
  std::vector<std::vector<std::byte>> payloads;
};

/// Of floats there is version 1 alone.
[[nodiscard]] const Coded& coded(CodeType type, PayloadVersion version = PayloadVersion::kFirst);

/// One tile of u16 inside the encoder.
struct Inside {
  Inside();
  static std::size_t samples() { return static_cast<std::size_t>(kShape.stored_vertex_count()); }

  Lattice<std::int32_t> lattice;
  Predictors predictors;
  Residuals<std::uint16_t> residuals;
  Scratch<std::uint16_t> sorted;
  std::vector<std::uint8_t> symbols;
  std::vector<std::uint32_t> histogram;
  std::vector<std::uint16_t> thresholds;
  PayloadHeader header;
  Streams streams;
  std::vector<std::byte> least;  ///< the symbols of the calmest context
};

[[nodiscard]] Inside& inside();

/// Says how many samples an iteration works for; their bytes are those of `type`.
void set_samples(benchmark::State& state, std::size_t samples, CodeType type = CodeType::kU16);

}  // namespace isohf::bench
