// Bandwidth of the tile codec's kernels on one tile of terrain, each beside memcpy and libdeflate in the same run.
// Bytes are those of the samples that a kernel works for, whatever it reads and writes: 2 of u16, 1 of u8, 4 of f32. So
// all figures of a type compare. scripts/bench kernels makes a table of it. usage: kernels_bench [--benchmark_...]

#include <benchmark/benchmark.h>
#include <libdeflate.h>
#include <malloc.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "isohf/archive/activities.h"
#include "isohf/archive/coding_effort.h"
#include "isohf/archive/content_hash.h"
#include "isohf/archive/context_model.h"
#include "isohf/archive/deflate.h"
#include "isohf/archive/deflate_writer.h"
#include "isohf/archive/hex_predictor.h"
#include "isohf/archive/lane_decoder.h"
#include "isohf/archive/pair_coding.h"
#include "isohf/archive/predictor_fit.h"
#include "isohf/archive/quantise.h"
#include "isohf/archive/residual_expander.h"
#include "isohf/archive/residual_fold.h"
#include "isohf/archive/residual_streams.h"
#include "isohf/archive/residual_symbols.h"
#include "isohf/surface/height_source.h"

namespace {

using namespace isohf;

const TileShape kShape = TileShape::make(212, 243, 4);
constexpr std::size_t kTiles = kDecoderLanes;

/// Hills with valleys and noise that grows with their slope: contexts differ, as on real terrain.
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

/// Tiles of a sample type at every stage of their way.
struct Coded {
  explicit Coded(CodeType of) : type(of) {
    const Quantisation quantisation{type, 0.0, type == CodeType::kU8 ? 6.0 : 0.5};
    for (std::size_t i = 0; i < kTiles; ++i) {
      quantise(quantisation, 0.0, terrain(i), tiles.emplace_back());
      encoded.push_back(encode_tile(kShape, tiles.back()));
      payloads.emplace_back(encoded.back().payload_bytes);
      inflate_exactly(encoded.back().deflated, payloads.back());
    }
  }
  CodeType type;
  std::vector<TileCodes> tiles;
  std::vector<EncodedTile> encoded;
  std::vector<std::vector<std::byte>> payloads;
};

const Coded& coded(CodeType type) {
  static const Coded u16(CodeType::kU16);
  static const Coded u8(CodeType::kU8);
  static const Coded f32(CodeType::kF32);
  return type == CodeType::kU16 ? u16 : type == CodeType::kU8 ? u8 : f32;
}

std::size_t sample_bytes(CodeType type) {
  return type == CodeType::kU16 ? 2 : type == CodeType::kU8 ? 1 : 4;
}

/// One tile of u16 inside the encoder.
struct Inside {
  Inside() : lattice(kShape), residuals(samples(), false), sorted(samples()) {
    const std::vector<std::uint16_t>& codes = coded(CodeType::kU16).tiles[0].codes;
    const auto columns = static_cast<std::size_t>(kShape.columns());
    lattice.fill_rows_above(codes[0]);
    for (int r = 0; r < kShape.rows(); ++r) {
      const std::size_t at = static_cast<std::size_t>(r) * columns;
      std::copy_n(codes.begin() + static_cast<std::ptrdiff_t>(at), columns, lattice.row(r));
      lattice.close_row(r);
    }
    predictors = fit_predictors<std::int32_t>(lattice, 0, 65534, coding_effort(kDefaultLevel).fit);
    std::vector<std::int32_t> halves(columns);
    std::vector<std::vector<std::uint8_t>> magnitudes(3, std::vector<std::uint8_t>(columns + 8));
    for (int r = 0; r < kShape.rows(); ++r) {
      const std::size_t at = static_cast<std::size_t>(r) * columns;
      predict_row<std::int32_t>(lattice, r, predictors, 0, 65534, halves);
      fold_row(lattice.row(r), halves.data(), kShape.columns(), residuals.folded.data() + at);
      for (std::size_t c = 0; c < columns; ++c) magnitudes[0][c + 3] = magnitude(residuals.folded.data()[at + c], 0);
      find_activities(magnitudes[1].data() + 3, magnitudes[2].data() + 3, 0, kShape.columns() - 1,
                      residuals.activities.data() + at);
      std::swap(magnitudes[2], magnitudes[1]);
      std::swap(magnitudes[1], magnitudes[0]);
    }
    for (std::size_t i = 0; i < samples(); ++i) {
      symbols.push_back(static_cast<std::uint8_t>(symbol_of(residuals.folded.data()[i])));
    }
    histogram = count_activities({residuals.activities.data(), samples()});
    thresholds = choose_thresholds(symbols, {residuals.activities.data(), samples()}, histogram,
                                   coding_effort(kDefaultLevel).context_thinning);
    streams = make_streams(residuals, coding_effort(kDefaultLevel), header);
    const auto counts = sort_by_context(residuals, thresholds, histogram, sorted.data());
    least.assign(counts[0], std::byte{0});
    for (std::size_t i = 0; i < counts[0]; ++i) least[i] = static_cast<std::byte>(symbol_of(sorted.data()[i]));
  }
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

Inside& inside() {
  static Inside made;
  return made;
}

void set_samples(benchmark::State& state, std::size_t samples, CodeType type = CodeType::kU16) {
  state.SetBytesProcessed(static_cast<std::int64_t>(samples * sample_bytes(type)) * state.iterations());
  state.SetItemsProcessed(static_cast<std::int64_t>(samples) * state.iterations());
}

// --- what all are measured against ---

void copy_samples(benchmark::State& state) {
  const std::vector<std::uint16_t>& from = coded(CodeType::kU16).tiles[0].codes;
  std::vector<std::uint16_t> to(from.size());
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), 2 * to.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  set_samples(state, to.size());
}
BENCHMARK(copy_samples)->Name("memcpy");

void libdeflate_payload(benchmark::State& state) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(static_cast<int>(state.range(0))), libdeflate_free_compressor);
  const std::vector<std::byte>& from = coded(CodeType::kU16).payloads[0];
  std::vector<std::byte> out(libdeflate_deflate_compress_bound(compressor.get(), from.size()));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        libdeflate_deflate_compress(compressor.get(), from.data(), from.size(), out.data(), out.size()));
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(libdeflate_payload)->Name("libdeflate, the payload, level")->Arg(1)->Arg(6)->Arg(12);

