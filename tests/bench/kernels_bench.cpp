// Bandwidth of the tile codec's kernels on one tile of terrain, each beside memcpy and libdeflate in the same run.
// Bytes are those of the samples that a kernel works for, whatever it reads and writes: 2 of u16, 1 of u8, 4 of f32. So
// all figures of a type compare. scripts/bench kernels makes a table of it. usage: kernels_bench [--benchmark_...]

#include <benchmark/benchmark.h>
#include <libdeflate.h>
#include <malloc.h>

#include <cstring>
#include <memory>
#include <vector>

#include "bench/coded_tiles.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/predict/predictor_fit.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/residuals/pair_coding.h"
#include "isohf/archive/tile/residuals/residual_streams.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/base/sample.h"
#include "isohf/raster.h"

namespace isohf::bench {
namespace {

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
  const FitEffort effort = coding_effort(static_cast<Effort>(state.range(0))).fit;
  for (auto _ : state) {
    benchmark::DoNotOptimize(fit_predictors<std::int32_t>(inside().lattice, 0, 65534, effort).weights.data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(fit)->Name("fit (normal equations), effort")->Arg(0)->Arg(1);

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

void zigzag_residuals(benchmark::State& state) {
  std::vector<std::int32_t> halves(static_cast<std::size_t>(kShape.columns()), 1801);
  std::vector<std::uint16_t> zigzagged(halves.size());
  for (auto _ : state) {
    for (int r = 0; r < kShape.rows(); ++r) {
      zigzag_row(inside().lattice.row(r), halves.data(), kShape.columns(), zigzagged.data());
      benchmark::DoNotOptimize(zigzagged.data());
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(zigzag_residuals)->Name("zigzag");

void energies(benchmark::State& state) {
  const auto columns = static_cast<std::size_t>(kShape.columns());
  std::vector<std::uint8_t> magnitudes(columns + 8, 7);
  std::vector<std::uint16_t> out(columns);
  for (auto _ : state) {
    for (int r = 0; r < kShape.rows(); ++r) {
      find_energies(magnitudes.data() + 3, magnitudes.data() + 3, 0, kShape.columns() - 1, out.data());
      benchmark::DoNotOptimize(out.data());
    }
    benchmark::ClobberMemory();
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(energies)->Name("context energies");

void contexts(benchmark::State& state) {
  const std::span<const std::uint16_t> of(inside().residuals.energies.data(), Inside::samples());
  for (auto _ : state) {
    const std::vector<std::uint32_t> histogram = count_energies(of);
    benchmark::DoNotOptimize(
        choose_thresholds(inside().symbols, of, histogram, coding_effort(Effort::kDefault).streams.context_thinning)
            .data());
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
    benchmark::DoNotOptimize(
        make_streams(inside().residuals, coding_effort(Effort::kDefault).streams, header).extra.data());
  }
  set_samples(state, Inside::samples());
}
BENCHMARK(streams)->Name("streams: contexts, sort, symbols, extra bits, pairs");

void pair(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(pair_symbols(inside().least).data());
  set_samples(state, inside().least.size());
}
BENCHMARK(pair)->Name("pairs of symbols");

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

}  // namespace
}  // namespace isohf::bench

int main(int argc, char** argv) {
  // As the programs do: freed memory stays, or the system would clear the pages of every tile anew.
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
