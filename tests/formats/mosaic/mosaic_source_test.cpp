#include "formats/mosaic/mosaic_source.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "formats/mosaic/mosaic_pieces.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/error_of.h"
#include "support/in_folder.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr SampleType kAllTypes[] = {SampleType::kUint8,   SampleType::kInt8,    SampleType::kUint16,
                                    SampleType::kInt16,   SampleType::kUint32,  SampleType::kInt32,
                                    SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The samples as elevations, NaN where void.
std::vector<double> elevations(HeightSource& source, const Window& window) {
  const std::vector<std::byte> raw = read_window(source, window);
  std::vector<double> numbers(static_cast<std::size_t>(window.columns * window.rows));
  numbers_from_samples(SampleKind::of(source.info()), raw, numbers);
  for (double& number : numbers) number = number * source.info().z_scale + source.info().z_offset;
  return numbers;
}

std::vector<double> elevations(HeightSource& source) {
  return elevations(source, whole(source));
}

double at(const std::vector<double>& values, const HeightSource& source, std::int64_t column, std::int64_t row) {
  return values[static_cast<std::size_t>(row * source.info().width + column)];
}

std::string why_refused(const std::vector<std::string>& paths, const OpenOptions& options = {}) {
  try {
    static_cast<void>(plan_mosaic(paths, options));
  } catch (const Error& error) {
    return error.what();
  }
  return "not refused";
}

using MosaicSource = InFolder;

TEST_F(MosaicSource, PiecesGiveTheWholeBitForBitInEveryType) {
  for (const SampleType type : kAllTypes) {
    for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
      SCOPED_TRACE(to_string(type) + " " + to_string(registration));
      const TemporaryFolder own;
      const CutRaster raster = noise_raster(placed_spec(97, 61, type, registration));
      raster.cut(own / "whole.tif", {0, 0, 97, 61});
      std::vector<std::string> paths = write_pieces(raster, own / "", ragged_cut(97, 61, 5, 20));
      std::reverse(paths.begin(), paths.end());
      const auto mosaic = open_mosaic(paths);
      const SourceInfo& info = mosaic->info();
      const SourceInfo original = open_raster(own / "whole.tif", {})->info();
      EXPECT_EQ(info.width, 97);
      EXPECT_EQ(info.height, 61);
      EXPECT_EQ(info.sample_type, type);
      EXPECT_EQ(grid_of(info.georeference), grid_of(original.georeference));
      EXPECT_EQ(info.georeference.registration, registration);
      EXPECT_EQ(info.georeference.system.epsg, 32632);
      EXPECT_EQ(info.format, original.format);
      EXPECT_EQ(info.warnings, std::vector<Warning>());
      EXPECT_EQ(mosaic->plan().samples_missing, 0);
      EXPECT_TRUE(read_whole(*mosaic) == raster.samples);
    }
  }
}

TEST_F(MosaicSource, AnyWindowInAnyOrderIsThatOfTheWhole) {
  const CutRaster raster = noise_raster(placed_spec(150, 130, SampleType::kInt16, Registration::kArea));
  const auto mosaic = open_mosaic(write_pieces(raster, folder / "", ragged_cut(150, 130, 8, 30)));
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    Window window;
    window.column = i % 3 == 0 ? 0 : static_cast<std::int64_t>(random() % 150);
    window.columns = i % 3 == 0 ? 150 : 1 + static_cast<std::int64_t>(random()) % (150 - window.column);
    window.row = static_cast<std::int64_t>(random() % 130);
    window.rows = 1 + static_cast<std::int64_t>(random()) % (130 - window.row);
    ASSERT_TRUE(read_window(*mosaic, window) == raster.part(window)) << "seed 3, window " << i;
  }
}

