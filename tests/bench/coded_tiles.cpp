#include "bench/coded_tiles.h"

#include <cmath>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/predict/predictor_fit.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/residuals/residual_streams.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"

namespace isohf::bench {

std::vector<float> terrain(std::size_t tile) {
  std::vector<float> heights;
  std::uint32_t state = static_cast<std::uint32_t>(tile) + 1;
  for (int r = 0; r < kShape.rows(); ++r) {
    for (int c = 0; c < kShape.columns(); ++c) {
      const double x = c + 190.0 * static_cast<double>(tile);
      const double z = r;
      state = state * 1664525U + 1013904223U;
      const double noise =
          (static_cast<double>(state >> 16U) / 65536.0 - 0.5) * (1.0 + std::sin(x * 0.031 + z * 0.017));
      heights.push_back(static_cast<float>(900.0 + 400.0 * std::sin(x * 0.02) * std::cos(z * 0.017) +
                                           60.0 * std::sin(x * 0.13 + z * 0.09) + 12.0 * noise));
    }
  }
  return heights;
}

Coded::Coded(CodeType of, PayloadVersion version) : type(of) {
  const Quantisation quantisation{type, 0.0, type == CodeType::kU8 ? 6.0 : 0.5};
  for (std::size_t i = 0; i < kTiles; ++i) {
    quantise(quantisation, 0.0, terrain(i), tiles.emplace_back());
    encoded.push_back(encode_tile(kShape, tiles.back(), Effort::kDefault, version));
    payloads.emplace_back(encoded.back().payload_bytes);
    inflate_exactly(encoded.back().deflated, payloads.back());
  }
}

const Coded& coded(CodeType type, PayloadVersion version) {
  static const Coded first[] = {Coded(CodeType::kU16, PayloadVersion::kFirst),
                                Coded(CodeType::kU8, PayloadVersion::kFirst),
                                Coded(CodeType::kF32, PayloadVersion::kFirst)};
  static const Coded adaptive[] = {Coded(CodeType::kU16, PayloadVersion::kAdaptive),
                                   Coded(CodeType::kU8, PayloadVersion::kAdaptive)};
  return (version == PayloadVersion::kAdaptive ? adaptive : first)[static_cast<std::size_t>(type)];
}

Inside::Inside() : lattice(kShape), residuals(samples(), false), sorted(samples()) {
  const std::vector<std::uint16_t>& codes = coded(CodeType::kU16).tiles[0].codes;
  const auto columns = static_cast<std::size_t>(kShape.columns());
  lattice.fill_rows_above(codes[0]);
  for (int r = 0; r < kShape.rows(); ++r) {
    const std::size_t at = static_cast<std::size_t>(r) * columns;
    std::copy_n(codes.begin() + static_cast<std::ptrdiff_t>(at), columns, lattice.row(r));
    lattice.close_row(r);
  }
  predictors = fit_predictors<std::int32_t>(lattice, 0, 65534, coding_effort(Effort::kDefault).fit);
  std::vector<std::int32_t> halves(columns);
  std::vector<std::vector<std::uint8_t>> magnitudes(3, std::vector<std::uint8_t>(columns + 8));
  for (int r = 0; r < kShape.rows(); ++r) {
    const std::size_t at = static_cast<std::size_t>(r) * columns;
    predict_row<std::int32_t>(lattice, r, predictors, 0, 65534, halves);
    zigzag_row(lattice.row(r), halves.data(), kShape.columns(), residuals.zigzagged.data() + at);
    for (std::size_t c = 0; c < columns; ++c) magnitudes[0][c + 3] = magnitude(residuals.zigzagged.data()[at + c], 0);
    find_energies(magnitudes[1].data() + 3, magnitudes[2].data() + 3, 0, kShape.columns() - 1,
                  residuals.energies.data() + at);
    std::swap(magnitudes[2], magnitudes[1]);
    std::swap(magnitudes[1], magnitudes[0]);
  }
  for (std::size_t i = 0; i < samples(); ++i) {
    symbols.push_back(static_cast<std::uint8_t>(symbol_of(residuals.zigzagged.data()[i])));
  }
  histogram = count_energies({residuals.energies.data(), samples()});
  thresholds = choose_thresholds(symbols, {residuals.energies.data(), samples()}, histogram,
                                 coding_effort(Effort::kDefault).streams.context_thinning);
  streams = make_streams(residuals, coding_effort(Effort::kDefault).streams, header);
  const auto counts = sort_by_context(residuals, thresholds, histogram, sorted.data());
  least.assign(counts[0], std::byte{0});
  for (std::size_t i = 0; i < counts[0]; ++i) least[i] = static_cast<std::byte>(symbol_of(sorted.data()[i]));
}

Inside& inside() {
  static Inside made;
  return made;
}

namespace {

std::size_t sample_bytes(CodeType type) {
  return type == CodeType::kU16 ? 2 : type == CodeType::kU8 ? 1 : 4;
}

}  // namespace

void set_samples(benchmark::State& state, std::size_t samples, CodeType type) {
  state.SetBytesProcessed(static_cast<std::int64_t>(samples * sample_bytes(type)) * state.iterations());
  state.SetItemsProcessed(static_cast<std::int64_t>(samples) * state.iterations());
}

}  // namespace isohf::bench
