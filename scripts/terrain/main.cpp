// make_terrain: writes a landscape of any size, the same bytes for any number of threads, in constant memory.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>

#include <half.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <thread>
#include <tuple>
#include <vector>

#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "program.h"
#include "terrain.h"

namespace isohf::terrain {
namespace {

/// Samples that mean "no height here"; the float types use NaN.
constexpr std::int16_t kVoidInt16 = -32768;
constexpr std::uint16_t kVoidUint16 = 65535;
constexpr std::int64_t kBandRows = 256;

struct Options {
  std::string output;
  RasterSpec raster;
  TerrainOptions land;
  int threads = 0;
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
    case SampleType::kFloat16:
      convert_row<half>(heights, out, [](float h) { return half(h); });
      break;
    default:
      convert_row<float>(heights, out, [](float h) { return h; });
  }
}

/// Cells in UTM zone 33 North, far from the zone's edges; a place that an HGT file could not say.
void describe_ground(Options& options) {
  RasterSpec& raster = options.raster;
  const SampleType type = raster.sample_type;
  if (options.land.void_fraction > 0) {
    raster.void_value = type == SampleType::kInt16    ? kVoidInt16
                        : type == SampleType::kUint16 ? kVoidUint16
                                                      : std::numeric_limits<double>::quiet_NaN();
  }
  if (options.output.ends_with(".hgt")) return;
  Georeference& place = raster.georeference.emplace();
  place.registration = Registration::kArea;
  place.unit = HorizontalUnit::kMetre;
  place.spacing_x = place.spacing_y = options.land.spacing_m;
  place.has_origin = true;
  place.origin_x = 300000 + place.spacing_x / 2;
  place.origin_y = 5300000 - place.spacing_y / 2;
  place.system.epsg = 32633;
}

void declare(CLI::App& line, Options& options) {
  RasterSpec& raster = options.raster;
  TerrainOptions& land = options.land;
  raster.width = raster.height = 1024;
  raster.sample_type = SampleType::kInt16;
  raster.overwrite = true;
  const auto number = [&](const char* flag, const char* name, const char* description, double& value, double least,
                          double most) {
    cli::option(line, flag, name, fmt::format("{} [default: {}]", description, value),
                [&value, least, most](const auto& text) { value = cli::parse_number_in(text, least, most); });
  };
  cli::positional(line, "OUTPUT,-o,--output", "File to write: .tif .exr .png .hgt .npy .raw .r16 .r32", options.output);
  cli::option(line, "--size", "WxH", "Columns and rows [default: 1024x1024]", [&raster](const std::string& text) {
    std::tie(raster.width, raster.height) = cli::parse_size(text, 1, 2'000'000'000);
  });
  cli::option(line, "--seed", "N", "Make another land for another number", [&land](const std::string& text) {
    land.seed =
        static_cast<decltype(land.seed)>(cli::parse_whole_number(text, 0, std::numeric_limits<std::int64_t>::max()));
  });
  number("--spacing", "M", "Put samples M metres apart", land.spacing_m, 0.1, 10000.0);
  number("--relief", "M", "Raise mountains M metres high", land.relief_m, 1.0, 20000.0);
  number("--base", "M", "Add M metres to every height", land.base_m, -12000.0, 12000.0);
  number("--feature", "M", "Put the main ridges M metres apart", land.feature_m, 1.0, 1e6);
  number("--roughness", "M", "Largest sensor error of a sample in metres", land.roughness_m, 0.0, 100.0);
  number("--voids", "SHARE", "Share of samples in void patches", land.void_fraction, 0.0, 0.4);
  line.add_flag("--coast", land.coast, "Let the lowlands go under a flat sea at the base");
  cli::choice<SampleType>(line, "--type",
                          {{"int16", SampleType::kInt16},
                           {"uint16", SampleType::kUint16},
                           {"float32", SampleType::kFloat32},
                           {"half", SampleType::kFloat16}},
                          "Sample type [default: int16]", raster.sample_type);
  line.add_flag("!--uncompressed", raster.compress, "TIFF, EXR: no compression");
  cli::add_threads_option(line, options.threads);
}

void check_range(const Options& options, const Terrain& terrain) {
  const auto [low, high] = terrain.bounds();
  const SampleType type = options.raster.sample_type;
  const double most = type == SampleType::kInt16 ? 32767 : type == SampleType::kUint16 ? 65534 : 65504;
  // Lowlands of uint16 rasters end at 0, like a sea without the flag.
  const double least = type == SampleType::kInt16 ? -32767 : type == SampleType::kUint16 ? -1e9 : -65504;
  if (type != SampleType::kFloat32 && (low < least || high > most)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("heights may reach {:.0f} .. {:.0f} m, more than the sample type holds; lower --relief",
                            low, high));
  }
}

void write(const Options& options, const Terrain& terrain, RasterSink& sink) {
  const RasterSpec& raster = options.raster;
  const int threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const auto row_bytes = static_cast<std::size_t>(raster.width) * size_bytes(raster.sample_type);
  std::int64_t next = 0;
  auto cut = [&](tbb::flow_control& flow) {
    Band band{next, std::min(kBandRows, raster.height - next), {}};
    if (band.rows <= 0) flow.stop();
    next += band.rows;
    return band;
  };
  auto fill = [&](Band band) {
    band.samples.resize(static_cast<std::size_t>(band.rows) * row_bytes);
    std::vector<float> heights(static_cast<std::size_t>(raster.width));
    for (std::int64_t r = 0; r < band.rows; ++r) {
      terrain.row(0, band.row + r, heights);
      store_row(raster.sample_type, heights, band.samples.data() + static_cast<std::size_t>(r) * row_bytes);
    }
    return band;
  };
  auto store = [&](Band band) { sink.write_rows(band.samples); };
  tbb::parallel_pipeline(static_cast<std::size_t>(threads) + 1,
                         tbb::make_filter<void, Band>(tbb::filter_mode::serial_in_order, cut) &
                             tbb::make_filter<Band, Band>(tbb::filter_mode::parallel, fill) &
                             tbb::make_filter<Band, void>(tbb::filter_mode::serial_in_order, store));
  sink.finish();
}

int make(const Options& options, bool quiet) {
  const Terrain terrain(options.land);
  check_range(options, terrain);
  const auto sink = create_raster(options.output, options.raster);
  write(options, terrain, *sink);
  if (!quiet) {
    fmt::print("{}: {} x {} samples, {} bytes\n", options.output, options.raster.width, options.raster.height,
               std::filesystem::file_size(options.output));
  }
  return cli::kExitDone;
}

cli::Run add_make_terrain(CLI::App& line, cli::Common& common) {
  const auto options = std::make_shared<Options>();
  declare(line, *options);
  return [options, &common] {
    describe_ground(*options);
    return make(*options, common.quiet);
  };
}

constexpr cli::Command kCommands[] = {{"make_terrain", "Make terrain", "", add_make_terrain}};
constexpr cli::Program kProgram = {
    "make_terrain", "Makes terrain: mountains with eroded valleys, plains and, on request, a coast and voids.", "",
    kCommands};

}  // namespace
}  // namespace isohf::terrain

int main(int argc, char** argv) {
  return isohf::cli::run_main(isohf::terrain::kProgram, argc, argv);
}