TEST_F(MosaicSource, DegreeTilesShareTheirPosts) {
  // 61 posts a degree; two by two tiles.
  const auto height = [](std::int64_t c, std::int64_t r) { return static_cast<int>(c * 7 + r * 131) % 3000 - 40; };
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      std::string bytes;
      for (int r = 0; r < 61; ++r) {
        for (int c = 0; c < 61; ++c) {
          const int value = height(column * 60 + c, row * 60 + r);
          bytes += static_cast<char>((value >> 8) & 0xFF);
          bytes += static_cast<char>(value & 0xFF);
        }
      }
      const std::string name = "N" + std::to_string(45 - row) + "E00" + std::to_string(6 + column) + ".hgt";
      write_file(folder / name, bytes);
    }
  }
  const auto mosaic =
      open_mosaic({folder / "N44E006.hgt", folder / "N45E007.hgt", folder / "N45E006.hgt", folder / "N44E007.hgt"});
  EXPECT_EQ(mosaic->info().width, 121);
  EXPECT_EQ(mosaic->info().height, 121);
  EXPECT_EQ(mosaic->info().georeference.origin_x, 6.0);
  EXPECT_EQ(mosaic->info().georeference.origin_y, 46.0);
  EXPECT_EQ(mosaic->plan().samples_missing, 0);
  const std::vector<double> found = elevations(*mosaic);
  for (std::int64_t r = 0; r < 121; ++r) {
    for (std::int64_t c = 0; c < 121; ++c) ASSERT_EQ(at(found, *mosaic, c, r), height(c, r)) << c << " " << r;
  }
}

TEST_F(MosaicSource, BothSidesOfThe180thMeridianJoin) {
  for (const auto& [name, value] : {std::pair("N10E179.hgt", 1), std::pair("N10W180.hgt", 2)}) {
    std::string bytes;
    for (int i = 0; i < 11 * 11; ++i) bytes += {'\0', static_cast<char>(value)};
    write_file(folder / name, bytes);
  }
  const auto mosaic = open_mosaic({folder / "N10W180.hgt", folder / "N10E179.hgt"});
  EXPECT_EQ(mosaic->info().width, 21);
  EXPECT_EQ(mosaic->info().height, 11);
  EXPECT_EQ(mosaic->info().georeference.origin_x, 179.0);
  const std::vector<double> found = elevations(*mosaic);
  EXPECT_EQ(at(found, *mosaic, 9, 5), 1.0);
  EXPECT_EQ(at(found, *mosaic, 10, 5), 1.0) << "the shared post is the last file's";
  EXPECT_EQ(at(found, *mosaic, 11, 5), 2.0);
}

TEST_F(MosaicSource, MissingTilesAreVoidAndCounted) {
  std::vector<std::string> paths;
  for (const char* name : {"N45E006.hgt", "N45E008.hgt", "N44E007.hgt", "N44E006.hgt"}) {
    std::string bytes;
    for (int i = 0; i < 11 * 11; ++i) bytes += {'\1', '\0'};
    paths.push_back(folder / name);
    write_file(paths.back(), bytes);
  }
  const auto mosaic = open_mosaic(paths);
  const std::vector<double> found = elevations(*mosaic);
  const auto voids = std::ranges::count_if(found, [](double z) { return std::isnan(z); });
  EXPECT_EQ(mosaic->plan().samples_missing, voids);
  EXPECT_EQ(voids, 9 * 10 + 10 * 10);
  EXPECT_THAT(mosaic->info().warnings.back(), HasSubstr("190 samples lie in no file, the first at x "));
}

TEST_F(MosaicSource, GroundInNoFileOfARaggedCutIsCounted) {
  RasterSpec spec = placed_spec(90, 70, SampleType::kInt16, Registration::kArea);
  spec.void_value = -9999.0;
  const CutRaster raster = raster_of<std::int16_t>(spec, [](auto c, auto r) { return c + 100 * r; });
  std::vector<Window> windows = ragged_cut(90, 70, 4, 15);
  std::int64_t left_out = 0;
  for (int i = 0; i < 3; ++i) {
    left_out += windows.back().columns * windows.back().rows;
    windows.pop_back();
  }
  windows.push_back({0, 0, 2, 2});  // so that the whole keeps its corners
  windows.push_back({88, 68, 2, 2});
  const auto mosaic = open_mosaic(write_pieces(raster, folder / "", windows));
  ASSERT_EQ(mosaic->info().width, 90);
  std::int64_t voids = 0;
  std::vector<double> found = elevations(*mosaic);
  for (std::int64_t r = 0; r < 70; ++r) {
    for (std::int64_t c = 0; c < 90; ++c) {
      if (std::isnan(at(found, *mosaic, c, r))) {
        ++voids;
      } else {
        ASSERT_EQ(at(found, *mosaic, c, r), static_cast<double>(c + 100 * r));
      }
    }
  }
  EXPECT_EQ(mosaic->plan().samples_missing, voids);
  EXPECT_LE(voids, left_out);
  EXPECT_GT(voids, left_out - 8);
  EXPECT_THAT(mosaic->info().warnings, ElementsAre(HasSubstr("samples lie in no file, the first at x ")));
}

