// Bandwidth of what stands between a raster's samples and a tile's codes, and of shading, beside memcpy on the same
// terrain; kernels_bench has the tile codec. Bytes are those that go in: 2 a sample of 16 bits, 4 a height. usage:
// surface_bench [--benchmark_filter=REGEX] [--benchmark_...]

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/sample.h"
#include "isohf/light/normals.h"
#include "isohf/light/shadow_hull.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "isohf/sampling/source/source_statistics.h"

namespace {

using namespace isohf;

constexpr std::int64_t kColumns = 512;
constexpr std::int64_t kRows = 512;
constexpr double kSpacing = 30.0;

/// Hills with some roughness, whole metres.
std::vector<std::int16_t> terrain() {
  std::vector<std::int16_t> samples;
  std::uint32_t state = 1;
  for (std::int64_t r = 0; r < kRows; ++r) {
    for (std::int64_t c = 0; c < kColumns; ++c) {
      const auto x = static_cast<double>(c);
      const auto z = static_cast<double>(r);
      state = state * 1664525U + 1013904223U;
      samples.push_back(static_cast<std::int16_t>(900.0 + 400.0 * std::sin(x * 0.02) * std::cos(z * 0.017) +
                                                  60.0 * std::sin(x * 0.13 + z * 0.09) +
                                                  static_cast<double>(state >> 30U)));
    }
  }
  return samples;
}

/// One tile of the usual shape in the middle of the terrain, at every stage of its way.
struct Stages {
  Stages() : raw(terrain().size() * 2), heights(raw.size() / 2) {
    std::memcpy(raw.data(), terrain().data(), raw.size());
    info.width = kColumns;
    info.height = kRows;
    info.sample_type = SampleType::kInt16;
    heights_from_samples(info, 0.0, raw, heights);
    cutter(Filter::kBilinear)->cut_from(band(), {0, 0}, tile);
    quantise(quantisation, 0.0, tile, codes);
  }

  [[nodiscard]] SourceBand band() const { return {{heights.data(), kColumns, kRows}, 0}; }
  [[nodiscard]] SourceAxis axis() const { return {kColumns, kSpacing / 2.0, kSpacing, Registration::kArea, 60.0}; }
  [[nodiscard]] std::unique_ptr<TileResampler> cutter(Filter filter) const {
    return make_grid_resampler(grid, {axis(), axis()}, Kernel::make(filter), {-1e9, 1e9});
  }

  SourceInfo info;
  TileGrid grid = TileGrid::make(TileShape::make(212, 243, 4), 2, 2, 6700.0, 6700.0);
  Quantisation quantisation{CodeType::kU16, 0.0, 0.5};
  std::vector<std::byte> raw;
  std::vector<float> heights;
  std::vector<float> tile = std::vector<float>(212 * 243);
  TileCodes codes;
};

const Stages& stages() {
  static const Stages made;
  return made;
}

void set_bytes(benchmark::State& state, std::size_t bytes) {
  state.SetBytesProcessed(static_cast<std::int64_t>(bytes) * state.iterations());
}

std::span<const std::byte> code_bytes() {
  return std::as_bytes(std::span(stages().codes.codes));
}

void memcpy_of_samples(benchmark::State& state) {
  std::vector<std::byte> to(stages().raw.size());
  for (auto _ : state) {
    std::memcpy(to.data(), stages().raw.data(), to.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  set_bytes(state, to.size());
}
BENCHMARK(memcpy_of_samples);

void scan(benchmark::State& state) {
  for (auto _ : state) {
    SourceScan found;
    scan_samples(stages().info, stages().raw, found);
    benchmark::DoNotOptimize(found);
  }
  set_bytes(state, stages().raw.size());
}
BENCHMARK(scan);

constexpr Filter kFilters[] = {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

void prefilter_rows(benchmark::State& state) {
  const Prefilter prefilter = Prefilter::make(kFilters[state.range(0)], Acquisition{});
  std::vector<float> band = stages().heights;
  for (auto _ : state) {
    prefilter.filter_rows({band.data(), kColumns, kRows});
    benchmark::ClobberMemory();
  }
  set_bytes(state, band.size() * sizeof(float));
  state.SetLabel(to_string(kFilters[state.range(0)]));
}
BENCHMARK(prefilter_rows)->Arg(3);

void prefilter_columns(benchmark::State& state) {
  const Prefilter prefilter = Prefilter::make(kFilters[state.range(0)], Acquisition{});
  std::vector<float> out(stages().heights.size());
  for (auto _ : state) {
    prefilter.filter_columns({stages().heights.data(), kColumns, kRows}, 0, {out.data(), kColumns, kRows});
    benchmark::ClobberMemory();
  }
  set_bytes(state, out.size() * sizeof(float));
  state.SetLabel(to_string(kFilters[state.range(0)]));
}
BENCHMARK(prefilter_columns)->Arg(3);

/// Row sampler and all: bytes of the heights that come out.
void cut_tile(benchmark::State& state) {
  const auto cutter = stages().cutter(kFilters[state.range(0)]);
  std::vector<float> out(stages().tile.size());
  for (auto _ : state) {
    cutter->cut_from(stages().band(), {0, 0}, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  set_bytes(state, out.size() * sizeof(float));
  state.SetLabel(to_string(kFilters[state.range(0)]));
}
BENCHMARK(cut_tile)->DenseRange(0, 3);

void normals(benchmark::State& state) {
  std::vector<Normal> out(stages().tile.size());
  for (auto _ : state) {
    tile_normals(stages().grid, {stages().tile.data(), 212, 243}, {out.data(), 212, 243});
    benchmark::ClobberMemory();
  }
  set_bytes(state, stages().tile.size() * sizeof(float));
}
BENCHMARK(normals);

void shadow_casters(benchmark::State& state) {
  const double fall =
      std::tan(2.0 * std::numbers::pi / 180.0) * 15.0 / 0.5;  // codes for one half step, sun at 2 degrees
  for (auto _ : state) {
    const TileCasters casters =
        tile_casters(stages().grid.shape(), {stages().codes.codes.data(), 212, 243}, std::uint16_t{65535}, fall);
    benchmark::DoNotOptimize(&casters);
  }
  set_bytes(state, code_bytes().size());
}
BENCHMARK(shadow_casters);

}  // namespace

BENCHMARK_MAIN();
