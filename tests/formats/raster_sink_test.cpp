#include "formats/raster_sink.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <random>

#include "formats/raster_reference.h"
#include "formats/registry.h"
#include "isohf/base/error.h"

namespace isohf::testing {
namespace {

using ::testing::HasSubstr;

constexpr SampleType kAllTypes[] = {SampleType::kUint8,   SampleType::kInt8,    SampleType::kUint16,
                                    SampleType::kInt16,   SampleType::kUint32,  SampleType::kInt32,
                                    SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};

RasterSpec spec_of(std::int64_t width, std::int64_t height, SampleType type, int channels = 1) {
  RasterSpec spec;
  spec.width = width;
  spec.height = height;
  spec.sample_type = type;
  spec.channels = channels;
  return spec;
}

/// Any bits are samples that must come back: infinities, NaNs and subnormals too.
std::vector<std::byte> noise(const RasterSpec& spec) {
  std::vector<std::byte> samples(static_cast<std::size_t>(spec.width * spec.height * spec.channels) *
                                 size_bytes(spec.sample_type));
  std::mt19937 random(7);
  for (std::byte& byte : samples) byte = static_cast<std::byte>(random() & 0xFFU);
  return samples;
}

std::vector<std::byte> channel_of(const RasterSpec& spec, const std::vector<std::byte>& samples, std::size_t channel) {
  const std::size_t size = size_bytes(spec.sample_type);
  std::vector<std::byte> picked;
  for (std::size_t at = channel * size; at < samples.size(); at += size * static_cast<std::size_t>(spec.channels)) {
    picked.insert(picked.end(), samples.begin() + static_cast<std::ptrdiff_t>(at),
                  samples.begin() + static_cast<std::ptrdiff_t>(at + size));
  }
  return picked;
}

/// Writes in runs of `run` rows.
void write(const std::string& path, const RasterSpec& spec, const std::vector<std::byte>& samples, std::int64_t run) {
  const auto sink = create_raster(path, spec);
  const std::size_t step = samples.size() / static_cast<std::size_t>(spec.height) * static_cast<std::size_t>(run);
  for (std::size_t at = 0; at < samples.size(); at += step) {
    sink->write_rows(std::span(samples).subspan(at, std::min(step, samples.size() - at)));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  sink->finish();
  EXPECT_TRUE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

bool can_store(const std::string& extension, SampleType type) {
  if (extension == ".exr") {
    return type == SampleType::kFloat16 || type == SampleType::kFloat32 || type == SampleType::kUint32;
  }
  if (extension == ".png") return type == SampleType::kUint8 || type == SampleType::kUint16;
  return true;
}

TEST(RasterSink, RoundTripsEverySampleTypeAndChannel) {
  const ScratchFolder folder;
  for (const std::string extension : {".tif", ".TIFF", ".exr", ".png"}) {
    for (const SampleType type : kAllTypes) {
      if (!can_store(extension, type)) continue;
      for (const int channels : {1, 3, 4}) {
        for (const std::int64_t run : {1, 7, 100}) {
          SCOPED_TRACE(extension + " " + to_string(type) + " x" + std::to_string(channels));
          const RasterSpec spec = spec_of(37, 23, type, channels);
          const auto samples = noise(spec);
          const std::string path = folder / ("raster" + std::to_string(run) + extension);
          std::filesystem::remove(path);
          write(path, spec, samples, run);
          for (int channel = 0; channel < channels; ++channel) {
            OpenOptions options;
            if (channels > 1) options.channel = std::string(1, "RGBA"[channel]);
            const auto source = open_source(path, options);
            ASSERT_EQ(source->info().sample_type, type);
            ASSERT_EQ(source->info().width, spec.width);
            ASSERT_EQ(source->info().height, spec.height);
            EXPECT_EQ(read_whole(*source), channel_of(spec, samples, static_cast<std::size_t>(channel)));
            EXPECT_TRUE(source->info().warnings.empty()) << source->info().warnings.front();
          }
        }
      }
    }
  }
}

TEST(RasterSink, RoundTripsManyStripsAndLongRows) {
  const ScratchFolder folder;
  for (const auto& [width, height] : {std::pair{3000, 400}, {200000, 3}, {1, 5000}}) {
    for (const std::string extension : {".tif", ".exr"}) {
      const RasterSpec spec = spec_of(width, height, SampleType::kFloat32);
      const auto samples = noise(spec);
      const std::string path = folder / (std::to_string(width) + extension);
      write(path, spec, samples, 33);
      EXPECT_EQ(read_whole(*open_source(path, {})), samples);
    }
  }
}

TEST(RasterSink, WritesHgtTilesOfTheSizesThatExist) {
  const ScratchFolder folder;
  const RasterSpec spec = spec_of(1201, 1201, SampleType::kInt16);
  const auto samples = noise(spec);
  const std::string path = folder / "N44E006.hgt";
  write(path, spec, samples, 100);
  EXPECT_EQ(std::filesystem::file_size(path), 1201U * 1201U * 2U);
  EXPECT_EQ(read_whole(*open_source(path, {})), samples);
  for (const auto& bad : {spec_of(1200, 1201, SampleType::kInt16), spec_of(1201, 1201, SampleType::kUint16),
                          spec_of(1201, 1201, SampleType::kInt16, 3)}) {
    EXPECT_EQ(error_of([&] { (void)create_raster(folder / "N44E007.hgt", bad); }).code(), ErrorCode::kUnsupported);
  }
  RasterSpec other_void = spec;
  other_void.void_value = -9999.0;
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "N44E007.hgt", other_void); }).code(), ErrorCode::kUnsupported);
}