TEST_F(MosaicSource, IntegersWithoutAVoidGetALargerTypeForGaps) {
  const CutRaster raster = noise_raster(placed_spec(30, 10, SampleType::kUint16, Registration::kArea));
  const auto mosaic = open_mosaic(write_pieces(raster, folder / "", {{0, 0, 10, 10}, {20, 0, 10, 10}}));
  EXPECT_EQ(mosaic->info().sample_type, SampleType::kInt32);
  EXPECT_THAT(mosaic->info().warnings, ElementsAre(HasSubstr("100 samples lie in no file"),
                                                   HasSubstr("uint16 has no number to spare for voids")));
  const std::vector<double> found = elevations(*mosaic);
  for (std::int64_t c = 0; c < 30; ++c) {
    EXPECT_EQ(std::isnan(at(found, *mosaic, c, 3)), c >= 10 && c < 20);
  }
}

TEST_F(MosaicSource, OverlapShowsTheLastOrTheFirstAndVoidsWhatLiesBelow) {
  RasterSpec spec = placed_spec(20, 4, SampleType::kInt16, Registration::kArea);
  spec.void_value = -1.0;
  raster_of<std::int16_t>(spec, [](auto c, auto) {
    return c == 12 || c == 13 ? -1 : 100;
  }).cut(folder / "a.tif", {0, 0, 15, 4});
  raster_of<std::int16_t>(spec, [](auto c, auto) {
    return c == 11 || c == 13 ? -1 : 200;
  }).cut(folder / "b.tif", {10, 0, 10, 4});
  for (const OverlapRule rule : {OverlapRule::kLast, OverlapRule::kFirst}) {
    const auto mosaic = open_mosaic({folder / "a.tif", folder / "b.tif"}, rule);
    const std::vector<double> found = elevations(*mosaic);
    const double upper = rule == OverlapRule::kLast ? 200.0 : 100.0;
    EXPECT_EQ(at(found, *mosaic, 9, 1), 100.0);
    EXPECT_EQ(at(found, *mosaic, 10, 1), upper);
    EXPECT_EQ(at(found, *mosaic, 11, 1), 100.0) << "void in b";
    EXPECT_EQ(at(found, *mosaic, 12, 1), 200.0) << "void in a";
    EXPECT_TRUE(std::isnan(at(found, *mosaic, 13, 1)));
    EXPECT_EQ(at(found, *mosaic, 14, 1), upper);
    EXPECT_EQ(at(found, *mosaic, 15, 1), 200.0);
  }
}

TEST_F(MosaicSource, RoundedOriginsAreSnappedAndReported) {
  CutRaster raster = raster_of<float>(placed_spec(40, 10, SampleType::kFloat32, Registration::kArea),
                                      [](auto c, auto r) { return 0.25 * static_cast<double>(c + r); });
  raster.spec.overwrite = true;
  raster.cut(folder / "a.tif", {0, 0, 20, 10});
  const double origin_x = raster.spec.georeference->origin_x;
  // A thousandth of a sample is rounding and not a loss.
  for (const auto& [off, kind] : {std::pair{0.005, Warning::Kind::kNote}, {0.02, Warning::Kind::kLoss}}) {
    raster.spec.georeference->origin_x = origin_x + off * 30.0;
    raster.cut(folder / "b.tif", {20, 0, 20, 10});
    const auto mosaic = open_mosaic({folder / "a.tif", folder / "b.tif"});
    EXPECT_THAT(mosaic->info().warnings, ElementsAre(HasSubstr(fmt::format("{} of a sample off", off))));
    EXPECT_EQ(mosaic->info().warnings[0].kind, kind);
    EXPECT_TRUE(read_whole(*mosaic) == raster.samples);
  }
  raster.spec.georeference->origin_x = origin_x + 0.22 * 30.0;
  raster.cut(folder / "b.tif", {20, 0, 20, 10});
  EXPECT_THAT(why_refused({folder / "a.tif", folder / "b.tif"}),
              HasSubstr("b.tif: lies 0.22 of a sample off the grid of the other files of its resolution in x, at most "
                        "0.05 is taken as rounding; resample"));
}

