// make_terrain: writes a landscape of any size, the same bytes for any number of threads, in constant memory.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>

#include <half.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <thread>
#include <vector>

#include "isohf/base/error.h"
#include "sink.h"
#include "terrain.h"

namespace isohf::terrain {
namespace {

struct Options {
  std::string output;
  std::string size = "1024x1024";
  Raster raster;
  TerrainOptions land;
  int threads = 0;
  bool quiet = false;
};

struct Band {
  std::int64_t row = 0;
  std::int64_t rows = 0;
  std::vector<std::byte> samples;
};

template <typename T, typename Convert>
void convert_row(std::span<const float> heights, std::byte* out, Convert convert) {
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const T sample = convert(heights[i]);
    std::memcpy(out + i * sizeof(T), &sample, sizeof(T));
  }
}

void store_row(SampleType type, std::span<const float> heights, std::byte* out) {
  switch (type) {
    case SampleType::kInt16:
      convert_row<std::int16_t>(
          heights, out, [](float h) { return std::isnan(h) ? kVoidInt16 : static_cast<std::int16_t>(std::lround(h)); });
      break;
    case SampleType::kUint16:
      convert_row<std::uint16_t>(heights, out, [](float h) {
        return std::isnan(h) ? kVoidUint16 : static_cast<std::uint16_t>(std::lround(std::max(h, 0.0F)));
      });
      break;
    case SampleType::kFloat32:
      convert_row<float>(heights, out, [](float h) { return h; });
      break;
    case SampleType::kFloat16:
      convert_row<half>(heights, out, [](float h) { return half(h); });
      break;
  }
}

Options parse(int argc, char** argv) {
  Options options;
  CLI::App app{"Makes terrain: mountains with eroded valleys, plains and, on request, a coast and voids.",
               "make_terrain"};
  app.add_option("-o,--output", options.output, "File to write: .tif .exr .png .hgt .raw .r16 .r32")->required();
  app.add_option("--size", options.size, "Columns x rows")->capture_default_str();
  app.add_option("--seed", options.land.seed, "Another number, another land")->capture_default_str();
  app.add_option("--spacing", options.land.spacing_m, "Distance between samples in metres")
      ->check(CLI::Range(0.1, 10000.0))
      ->capture_default_str();
  app.add_option("--relief", options.land.relief_m, "Height of the mountains in metres")
      ->check(CLI::Range(1.0, 20000.0))
      ->capture_default_str();
  app.add_option("--base", options.land.base_m, "Added to every height, in metres")
      ->check(CLI::Range(-12000.0, 12000.0))
      ->capture_default_str();
  app.add_option("--feature", options.land.feature_m, "Distance between the main ridges in metres")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--roughness", options.land.roughness_m, "Largest sensor error on one sample in metres")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--voids", options.land.void_fraction, "Share of samples in void patches")
      ->check(CLI::Range(0.0, 0.4))
      ->capture_default_str();
  app.add_flag("--coast", options.land.coast, "Let the lowlands go under a flat sea at the base");
  const std::map<std::string, SampleType> types = {{"int16", SampleType::kInt16},
                                                   {"uint16", SampleType::kUint16},
                                                   {"float32", SampleType::kFloat32},
                                                   {"half", SampleType::kFloat16}};
  app.add_option("--type", options.raster.type, "Sample type: int16 uint16 float32 half")
      ->transform(CLI::CheckedTransformer(types));
  app.add_flag("!--striped", options.raster.tiled, "TIFF, EXR: strips or scan lines instead of tiles");
  app.add_flag("!--uncompressed", options.raster.deflate, "TIFF, EXR: no compression");
  app.add_option("--threads", options.threads, "Threads; 0: as many as there are cores")->check(CLI::Range(0, 1024));
  app.add_flag("-q,--quiet", options.quiet, "Print nothing");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    std::exit(app.exit(e) == 0 ? 0 : 2);
  }
  return options;
}

void check(Options& options) {
  Raster& raster = options.raster;
  char end = 0;
  long long columns = 0;
  long long rows = 0;
  if (std::sscanf(options.size.c_str(), "%lldx%lld%c", &columns, &rows, &end) != 2 || columns < 1 || rows < 1 ||
      columns > 2'000'000'000 || rows > 2'000'000'000) {
    throw Error(ErrorCode::kInvalidArgument, "--size " + options.size + ": columns and rows wanted, like 16384x8192");
  }
  raster.columns = columns;
  raster.rows = rows;
  raster.spacing_m = options.land.spacing_m;
  raster.voids = options.land.void_fraction > 0;
}

void check_range(const Options& options, const Terrain& terrain) {
  const auto [low, high] = terrain.bounds();
  const SampleType type = options.raster.type;
  const double most = type == SampleType::kInt16 ? 32767 : type == SampleType::kUint16 ? 65534 : 65504;
  // Lowlands of uint16 rasters end at 0, like a sea without the flag.
  const double least = type == SampleType::kInt16 ? -32767 : type == SampleType::kUint16 ? -1e9 : -65504;
  if (type != SampleType::kFloat32 && (low < least || high > most)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("heights may reach {:.0f} .. {:.0f} m, more than the sample type holds; lower --relief",
                            low, high));
  }
}

void write(const Options& options, const Terrain& terrain, Sink& sink) {
  const Raster& raster = options.raster;
  const int threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const auto row_bytes = static_cast<std::size_t>(raster.columns) * size_bytes(raster.type);
  std::int64_t next = 0;
  auto cut = [&](tbb::flow_control& flow) {
    Band band{next, std::min(Sink::kBandRows, raster.rows - next), {}};
    if (band.rows <= 0) flow.stop();
    next += band.rows;
    return band;
  };
  auto fill = [&](Band band) {
    band.samples.resize(static_cast<std::size_t>(band.rows) * row_bytes);
    std::vector<float> heights(static_cast<std::size_t>(raster.columns));
    for (std::int64_t r = 0; r < band.rows; ++r) {
      terrain.row(0, band.row + r, heights);
      store_row(raster.type, heights, band.samples.data() + static_cast<std::size_t>(r) * row_bytes);
    }
    return band;
  };
  auto store = [&](Band band) { sink.write_band(band.samples); };
  tbb::parallel_pipeline(static_cast<std::size_t>(threads) + 1,
                         tbb::make_filter<void, Band>(tbb::filter_mode::serial_in_order, cut) &
                             tbb::make_filter<Band, Band>(tbb::filter_mode::parallel, fill) &
                             tbb::make_filter<Band, void>(tbb::filter_mode::serial_in_order, store));
  sink.finish();
}

void run(Options options) {
  check(options);
  const Terrain terrain(options.land);
  check_range(options, terrain);
  const std::string part = options.output + ".part";
  try {
    auto sink = make_sink(options.output, part, options.raster);
    write(options, terrain, *sink);
    sink.reset();
    std::filesystem::rename(part, options.output);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw;
  }
  if (!options.quiet) {
    fmt::print("{}: {} x {} samples, {} bytes\n", options.output, options.raster.columns, options.raster.rows,
               std::filesystem::file_size(options.output));
  }
}

}  // namespace
}  // namespace isohf::terrain

int main(int argc, char** argv) {
  const auto options = isohf::terrain::parse(argc, argv);
  try {
    isohf::terrain::run(options);
    return 0;
  } catch (const isohf::Error& e) {
    fmt::print(stderr, "make_terrain: {}\n", e.what());
    return e.code() == isohf::ErrorCode::kInvalidArgument ? 2 : 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "make_terrain: {}\n", e.what());
    return 1;
  }
}
