// The decoding half of kernels_bench.

#include <benchmark/benchmark.h>

#include <vector>

#include "bench/coded_tiles.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/residuals/pair_coding.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/simd/residual_expander.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"

namespace isohf::bench {
namespace {

void inflate(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)));
  std::vector<std::byte> out(of.payloads[0].size());
  for (auto _ : state) {
    inflate_exactly(of.encoded[0].deflated, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples(), of.type);
  state.SetLabel(to_string(of.type));
}
BENCHMARK(inflate)->Name("inflate")->DenseRange(0, 2);

void unpair(benchmark::State& state) {
  const std::vector<std::byte> pairs = pair_symbols(inside().least);
  std::vector<std::byte> out(inside().least.size());
  for (auto _ : state) {
    ByteReader reader(pairs);
    unpair_symbols(reader, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  set_samples(state, out.size());
}
BENCHMARK(unpair)->Name("symbols out of pairs");

void expand(benchmark::State& state) {
  std::vector<std::byte> symbols;
  const std::uint16_t* const sorted = inside().sorted.data();
  for (std::size_t i = 0; i < Inside::samples(); ++i) symbols.push_back(static_cast<std::byte>(symbol_of(sorted[i])));
  std::vector<std::byte> extra = inside().streams.extra;
  const std::size_t extra_bytes = extra.size();
  extra.resize(extra_bytes + kExpanderSlack);
  Scratch<std::uint16_t> zigzagged(Inside::samples());
  for (auto _ : state) {
    if (expand_residuals(symbols, std::span(extra).first(extra_bytes), 0, zigzagged.data()) == kNotExpanded) {
      state.SkipWithError("the extra bits do not fit the symbols");
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(expand)->Name("extra bits to symbols");

void decode_one(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)), static_cast<PayloadVersion>(state.range(1)));
  for (auto _ : state) {
    const TileCodes tile = decode_tile(kShape, of.type, of.payloads[0]);
    benchmark::DoNotOptimize(&tile);
  }
  set_samples(state, Inside::samples(), of.type);
  state.SetLabel(std::string(to_string(of.type)) + ", version " + std::to_string(state.range(1)));
}
BENCHMARK(decode_one)->Name("decode, one tile")->ArgsProduct({{0, 1, 2}, {1}})->ArgsProduct({{0, 1}, {2}});

void decode_all(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)), static_cast<PayloadVersion>(state.range(1)));
  std::vector<std::vector<std::byte>> payloads = of.payloads;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kTiles; ++i) inflate_exactly(of.encoded[i].deflated, payloads[i]);
    std::vector<TileCodes> tiles;
    for (const std::vector<std::byte>& payload : payloads) tiles.push_back(decode_tile(kShape, of.type, payload));
    benchmark::DoNotOptimize(tiles.data());
  }
  set_samples(state, kTiles * Inside::samples(), of.type);
  state.SetLabel(std::string(to_string(of.type)) + ", version " + std::to_string(state.range(1)));
}
BENCHMARK(decode_all)
    ->Name("inflate and decode, eight tiles")
    ->ArgsProduct({{0, 1, 2}, {1}})
    ->ArgsProduct({{0, 1}, {2}});

}  // namespace
}  // namespace isohf::bench