/// Companions of elevations, which products ship in the same folder.
TEST_F(MosaicSource, FilesOverTheSameGroundAreNeverHiddenSilently) {
  RasterSpec spec = placed_spec(20, 10, SampleType::kInt16, Registration::kArea);
  spec.overwrite = true;
  const auto names_in = [&](const std::vector<std::string>& names) {
    std::vector<std::string> paths;
    for (const std::string& name : names) {
      const bool is_first = paths.empty();
      raster_of<std::int16_t>(spec, [&](auto, auto) {
        return is_first ? 500 : 7;
      }).cut(paths.emplace_back(folder / name), {0, 0, 20, 10});
    }
    return paths;
  };
  // The first one is what a user means.
  const std::vector<std::vector<std::string>> products = {
      {"ASTGTMV003_N44E006_dem.tif", "ASTGTMV003_N44E006_num.tif"},
      {"ALPSMLC30_N044E006_DSM.tif", "ALPSMLC30_N044E006_MSK.tif", "ALPSMLC30_N044E006_STK.tif"},
      {"Copernicus_DSM_COG_10_N44_00_E006_00_DEM.tif", "Copernicus_DSM_COG_10_N44_00_E006_00_HEM.tif",
       "Copernicus_DSM_COG_10_N44_00_E006_00_WBM.tif"},
      {"TDM1_DEM__30_N44E006_DEM.tif", "TDM1_DEM__30_N44E006_AMP.tif", "TDM1_DEM__30_N44E006_COV.tif"},
      {"14_51_1_1_2m_v4.1_dem.tif", "14_51_1_1_2m_v4.1_count.tif", "14_51_1_1_2m_v4.1_mad.tif"},
      {"SETSM_s2s041_2m_dem.tif", "SETSM_s2s041_2m_matchtag.tif", "SETSM_s2s041_2m_bitmask.tif"},
      {"n40e005_elv.tif", "n40e005_wth.tif"},
      {"gebco_2023_n90.0_s0.0.tif", "gebco_2023_tid_n90.0_s0.0.tif"},
      {"n44e006.tif", "n44e006_num.tif", "n44e006_meta.tif"},
      {"run-DEM.tif", "run-IntersectionErr.tif"}};
  for (const std::vector<std::string>& names : products) {
    SCOPED_TRACE(names[0]);
    const auto mosaic = open_mosaic(names_in(names));
    EXPECT_EQ(elevations(*mosaic)[0], 500.0);
    EXPECT_THAT(mosaic->info().warnings, ElementsAre(HasSubstr(folder / names[1])));
    EXPECT_EQ(mosaic->info().warnings[0].kind, Warning::Kind::kLoss);
  }
  // Companions alone are what is meant, and names that nobody knows are named.
  EXPECT_THAT(open_mosaic(names_in({"a_num.tif"}))->info().warnings, ElementsAre());
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"a.tif", "b.tif"}, {"x_num.tif", "y_hem.tif"}}) {
    const std::vector<Warning> warnings = open_mosaic(names_in(names))->info().warnings;
    EXPECT_THAT(warnings, ElementsAre(HasSubstr(folder / names[0] + " and " + (folder / names[1]) +
                                                " lie over exactly the same ground")));
    EXPECT_EQ(warnings[0].kind, Warning::Kind::kLoss);
  }
}