TEST(RasterSink, KeepsVoidScaleAndUnitInTiff) {
  const ScratchFolder folder;
  const std::string path = folder / "void.tif";
  for (const auto& [type, value] : {std::pair{SampleType::kInt16, -32768.0},
                                    {SampleType::kFloat32, static_cast<double>(-3.4028235e38F)},
                                    {SampleType::kFloat64, 1e-300},
                                    {SampleType::kUint8, 0.0}}) {
    RasterSpec spec = spec_of(5, 4, type);
    spec.void_value = value;
    spec.z_scale = 0.1;
    spec.z_offset = -11000.0;
    spec.vertical_unit = "foot";
    spec.metres_per_vertical_unit = 0.3048;
    spec.overwrite = true;
    const auto sink = create_raster(path, spec);
    sink->write_rows(noise(spec));
    sink->finish();
    const auto source = open_source(path, {});
    EXPECT_EQ(source->info().void_values, std::vector<double>{value});
    EXPECT_EQ(source->info().z_scale, 0.1);
    EXPECT_EQ(source->info().z_offset, -11000.0);
    EXPECT_EQ(source->info().vertical_unit, "foot");
    EXPECT_EQ(source->info().metres_per_vertical_unit, 0.3048);
  }
}

void expect_same_place(const Georeference& a, const Georeference& b) {
  EXPECT_EQ(a.registration, b.registration);
  EXPECT_EQ(a.unit, b.unit);
  EXPECT_EQ(a.metres_per_unit, b.metres_per_unit);
  EXPECT_EQ(a.spacing_x, b.spacing_x);
  EXPECT_EQ(a.spacing_y, b.spacing_y);
  EXPECT_EQ(a.has_origin, b.has_origin);
  // Half a sample to the corner and back may cost a rounding in each direction.
  EXPECT_NEAR(a.origin_x, b.origin_x, 4e-16 * std::abs(a.origin_x));
  EXPECT_NEAR(a.origin_y, b.origin_y, 4e-16 * std::abs(a.origin_y));
  EXPECT_EQ(a.system.epsg, b.system.epsg);
  EXPECT_EQ(a.system.name, b.system.name);
  EXPECT_EQ(a.system.body, b.system.body);
  EXPECT_EQ(a.system.semi_major_axis_m, b.system.semi_major_axis_m);
  EXPECT_EQ(a.system.inverse_flattening, b.system.inverse_flattening);
  EXPECT_EQ(a.system.vertical_epsg, b.system.vertical_epsg);
  EXPECT_EQ(a.system.vertical_datum, b.system.vertical_datum);
}

TEST(RasterSink, KeepsTheGeoreferenceOfRealFilesInTiff) {
  const auto files = references(".tif");
  if (files.empty()) GTEST_SKIP() << "no shared terrain beside this checkout";
  const ScratchFolder folder;
  for (const Reference& file : files) {
    SCOPED_TRACE(file.path);
    const SourceInfo original = open_source(file.path, {})->info();
    RasterSpec spec = spec_of(6, 4, original.sample_type);
    spec.georeference = original.georeference;
    spec.vertical_unit = original.vertical_unit;
    spec.metres_per_vertical_unit = original.metres_per_vertical_unit;
    spec.overwrite = true;
    const std::string path = folder / "copy.tif";
    const auto sink = create_raster(path, spec);
    sink->write_rows(noise(spec));
    sink->finish();
    const auto source = open_source(path, {});
    expect_same_place(original.georeference, source->info().georeference);
    EXPECT_EQ(original.vertical_unit, source->info().vertical_unit);
  }
}

TEST(RasterSink, KeepsTransparentGrayInPng) {
  const ScratchFolder folder;
  const std::string path = folder / "void.png";
  RasterSpec spec = spec_of(5, 4, SampleType::kUint16);
  spec.void_value = 65535.0;
  write(path, spec, noise(spec), 4);
  EXPECT_EQ(open_source(path, {})->info().void_values, std::vector<double>{65535.0});
  spec.void_value = -1.0;
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "no.png", spec); }).code(), ErrorCode::kUnsupported);
}

