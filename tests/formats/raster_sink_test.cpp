#include "formats/write/raster_sink.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

constexpr SampleType kAllTypes[] = {SampleType::kUint8,   SampleType::kInt8,    SampleType::kUint16,
                                    SampleType::kInt16,   SampleType::kUint32,  SampleType::kInt32,
                                    SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};

/// Any bits are samples that must come back, infinities, NaNs and subnormals too, but for what is larger than any ground.
std::vector<std::byte> noise(const RasterSpec& spec) {
  std::vector<std::byte> samples(static_cast<std::size_t>(spec.width * spec.height * spec.channels) *
                                 size_bytes(spec.sample_type));
  std::mt19937 random(7);
  for (std::byte& byte : samples) byte = static_cast<std::byte>(random() & 0xFFU);
  const std::size_t size = size_bytes(spec.sample_type);
  if (spec.sample_type != SampleType::kFloat32 && spec.sample_type != SampleType::kFloat64) return samples;
  for (std::size_t at = 0; at < samples.size(); at += size) {
    const double value = value_at(spec.sample_type, std::span(samples).subspan(at, size), 0);
    if (std::isfinite(value) && std::abs(value) > 1e30) samples[at + size - 1] &= std::byte{0xBF};
  }
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

using RasterSink = InFolder;

TEST_F(RasterSink, RoundTripsEverySampleTypeAndChannel) {
  for (const std::string extension : {".tif", ".TIFF", ".exr", ".png"}) {
    for (const SampleType type : kAllTypes) {
      if (held_type(folder / ("a" + extension), type) != type) continue;
      for (const int channels : {1, 3, 4}) {
        for (const std::int64_t run : {1, 7, 100}) {
          SCOPED_TRACE(extension + " " + to_string(type) + " x" + std::to_string(channels));
          const RasterSpec spec = raster_spec(37, 23, type, channels);
          const auto samples = noise(spec);
          const std::string path = folder / ("raster" + std::to_string(run) + extension);
          std::filesystem::remove(path);
          write(path, spec, samples, run);
          for (int channel = 0; channel < channels; ++channel) {
            OpenOptions options;
            if (channels > 1) options.channel = std::string(1, "RGBA"[channel]);
            const auto source = open_raster(path, options);
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

TEST_F(RasterSink, RoundTripsManyStripsAndLongRows) {
  for (const auto& [width, height] : {std::pair{3000, 400}, {200000, 3}, {1, 5000}}) {
    for (const std::string extension : {".tif", ".exr"}) {
      const RasterSpec spec = raster_spec(width, height, SampleType::kFloat32);
      const auto samples = noise(spec);
      const std::string path = folder / (std::to_string(width) + extension);
      write(path, spec, samples, 33);
      EXPECT_EQ(read_whole(*open_raster(path, {})), samples);
    }
  }
}

RasterSpec placed(std::int64_t width, std::int64_t height, SampleType type, double spacing_y) {
  RasterSpec spec = raster_spec(width, height, type);
  spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre, 500005.0, 4000195.0, 10.0, 32632);
  spec.georeference->spacing_y = spacing_y;
  spec.georeference->system.name = "WGS 84 / UTM zone 32N";
  spec.georeference->system.body = "Earth";
  return spec;
}

/// Why there can be no such raster.
ErrorCode code_of(const std::string& path, const RasterSpec& spec) {
  return error_of([&] { (void)create_raster(path, spec); }).code();
}

TEST_F(RasterSink, GridsAndPlainSamplesReadBackWithPlaceAndNodata) {
  int round = 0;
  for (const std::string extension : {".asc", ".flt", ".r16", ".r32", ".raw", ".npy"}) {
    for (const SampleType type : kAllTypes) {
      const bool any_type = extension == ".asc" || extension == ".npy";
      if (!any_type && type != held_type(folder / ("a" + extension), type)) continue;
      for (const double spacing_y : {10.0, 12.5}) {
        SCOPED_TRACE(extension + " " + to_string(type));
        RasterSpec spec = placed(5, 4, type, spacing_y);
        spec.z_scale = 0.25;
        spec.z_offset = -100.0;
        if (!is_floating(type)) spec.void_value = 7.0;
        std::vector<std::byte> samples(20 * size_bytes(type));
        for (std::size_t i = 0; i < 20; ++i) {
          const double z = static_cast<double>(i) + 10.0;
          const double stored = is_floating(type) ? i == 9 ? std::nan("") : z / 3.0 : i == 9 ? 7.0 : z;
          store_sample(type)(stored, samples.data() + i * size_bytes(type));
        }
        std::vector<double> wanted = values_of(type, samples);
        const std::string path = folder / (std::to_string(++round) + extension);
        write(path, spec, samples, 3);
        const auto source = open_raster(path, {});
        const SourceInfo& info = source->info();
        ASSERT_EQ(info.width, 5);
        ASSERT_EQ(info.height, 4);
        const std::vector<double> found = values_of(*source);
        if (extension == ".npy") {  // has no nodata value
          EXPECT_EQ(info.sample_type, type);
          EXPECT_FALSE(info.georeference.has_origin);
        } else {
          const Georeference& place = info.georeference;
          EXPECT_THAT(grid_of(place), ::testing::ElementsAre(500005.0, 4000195.0, 10.0, spacing_y));
          EXPECT_EQ(place.registration, Registration::kArea);
          EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
          EXPECT_EQ(info.z_scale, any_type || extension == ".flt" ? 1.0 : 0.25);
          EXPECT_EQ(info.warnings.size(), 0U) << info.warnings.front();
          EXPECT_TRUE(is_void(info, found[9]));
          wanted[9] = found[9];
        }
        for (std::size_t i = 0; i < 20; ++i) {
          // An ASCII grid is read as float64: the float is the nearest one to its digits.
          const bool digits = extension == ".asc" && (type == SampleType::kFloat16 || type == SampleType::kFloat32);
          const double value = digits ? static_cast<double>(static_cast<float>(found[i])) : found[i];
          EXPECT_TRUE(value == wanted[i] || (std::isnan(value) && std::isnan(wanted[i])) || i == 9)
              << i << " " << value;
        }
      }
    }
  }
}

TEST_F(RasterSink, WritesSidecarsWithTheRasterOrNotAtAll) {
  const RasterSpec spec = placed(6, 4, SampleType::kFloat32, 10.0);
  { const auto abandoned = create_raster(folder / "a.flt", spec); }
  EXPECT_TRUE(std::filesystem::is_empty(folder / "."));
  write(folder / "a.flt", spec, noise(spec), 4);
  EXPECT_TRUE(std::filesystem::exists(folder / "a.hdr"));
  EXPECT_TRUE(std::filesystem::exists(folder / "a.prj"));
  write(folder / "a.asc", spec, noise(spec), 4);  // the .prj is there already, and the same
  write_file(folder / "b.hdr", "ncols 3\nnrows 2\n");
  const Error error = error_of([&] { (void)create_raster(folder / "b.flt", spec); });
  EXPECT_EQ(error.what(), folder / "b.flt: " + (folder / "b.hdr: exists; `overwrite` replaces it"));
  EXPECT_EQ(read_file(folder / "b.hdr"), "ncols 3\nnrows 2\n");
  RasterSpec picture = placed(6, 4, SampleType::kUint16, 10.0);
  write(folder / "c.png", picture, noise(picture), 4);
  EXPECT_FALSE(std::filesystem::exists(folder / "c.png.json"));
  picture.describe = true;
  picture.z_scale = 0.5;
  write(folder / "d.png", picture, noise(picture), 4);
  const auto json = nlohmann::json::parse(std::ifstream(folder / "d.png.json"));
  EXPECT_EQ(json.at("z_scale"), 0.5);
  EXPECT_EQ(json.at("origin_y"), 4000195.0);
  EXPECT_EQ(json.at("registration"), "area");
  EXPECT_EQ(json.at("crs_epsg"), 32632);
}

TEST_F(RasterSink, RefusesADescriptionThatIsWrong) {
  const std::string good = R"({"width": 2, "height": 2, "sample_type": "uint16", "byte_order": "little")";
  const std::pair<std::string, const char*> rows[] = {
      {"[1]", "is not a JSON object"},
      {"{", "is not a JSON object"},
      {R"({"width": 2.5, "height": 2})", "has no width and height"},
      {R"({"width": 2, "height": 2, "sample_type": "real"})", "sample_type"},
      {R"({"width": 2, "height": 2, "sample_type": "int8"})", "neither little nor big"},
      {good + R"(, "z_scale": "1"})", "z_scale is no number"},
      {good + R"(, "z_scale": 0})", "z_scale is 0"},
      {good + R"(, "void_value": -1})", "no uint16 sample can hold"},
      {good + R"(, "spacing_x": -1})", "is not positive"},
      {R"({"width": 2, "height": 3, "sample_type": "uint16", "byte_order": "little"})", "the file has 8 bytes"}};
  write_file(folder / "a.r16", "12345678");
  for (const auto& [json, says] : rows) {
    write_file(folder / "a.r16.json", json);
    const Error error = error_of([&] { (void)open_raster(folder / "a.r16", {}); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_THAT(error.what(), HasSubstr(says));
  }
}

TEST_F(RasterSink, BeginsBigTiffWhereClassicTiffEnds) {
  for (const auto& [side, magic] : {std::pair{1000, 42}, {40000, 43}}) {
    const auto sink = create_raster(folder / "large.tif", raster_spec(side, side, SampleType::kFloat32));
    const std::string head = read_file(folder / "large.tif.part");
    ASSERT_GE(head.size(), 4U);
    EXPECT_EQ(head[2], magic);
  }
}

TEST_F(RasterSink, WritesHgtTilesOfTheSizesThatExist) {
  const RasterSpec spec = raster_spec(1201, 1201, SampleType::kInt16);
  const auto samples = noise(spec);
  const std::string path = folder / "N44E006.hgt";
  write(path, spec, samples, 100);
  EXPECT_EQ(std::filesystem::file_size(path), 1201U * 1201U * 2U);
  EXPECT_EQ(read_whole(*open_raster(path, {})), samples);
  for (const auto& bad : {raster_spec(1200, 1201, SampleType::kInt16), raster_spec(1201, 1201, SampleType::kUint16),
                          raster_spec(1201, 1201, SampleType::kInt16, 3)}) {
    EXPECT_EQ(code_of(folder / "N44E007.hgt", bad), ErrorCode::kInvalidArgument);
  }
  RasterSpec other_void = spec;
  other_void.void_value = -9999.0;
  EXPECT_EQ(code_of(folder / "N44E007.hgt", other_void), ErrorCode::kInvalidArgument);
}

TEST_F(RasterSink, StoresTheTypesThatItsFormatHolds) {
  using enum SampleType;
  for (const std::string& extension : writable_extensions()) {
    for (const SampleType wanted : {kUint8, kUint16, kInt16, kUint32, kInt32, kFloat16, kFloat32, kFloat64}) {
      SCOPED_TRACE(extension + " " + to_string(wanted));
      const std::string path = folder / ("held" + extension);
      const std::int64_t side = extension == ".hgt" ? 1201 : 4;
      EXPECT_EQ(held_type(path, held_type(path, wanted)), held_type(path, wanted));
      EXPECT_NO_THROW((void)create_raster(path, raster_spec(side, side, held_type(path, wanted))));
      if (held_type(path, wanted) != wanted) {
        EXPECT_EQ(code_of(path, raster_spec(side, side, wanted)), ErrorCode::kInvalidArgument);
      }
    }
  }
  EXPECT_THROW((void)held_type(folder / "a.xyz", kInt16), Error);
}

TEST_F(RasterSink, KeepsVoidScaleAndUnitInTiff) {
  const std::string path = folder / "void.tif";
  for (const auto& [type, value] : {std::pair{SampleType::kInt16, -32768.0},
                                    {SampleType::kFloat32, static_cast<double>(-3.4028235e38F)},
                                    {SampleType::kFloat64, 1e-300},
                                    {SampleType::kUint8, 0.0}}) {
    RasterSpec spec = raster_spec(5, 4, type);
    spec.void_value = value;
    spec.z_scale = 0.1;
    spec.z_offset = -11000.0;
    spec.vertical_unit = "foot";
    spec.metres_per_vertical_unit = 0.3048;
    spec.overwrite = true;
    write_raster(path, spec, noise(spec));
    const auto source = open_raster(path, {});
    EXPECT_EQ(source->info().void_values, std::vector<double>{value});
    EXPECT_EQ(source->info().z_scale, 0.1);
    EXPECT_EQ(source->info().z_offset, -11000.0);
    EXPECT_EQ(source->info().vertical_unit, "foot");
    EXPECT_EQ(source->info().metres_per_vertical_unit, 0.3048);
  }
}

TEST_F(RasterSink, KeepsTransparentGrayInPng) {
  const std::string path = folder / "void.png";
  RasterSpec spec = raster_spec(5, 4, SampleType::kUint16);
  spec.void_value = 65535.0;
  write(path, spec, noise(spec), 4);
  EXPECT_EQ(open_raster(path, {})->info().void_values, std::vector<double>{65535.0});
  spec.void_value = -1.0;
  EXPECT_EQ(code_of(folder / "no.png", spec), ErrorCode::kInvalidArgument);
}

TEST_F(RasterSink, LeavesNothingBehindUnlessFinished) {
  for (const char* extension : {".tif", ".exr", ".png"}) {
    const std::string path = folder / (std::string("half") + extension);
    const RasterSpec spec =
        raster_spec(16, 16, std::string(extension) == ".exr" ? SampleType::kFloat32 : SampleType::kUint16);
    const auto samples = noise(spec);
    {
      const auto sink = create_raster(path, spec);
      EXPECT_TRUE(std::filesystem::exists(path + ".part"));
      sink->write_rows(std::span(samples).first(samples.size() / 2));
      EXPECT_THAT(error_of([&] { sink->finish(); }).what(), HasSubstr("finished after 8 of 16 rows"));
      EXPECT_EQ(error_of([&] { sink->write_rows(samples); }).code(), ErrorCode::kInvalidArgument);
      EXPECT_EQ(error_of([&] { sink->write_rows(std::span(samples).first(3)); }).code(), ErrorCode::kInvalidArgument);
      EXPECT_THAT(error_of([&] { (void)create_raster(path, spec); }).what(), HasSubstr("another process is writing"));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
    EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  }
}

TEST_F(RasterSink, ReplacesAFileOnlyWhenTold) {
  const std::string path = folder / "here.tif";
  RasterSpec spec = raster_spec(4, 4, SampleType::kInt16);
  write(path, spec, noise(spec), 4);
  const Error error = error_of([&] { (void)create_raster(path, spec); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(error.what(), path + ": exists; `overwrite` replaces it");
  spec.overwrite = true;
  { const auto abandoned = create_raster(path, spec); }
  EXPECT_EQ(open_raster(path, {})->info().width, 4);
  spec.width = 5;
  write_raster(path, spec, noise(spec));
  EXPECT_EQ(open_raster(path, {})->info().width, 5);
}

TEST_F(RasterSink, RefusesWhatItCannotWriteAndLeavesNothing) {
  const RasterSpec good = raster_spec(4, 4, SampleType::kFloat32);
  const Error error = error_of([&] { (void)create_raster(folder / "a.jpg", good); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.what(), HasSubstr("\".jpg\"; there are .tif .tiff .exr .png .hgt .asc .flt .r16 .raw .r32 .npy"));
  for (const auto& [name, bad] : {std::pair{"a", good},
                                  {"a.png", good},
                                  {"a.exr", raster_spec(4, 4, SampleType::kInt16)},
                                  {"a.tif", raster_spec(0, 4, SampleType::kInt16)},
                                  {"a.tif", raster_spec(4, 4, SampleType::kInt16, 2)}}) {
    EXPECT_EQ(code_of(folder / name, bad), ErrorCode::kInvalidArgument) << name;
  }
  EXPECT_EQ(code_of(folder / "none/a.tif", good), ErrorCode::kIo);
  std::filesystem::create_directory(folder / "folder.tif");
  EXPECT_THAT(error_of([&] { (void)create_raster(folder / "folder.tif", good); }).what(), HasSubstr("is a folder"));
  EXPECT_THAT(folder.names(), testing::ElementsAre("folder.tif"));
}

TEST_F(RasterSink, ReplacesOnlyItsOwnKind) {
  RasterSpec spec = placed(6, 4, SampleType::kFloat32, 10.0);
  spec.overwrite = true;
  const auto refused = [&](const std::string& name, const std::string& old, const std::string& raster) {
    write_file(folder / name, old);
    const Error error = error_of([&] { (void)create_raster(folder / raster, spec); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), HasSubstr(folder / name));
    EXPECT_EQ(read_file(folder / name), old) << "lost";
    std::filesystem::remove(folder / name);
  };
  refused("a.tif", "a text", "a.tif");
  refused("a.tif", "\x89PNG\r\n\x1a\n", "a.tif");
  refused("a.r32", "PK\x03\x04 an archive", "a.r32");
  refused("a.flt", std::string("II*\0\x08\0\0\0", 8), "a.flt");
  refused("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "a.flt");
  refused("a.hdr", "ENVI\nsamples = 4\n", "a.flt");
  refused("a.prj", "my project: buy milk\n", "a.asc");
  refused("a.r32.json", R"({"name": "somebody else's"})", "a.r32");
  write_file(folder / "b.tif", "");
  write(folder / "c.r32", spec, noise(spec), 4);
  for (const std::string name : {"b.tif", "c.r32"}) {
    write_raster(folder / name, spec, noise(spec));
  }
  EXPECT_EQ(open_raster(folder / "b.tif", {})->info().width, 6);
}

/// Renames that still happen before the program dies; negative: it does not.
int renames_until_death = -1;

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

TEST_F(RasterSink, ReportsADiskThatIsFull) {
  for (const std::string name : {"full.tif", "full.exr", "full.png", "N00E000.hgt", "full.asc", "full.npy"}) {
    const RasterSpec spec = raster_spec(1201, 1201,
                                        name == "full.exr"   ? SampleType::kFloat32
                                        : name == "full.png" ? SampleType::kUint16
                                                             : SampleType::kInt16);
    const auto samples = noise(spec);
    // Noise does not compress: each limit falls into the samples, the last one into what follows them.
    for (const std::size_t limit : {std::size_t{100}, samples.size() / 2, samples.size() - 1000}) {
      const FileSizeLimit full(limit);
      const Error error = error_of([&] { write_raster(folder / name, spec, samples); });
      EXPECT_EQ(error.code(), ErrorCode::kIo) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(folder / name));
      EXPECT_FALSE(std::filesystem::exists(folder / name));
      EXPECT_FALSE(std::filesystem::exists(folder / (name + ".part")));
    }
  }
}

TEST_F(RasterSink, RefusesWhatNoDiskHasRoomForAndLeavesNothing) {
  constexpr std::int64_t kSide = std::numeric_limits<std::int32_t>::max();
  for (const std::string name : {"a.npy", "a.flt", "a.r32", "a.asc", "a.tif", "a.exr"}) {
    for (const bool compress : {false, true}) {
      RasterSpec spec = raster_spec(kSide, kSide, SampleType::kFloat32);
      spec.compress = compress;
      const Error error = error_of([&] { (void)create_raster(folder / name, spec); });
      EXPECT_EQ(error.code(), ErrorCode::kIo) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(folder / name));
      EXPECT_THAT(error.what(), HasSubstr("B free in "));
    }
  }
  EXPECT_THAT(folder.names(), testing::IsEmpty());
  // Together where one alone would fit.
  RasterSpec spec = raster_spec(1, 1, SampleType::kFloat32);
  EXPECT_NO_THROW(check_raster_room(folder / "a.r32", spec));
  EXPECT_EQ(error_of([&] { check_raster_room(folder / "a.r32", spec, std::int64_t{1} << 60); }).code(), ErrorCode::kIo);
}

TEST_F(RasterSink, NeverLeavesOldSamplesBesideANewDescription) {
  RasterSpec spec = raster_spec(6, 4, SampleType::kUint16);
  const auto samples = noise(spec);
  write(folder / "a.r16", spec, samples, 4);
  const std::string old_description = read_file(folder / "a.r16.json");
  spec.overwrite = true;
  spec.z_scale = 0.25;
  const ::pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto sink = create_raster(folder / "a.r16", spec);
    sink->write_rows(samples);
    renames_until_death = 1;
    sink->finish();
    ::_exit(1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(WEXITSTATUS(status), 9);
  EXPECT_TRUE(!std::filesystem::exists(folder / "a.r16") || read_file(folder / "a.r16.json") == old_description);
  EXPECT_EQ(read_bytes(folder / "a.r16.part"), samples);  // nothing is lost
}

}  // namespace
}  // namespace isohf::test

// The program's own definition goes before the C library's.
extern "C" int rename(const char* from, const char* to) noexcept {
  using isohf::test::renames_until_death;
  if (renames_until_death == 0) ::_exit(9);
  if (renames_until_death > 0) --renames_until_death;
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0U));
}