TEST_F(MosaicSource, FilesThatDisagreeAreRefusedByName) {
  const RasterSpec spec = placed_spec(20, 10, SampleType::kFloat32, Registration::kArea);
  raster_of<float>(spec, [](auto, auto) { return 1.0; }).cut(folder / "a.tif", {0, 0, 10, 10});
  const auto refused = [&](const std::function<void(RasterSpec&)>& change) {
    RasterSpec other = spec;
    change(other);
    std::filesystem::remove(folder / "b.tif");
    raster_of<float>(other, [](auto, auto) { return 1.0; }).cut(folder / "b.tif", {10, 0, 10, 10});
    return why_refused({folder / "a.tif", folder / "b.tif"});
  };
  EXPECT_EQ(refused([](RasterSpec&) {}), "not refused");
  EXPECT_THAT(refused([](RasterSpec& b) { b.georeference->system.epsg = 32633; }),
              HasSubstr("b.tif: its reference system is EPSG:32633, that of"));
  EXPECT_THAT(refused([](RasterSpec& b) { b.vertical_unit = "foot"; }),
              HasSubstr("b.tif: its elevations are in foot, those of " + (folder / "a.tif") +
                        " in a unit that nothing states"));
  EXPECT_EQ(refused([](RasterSpec& b) { b.vertical_unit = "metre"; }), "not refused");
  EXPECT_THAT(refused([](RasterSpec& b) { b.georeference->registration = Registration::kPoint; }),
              HasSubstr("b.tif: its samples stand for points"));
  EXPECT_THAT(refused([](RasterSpec& b) {
                b.georeference->unit = HorizontalUnit::kDegree;
                b.georeference->system.epsg = 4326;
              }),
              HasSubstr("b.tif: its coordinates are in degrees"));
  std::filesystem::remove(folder / "b.tif");
  RasterSpec unplaced = spec;
  unplaced.georeference.reset();
  write_raster(folder / "b.tif", unplaced, std::vector<std::byte>(20 * 10 * 4));
  EXPECT_THAT(why_refused({folder / "a.tif", folder / "b.tif"}), HasSubstr("b.tif: does not say where it lies"));
  EXPECT_THAT(why_refused({folder / "a.tif", folder / "a.tif"}), HasSubstr("a.tif: is named twice"));
  std::filesystem::create_symlink(folder / "a.tif", folder / "link.tif");
  EXPECT_THAT(why_refused({folder / "a.tif", folder / "link.tif"}), HasSubstr("link.tif: is the same file as"));
  EXPECT_THAT(why_refused({folder / "a.tif", folder / "none.tif"}), HasSubstr("none.tif: no such file"));
}

TEST_F(MosaicSource, TellsTheGapsBetweenItsFiles) {
  const RasterSpec spec = placed_spec(40, 30, SampleType::kFloat32, Registration::kArea);
  raster_of<float>(spec, [](auto, auto) { return 1.0; }).cut(folder / "a.tif", {0, 0, 10, 10});
  raster_of<float>(spec, [](auto, auto) { return 2.0; }).cut(folder / "b.tif", {30, 20, 10, 10});
  const std::unique_ptr<HeightSource> mosaic = open_mosaic({folder / "a.tif", folder / "b.tif"});
  int gaps = 0;
  for (std::int64_t row = 0; row < 28; row += 3) {
    for (std::int64_t column = 0; column < 37; column += 3) {
      const Window window{column, row, 3, 2};
      std::vector<float> samples(6);
      mosaic->read_window(window, std::as_writable_bytes(std::span(samples)));
      const bool is_void = std::ranges::all_of(samples, [](float sample) { return std::isnan(sample); });
      EXPECT_EQ(mosaic->is_gap(window), is_void) << column << " " << row;
      gaps += is_void ? 1 : 0;
    }
  }
  EXPECT_GT(gaps, 60);
}