TEST(RasterSink, LeavesNothingBehindUnlessFinished) {
  const ScratchFolder folder;
  for (const char* extension : {".tif", ".exr", ".png"}) {
    const std::string path = folder / (std::string("half") + extension);
    const RasterSpec spec =
        spec_of(16, 16, std::string(extension) == ".exr" ? SampleType::kFloat32 : SampleType::kUint16);
    const auto samples = noise(spec);
    {
      const auto sink = create_raster(path, spec);
      EXPECT_TRUE(std::filesystem::exists(path + ".part"));
      sink->write_rows(std::span(samples).first(samples.size() / 2));
      EXPECT_THAT(error_of([&] { sink->finish(); }).what(), HasSubstr("finished after 8 of 16 rows"));
      EXPECT_EQ(error_of([&] { sink->write_rows(samples); }).code(), ErrorCode::kInvalidArgument);
      EXPECT_EQ(error_of([&] { sink->write_rows(std::span(samples).first(3)); }).code(), ErrorCode::kInvalidArgument);
      EXPECT_THAT(error_of([&] { (void)create_raster(path, spec); }).what(), HasSubstr("being written by another"));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
    EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  }
}

TEST(RasterSink, ReplacesAFileOnlyWhenTold) {
  const ScratchFolder folder;
  const std::string path = folder / "here.tif";
  RasterSpec spec = spec_of(4, 4, SampleType::kInt16);
  write(path, spec, noise(spec), 4);
  const Error error = error_of([&] { (void)create_raster(path, spec); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(error.what(), path + ": exists already (--overwrite replaces it)");
  spec.overwrite = true;
  { const auto abandoned = create_raster(path, spec); }
  EXPECT_EQ(open_source(path, {})->info().width, 4);
  spec.width = 5;
  const auto sink = create_raster(path, spec);
  sink->write_rows(noise(spec));
  sink->finish();
  EXPECT_EQ(open_source(path, {})->info().width, 5);
}

TEST(RasterSink, RefusesWhatItCannotWriteAndLeavesNothing) {
  const ScratchFolder folder;
  const RasterSpec good = spec_of(4, 4, SampleType::kFloat32);
  Error error = error_of([&] { (void)create_raster(folder / "a.jpg", good); });
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("\".jpg\"; there are .tif .tiff .exr .png .hgt"));
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "a", good); }).code(), ErrorCode::kUnsupported);
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "a.png", good); }).code(), ErrorCode::kUnsupported);
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "a.exr", spec_of(4, 4, SampleType::kInt16)); }).code(),
            ErrorCode::kUnsupported);
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "none/a.tif", good); }).code(), ErrorCode::kIo);
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "a.tif", spec_of(0, 4, SampleType::kInt16)); }).code(),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(error_of([&] { (void)create_raster(folder / "a.tif", spec_of(4, 4, SampleType::kInt16, 2)); }).code(),
            ErrorCode::kInvalidArgument);
  std::filesystem::create_directory(folder / "folder.tif");
  EXPECT_THAT(error_of([&] { (void)create_raster(folder / "folder.tif", good); }).what(), HasSubstr("is a folder"));
  int left = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / ".")) ++left;
  EXPECT_EQ(left, 1);
}

/// A limit on the size of files stands in for a full disk: writes fail in the same place.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    ::rlimit limited = before_;
    limited.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limited);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  ::rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST(RasterSink, ReportsADiskThatIsFull) {
  const ScratchFolder folder;
  for (const std::string name : {"full.tif", "full.exr", "full.png", "N00E000.hgt"}) {
    const RasterSpec spec = spec_of(1201, 1201,
                                    name == "full.exr"   ? SampleType::kFloat32
                                    : name == "full.png" ? SampleType::kUint16
                                                         : SampleType::kInt16);
    const auto samples = noise(spec);
    // Noise does not compress: each limit falls into the samples, the last one into what follows them.
    for (const std::size_t limit : {std::size_t{100}, samples.size() / 2, samples.size() - 1000}) {
      const FileSizeLimit full(limit);
      const Error error = error_of([&] {
        const auto sink = create_raster(folder / name, spec);
        sink->write_rows(samples);
        sink->finish();
      });
      EXPECT_EQ(error.code(), ErrorCode::kIo) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(folder / name));
      EXPECT_FALSE(std::filesystem::exists(folder / name));
      EXPECT_FALSE(std::filesystem::exists(folder / (name + ".part")));
    }
  }
}

}  // namespace
}  // namespace isohf::testing