void libdeflate_inflate(benchmark::State& state) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  const EncodedTile& tile = coded(CodeType::kU16).encoded[0];
  std::vector<std::byte> out(tile.payload_bytes);
  for (auto _ : state) {
    benchmark::DoNotOptimize(libdeflate_deflate_decompress(decompressor.get(), tile.deflated.data(),
                                                           tile.deflated.size(), out.data(), out.size(), nullptr));
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(libdeflate_inflate)->Name("libdeflate, inflating the tile");

// --- encoder ---

void convert_samples(benchmark::State& state) {
  SourceInfo info;
  info.sample_type = SampleType::kInt16;
  if (state.range(0) != 0) info.void_values = {-32768.0};
  const auto raw = std::as_bytes(std::span(coded(CodeType::kU16).tiles[0].codes));
  std::vector<float> heights(raw.size() / 2);
  for (auto _ : state) {
    heights_from_samples(info, 0.0, raw, heights);
    benchmark::DoNotOptimize(heights.data());
    benchmark::ClobberMemory();
  }
  set_samples(state, heights.size());
}
BENCHMARK(convert_samples)->Name("heights from samples, void values")->Arg(0)->Arg(1);

void quantise_heights(benchmark::State& state) {
  const auto type = static_cast<CodeType>(state.range(0));
  const std::vector<float> heights = terrain(0);
  TileCodes codes;
  for (auto _ : state) benchmark::DoNotOptimize(quantise({type, 0.0, 0.5}, 0.0, heights, codes));
  set_samples(state, heights.size(), type);
  state.SetLabel(to_string(type));
}
BENCHMARK(quantise_heights)
    ->Name("quantise")
    ->Arg(static_cast<int>(CodeType::kU16))
    ->Arg(static_cast<int>(CodeType::kF32));

void fit(benchmark::State& state) {
  const FitEffort effort = coding_effort(static_cast<int>(state.range(0))).fit;
  for (auto _ : state) {
    benchmark::DoNotOptimize(fit_predictors<std::int32_t>(inside().lattice, 0, 65534, effort).weights.data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(fit)->Name("fit (normal equations), level")->Arg(2)->Arg(kDefaultLevel)->Arg(8);

void predict(benchmark::State& state) {
  std::vector<std::int32_t> halves(static_cast<std::size_t>(kShape.columns()));
  for (auto _ : state) {
    for (int r = 0; r < kShape.rows(); ++r) {
      predict_row<std::int32_t>(inside().lattice, r, inside().predictors, 0, 65534, halves);
      benchmark::DoNotOptimize(halves.data());
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(predict);

void fold(benchmark::State& state) {
  std::vector<std::int32_t> halves(static_cast<std::size_t>(kShape.columns()), 1801);
  std::vector<std::uint16_t> folded(halves.size());
  for (auto _ : state) {
    for (int r = 0; r < kShape.rows(); ++r) {
      fold_row(inside().lattice.row(r), halves.data(), kShape.columns(), folded.data());
      benchmark::DoNotOptimize(folded.data());
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(fold);

void activities(benchmark::State& state) {
  const auto columns = static_cast<std::size_t>(kShape.columns());
  std::vector<std::uint8_t> magnitudes(columns + 8, 7);
  std::vector<std::uint16_t> out(columns);
  for (auto _ : state) {
    for (int r = 0; r < kShape.rows(); ++r) {
      find_activities(magnitudes.data() + 3, magnitudes.data() + 3, 0, kShape.columns() - 1, out.data());
      benchmark::DoNotOptimize(out.data());
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(activities);

void contexts(benchmark::State& state) {
  const std::span<const std::uint16_t> of(inside().residuals.activities.data(), Inside::samples());
  for (auto _ : state) {
    const std::vector<std::uint32_t> histogram = count_activities(of);
    benchmark::DoNotOptimize(
        choose_thresholds(inside().symbols, of, histogram, coding_effort(kDefaultLevel).context_thinning).data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(contexts);

void sort_residuals(benchmark::State& state) {
  Scratch<std::uint16_t> sorted(Inside::samples());
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        sort_by_context(inside().residuals, inside().thresholds, inside().histogram, sorted.data()).data());
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(sort_residuals)->Name("sort into streams");

void streams(benchmark::State& state) {
  for (auto _ : state) {
    PayloadHeader header;
    benchmark::DoNotOptimize(make_streams(inside().residuals, coding_effort(kDefaultLevel), header).extra.data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(streams)->Name("streams: contexts, sort, symbols, extra bits, pairs");

void pair(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(pair_symbols(inside().least).data());
  set_samples(state, inside().least.size());
}
BENCHMARK(pair)->Name("pairs of symbols");

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

void huffman(benchmark::State& state) {
  std::vector<std::byte> out;
  for (auto _ : state) {
    out.clear();
    DeflateWriter writer(out);
    for (const auto& symbols : inside().streams.symbols) writer.add(symbols);
    writer.add(inside().streams.extra);
    writer.finish();
    benchmark::DoNotOptimize(out.data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(huffman)->Name("Huffman and runs");

void digest(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(tile_content_digest(coded(CodeType::kU16).tiles[0]).data());
  set_samples(state, Inside::samples());
}
BENCHMARK(digest)->Name("digest (SHA-256)");

void payload_crc(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(crc32(coded(CodeType::kU16).payloads[0]));
  set_samples(state, Inside::samples());
}
BENCHMARK(payload_crc)->Name("CRC-32 of the payload");

void encode(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(encode_tile(kShape, of.tiles[0]).deflated.data());
  set_samples(state, Inside::samples(), of.type);
  state.SetLabel(to_string(of.type));
}
BENCHMARK(encode)->Name("encode")->DenseRange(0, 2);

// --- decoder ---

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
BENCHMARK(unpair)->Name("symbols out of pairs");

void expand(benchmark::State& state) {
  std::vector<std::byte> symbols;
  const std::uint16_t* const sorted = inside().sorted.data();
  for (std::size_t i = 0; i < Inside::samples(); ++i) symbols.push_back(static_cast<std::byte>(symbol_of(sorted[i])));
  std::vector<std::byte> extra = inside().streams.extra;
  const std::size_t extra_bytes = extra.size();
  extra.resize(extra_bytes + kExpanderSlack);
  Scratch<std::uint16_t> folded(Inside::samples());
  for (auto _ : state) {
    if (expand_residuals(symbols, std::span(extra).first(extra_bytes), 0, folded.data()) == kNotExpanded) {
      state.SkipWithError("the extra bits do not fit the symbols");
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(expand)->Name("extra bits to symbols");

void decode_side_by_side(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(1)));
  const auto count = static_cast<std::size_t>(state.range(0));
  const std::vector<std::span<const std::byte>> payloads(of.payloads.begin(),
                                                         of.payloads.begin() + static_cast<std::ptrdiff_t>(count));
  for (auto _ : state) {
    std::vector<TileCodes> tiles(count);
    std::array<bool, kTiles> is_decoded{};
    decode_lanes(kShape, of.type, payloads, tiles, std::span(is_decoded).first(count));
    if (!is_decoded[0]) state.SkipWithError("is not decoded in lanes");
    benchmark::DoNotOptimize(tiles.data());
  }
  set_samples(state, count * Inside::samples(), of.type);
  state.SetLabel(to_string(of.type));
}
BENCHMARK(decode_side_by_side)->Name("decode, tiles side by side")->ArgsProduct({{1, kTiles}, {0, 1, 2}});

void decode_one(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)));
  for (auto _ : state) {
    const TileCodes tile = decode_tile(kShape, of.type, of.payloads[0]);
    benchmark::DoNotOptimize(&tile);
  }
  set_samples(state, Inside::samples(), of.type);
  state.SetLabel(to_string(of.type));
}
BENCHMARK(decode_one)->Name("decode, one tile")->DenseRange(0, 2);

void decode_all(benchmark::State& state) {
  const Coded& of = coded(static_cast<CodeType>(state.range(0)));
  std::vector<std::vector<std::byte>> payloads = of.payloads;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kTiles; ++i) inflate_exactly(of.encoded[i].deflated, payloads[i]);
    const std::vector<std::span<const std::byte>> spans(payloads.begin(), payloads.end());
    std::vector<TileCodes> tiles(kTiles);
    std::array<bool, kTiles> is_decoded{};
    decode_lanes(kShape, of.type, spans, tiles, is_decoded);
    for (std::size_t i = 0; i < kTiles; ++i) {
      if (!is_decoded[i]) tiles[i] = decode_tile(kShape, of.type, payloads[i]);
    }
    benchmark::DoNotOptimize(tiles.data());
  }
  set_samples(state, kTiles * Inside::samples(), of.type);
  state.SetLabel(to_string(of.type));
}
BENCHMARK(decode_all)->Name("inflate and decode, eight tiles")->DenseRange(0, 2);

}  // namespace

int main(int argc, char** argv) {
  // As the programs do: freed memory stays, or the system would clear the pages of every tile anew.
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