TEST_F(MosaicSource, HeightsAreNamedAlikeWhicheverFileComesFirst) {
  RasterSpec spec = placed_spec(30, 10, SampleType::kFloat32, Registration::kArea);
  const auto cut = [&](const char* name, std::int64_t column, const char* datum, std::optional<int> code) {
    spec.georeference->system.vertical_datum = datum;
    spec.georeference->system.vertical_epsg = code;
    raster_of<float>(spec, [](auto, auto) { return 1.0; }).cut(folder / name, {column, 0, 10, 10});
  };
  cut("named.tif", 0, "EGM96", std::nullopt);  // as .hgt files say it
  cut("coded.tif", 10, "EGM96 height", 5773);
  cut("silent.tif", 20, "", std::nullopt);
  std::vector<std::string> files = {folder / "coded.tif", folder / "named.tif", folder / "silent.tif"};
  do {
    const ReferenceSystem system = open_mosaic(files)->info().georeference.system;
    EXPECT_EQ(system.vertical_datum, "EGM96 height") << files[0];
    EXPECT_EQ(system.vertical_epsg, 5773);
  } while (std::next_permutation(files.begin(), files.end()));
  cut("other.tif", 20, "NAVD88 height", 5703);
  for (const auto& both : {std::vector{"named.tif", "other.tif"}, std::vector{"other.tif", "named.tif"}}) {
    EXPECT_THAT(why_refused({folder / both[0], folder / both[1]}), HasSubstr("its vertical datum is"));
  }
}

TEST_F(MosaicSource, AChangedOrBrokenMemberIsAnErrorThatNamesIt) {
  const CutRaster raster = noise_raster(placed_spec(40, 10, SampleType::kInt16, Registration::kArea));
  const std::vector<std::string> paths = write_pieces(raster, folder / "", {{0, 0, 20, 10}, {20, 0, 20, 10}});
  const auto mosaic = open_mosaic(paths);
  std::filesystem::resize_file(paths[1], std::filesystem::file_size(paths[1]) - 7);
  const Error error = error_of([&] { (void)read_whole(*mosaic); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_THAT(error.what(), HasSubstr("piece1.tif: was changed or replaced while it was read"));
  std::filesystem::remove(paths[1]);
  EXPECT_THROW(static_cast<void>(read_whole(*mosaic)), Error);
}

TEST_F(MosaicSource, CountsWhatItKeepsWithinWhatItMay) {
  const CutRaster raster = noise_raster(placed_spec(400, 300, SampleType::kInt16, Registration::kArea));
  const std::vector<std::string> paths = write_pieces(raster, folder / "", regular_cut(400, 300, 100));
  std::uint64_t more = UINT64_MAX;
  for (const std::uint64_t bytes : {std::uint64_t{256} << 20U, std::uint64_t{100000}, std::uint64_t{1}}) {
    OpenOptions options;
    options.buffer_bytes = bytes;
    const auto mosaic = open_mosaic(paths, OverlapRule::kLast, options);
    EXPECT_TRUE(read_whole(*mosaic) == raster.samples);
    const auto strip = static_cast<std::uint64_t>(mosaic->info().block_height * mosaic->info().width * 2);
    EXPECT_GE(mosaic->buffer_bytes(), 2 * strip);
    EXPECT_LE(mosaic->buffer_bytes(), more);
    more = mosaic->buffer_bytes();
  }
}

TEST_F(MosaicSource, EveryMemberIsOpenedOnceInAPassOverSmallOnes) {
  const CutRaster raster = noise_raster(placed_spec(160, 160, SampleType::kInt16, Registration::kArea));
  const auto mosaic = open_mosaic(write_pieces(raster, folder / "", regular_cut(160, 160, 16)));
  ASSERT_EQ(mosaic->plan().layers.front().members.size(), 100U);
  for (std::int64_t row = 0; row < 160; row += 7) {  // bands that end anywhere
    const Window window{0, row, 160, std::min<std::int64_t>(7, 160 - row)};
    ASSERT_TRUE(read_window(*mosaic, window) == raster.part(window)) << row;
  }
  EXPECT_EQ(mosaic->times_opened(), 100);
  std::size_t open = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    open += target.find("piece") != std::string::npos ? 1 : 0;
  }
  EXPECT_LE(open, most_open_rasters());
  EXPECT_GT(open, 0U);
}

}  // namespace
}  // namespace isohf::test
