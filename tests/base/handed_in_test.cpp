#include "isohf/base/handed_in.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isohf/isohf.h"
#include "support/rasters/memory_source.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

/// Public functions given what makes no sense: one Error each, nothing else.
namespace isohf {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr std::int64_t kHuge = std::int64_t{1} << 62U;

template <typename Act>
std::string refusal(Act act, ErrorCode code = ErrorCode::kInvalidArgument) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  return "done";
}

using Source = test::MemorySource<float>;

std::unique_ptr<Source> waves(std::int64_t width = 64, std::int64_t height = 64) {
  auto source = std::make_unique<Source>(SampleType::kFloat32, width, height, [](std::int64_t c, std::int64_t r) {
    return 50.0 * std::sin(0.1 * static_cast<double>(c)) * std::cos(0.2 * static_cast<double>(r));
  });
  source->mutable_info().georeference.spacing_x = source->mutable_info().georeference.spacing_y = 10.0;
  return source;
}

VoidTreatment filling(const std::optional<std::int64_t>& distance) {
  VoidTreatment treatment;
  treatment.fill = true;
  treatment.fill_distance = distance;
  return treatment;
}

class HandedIn : public testing::Test {
 protected:
  /// What converting says of options or a source that were changed.
  [[nodiscard]] std::string converting(const std::function<void(ConvertOptions&, SourceInfo&)>& change) const {
    const auto source = waves();
    ConvertOptions options;
    change(options, source->mutable_info());
    return refusal([&] { (void)convert(*source, folder / "refused.isohf", options); });
  }
  [[nodiscard]] std::string archive() const {
    const std::string path = folder / "whole.isohf";
    if (!std::filesystem::exists(path)) (void)convert(*waves(), path);
    return path;
  }

  const test::TemporaryFolder folder;
};

TEST_F(HandedIn, LevelsOutsideOf1To14AreRefusedWithAndWithoutAShape) {
  for (const int levels : {0, -5, 15, 40}) {
    EXPECT_THAT(converting([&](auto& options, auto&) { options.plan.levels = levels; }), HasSubstr("must be 1 to 14"));
    EXPECT_THAT(converting([&](auto& options, auto&) { options.max_error = 1.0, options.plan.levels = levels; }),
                HasSubstr("must be 1 to 14"));
    const auto source = waves();
    ConvertOptions options;
    options.plan.levels = levels;
    EXPECT_THAT(refusal([&] { (void)estimate_error(*source, options); }), HasSubstr("must be 1 to 14"));
  }
}

TEST_F(HandedIn, LatticesThroughSamplesGoWithNothingThatMovesThem) {
  using Change = void (*)(PlanRequest&);
  for (const Change change :
       {Change([](PlanRequest& plan) { plan.fit = true; }), Change([](PlanRequest& plan) { plan.spacing = 2.0; }),
        Change([](PlanRequest& plan) { plan.density = 2.0; })}) {
    EXPECT_THAT(converting([&](auto& options, auto&) { options.plan.through_samples = true, change(options.plan); }),
                HasSubstr("a lattice through the samples goes with none of"));
  }
}

TEST_F(HandedIn, AcquisitionsAreHeldToTheirRules) {
  for (const double sigma : {kNan, kInf, -1.0, 0.0, 101.0, 1e300}) {
    EXPECT_THAT(converting([&](auto& options, auto&) {
                  options.acquisition.kind = Acquisition::Kind::kGaussian;
                  options.acquisition.sigma = sigma;
                }),
                HasSubstr("sigma must be a number above 0 and at most 100 source samples"));
  }
  EXPECT_THAT(converting([&](auto& options, auto&) {
                options.acquisition.kind = Acquisition::Kind::kTaps;
                options.acquisition.taps = {kNan};
              }),
              HasSubstr("they sum to nan"));
}

TEST_F(HandedIn, TapsOfAnySumKeepLevelGroundWhereItIs) {
  const auto source = std::make_unique<Source>(SampleType::kFloat32, 64, 64, [](auto, auto) { return 300.0; });
  ConvertOptions options;
  options.acquisition.kind = Acquisition::Kind::kTaps;
  options.acquisition.taps = {.1, 2.8, .1};
  const ConvertSummary summary = convert(*source, folder / "level.isohf", options);
  EXPECT_NEAR(summary.metadata.statistics.min.value(), 300.0, 1e-3);
  EXPECT_NEAR(summary.metadata.statistics.max.value(), 300.0, 1e-3);
}

TEST_F(HandedIn, NumbersThatAreNoEnumeratorsAreRefused) {
  const char* const kWhy = "must be a value of its type";
  EXPECT_THAT(converting([](auto& options, auto&) { options.code_type = CodeType(9); }), HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto& options, auto&) { options.filter = Filter(77); }), HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto& options, auto&) { options.filter = Filter(-1); }), HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto& options, auto&) { options.acquisition.kind = Acquisition::Kind(77); }),
              HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto& options, auto&) { options.plan.ground.projection.kind = ProjectionKind(77); }),
              HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto& options, auto&) {
                options.plan.budget = ShapeBudget{ShapeBudget::Kind(9), 10000};
              }),
              HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto&, SourceInfo& info) { info.sample_type = SampleType(77); }), HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto&, SourceInfo& info) { info.georeference.unit = HorizontalUnit(77); }),
              HasSubstr(kWhy));
  EXPECT_THAT(converting([](auto&, SourceInfo& info) { info.georeference.registration = Registration(77); }),
              HasSubstr(kWhy));
  const ArchiveReader reader(archive());
  ShadeOptions shading;
  shading.kind = ShadeKind(88);
  EXPECT_THAT(refusal([&] { (void)shade(reader, shading); }), HasSubstr(kWhy));
  EXPECT_THAT(refusal([&] { (void)shade_colours(reader.metadata(), ShadePalette(88)); }), HasSubstr(kWhy));
  const SampleGrid grid = source_grid(reader.metadata().source);
  EXPECT_THAT(refusal([&] { RowReader(reader, grid, RestoreMethod(9)); }), HasSubstr(kWhy));
  const auto other = waves();
  other->mutable_info().sample_type = SampleType(77);
  EXPECT_THAT(refusal([&] { (void)compare_with_source(reader, *other); }), HasSubstr(kWhy));
  EXPECT_THAT(refusal([&] { (void)check_vertices(reader, *other); }), HasSubstr(kWhy));
}

TEST_F(HandedIn, ArchivesThatNoReaderWouldTakeAreNotMade) {
  EXPECT_THAT(converting([](auto& options, auto&) { options.source_note.mosaic.emplace().files = -4; }),
              HasSubstr("cannot be read: metadata: source.mosaic.files: is -4"));
  EXPECT_THAT(converting([](auto& options, auto&) { options.producer = std::string(70U << 20U, 'x'); }),
              HasSubstr("can be read"));
  EXPECT_FALSE(std::filesystem::exists(folder / "refused.isohf"));
}

TEST_F(HandedIn, WindowsAndRoomOfRastersAndPhotosAreChecked) {
  const std::string tiff = std::string(ISOHF_SOURCE_DIR) + "/testdata/coast_512x384_int16.tif";
  const auto raster = open_raster(tiff, {});
  const auto filled = with_voids_treated(waves(), filling({}));
  const auto photo = open_photo(std::string(ISOHF_SOURCE_DIR) + "/docs/images/coast.png");
  const auto of = [](auto& source, const Window& window, std::size_t room) {
    return refusal([&] {
      std::vector<std::byte> bytes(room);
      if constexpr (requires { source->set_cache_bytes(0); }) {
        source->read_window(window, {reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()});
      } else {
        source->read_window(window, bytes);
      }
    });
  };
  const auto hold = [&](auto& source, std::size_t sample) {
    EXPECT_EQ(of(source, {0, 0, 10, 10}, 100 * sample), "done");
    EXPECT_EQ(of(source, {0, 0, 0, 0}, 0), "done");
    EXPECT_THAT(of(source, {0, 0, 10, 10}, 20), HasSubstr("found room for 20 bytes, must be"));
    for (const Window& window : {Window{-5, 0, 10, 10}, Window{0, 0, kHuge, kHuge}, Window{kHuge, 0, kHuge, 1},
                                 Window{5, 5, -1, -1}, Window{100000, 0, 10, 10}}) {
      EXPECT_THAT(of(source, window, 100 * sample), HasSubstr("must be within its"));
    }
  };
  hold(raster, sizeof(std::int16_t));
  hold(filled, sizeof(float));
  hold(photo, static_cast<std::size_t>(photo->info().channels));
}

TEST_F(HandedIn, RawLayoutsOfNoSizeAreRefusedForThat) {
  const std::string path = folder / "a.raw";
  test::write_file(path, "12345678");
  const auto said = [&](const RawLayout& layout) {
    OpenOptions options;
    options.raw = layout;
    return refusal([&] { (void)open_raster(path, options); });
  };
  EXPECT_EQ(said({-3, 5, SampleType::kUint8}),
            path + ": raw samples: found -3 x 5 samples, must be 1 to 2^40 either way, 2^59 at most");
  EXPECT_THAT(said({kHuge, kHuge, SampleType::kFloat64}), HasSubstr("must be 1 to 2^40"));
  EXPECT_THAT(said({2, 4, SampleType(77)}), HasSubstr("must be a value of its type"));
}

TEST_F(HandedIn, VoidTreatmentNeedsASourceAndADistance) {
  EXPECT_THAT(refusal([] { (void)with_voids_treated(nullptr, filling({})); }), HasSubstr("there is no source"));
  EXPECT_THAT(refusal([] { (void)with_voids_treated(nullptr, {}); }), HasSubstr("there is no source"));
  for (const std::int64_t distance : {std::int64_t{-3}, std::int64_t{4097}, kHuge}) {
    EXPECT_THAT(refusal([&] { (void)with_voids_treated(waves(), filling(distance)); }), HasSubstr("must be 0 to 4096"));
  }
}

TEST_F(HandedIn, PlacesInDegreesThatAreNoneAreRefusedAndRowsBeyondAPoleAreTold) {
  const auto in_degrees = [](double longitude, double latitude, double spacing_y) {
    return [=](ConvertOptions& options, SourceInfo& info) {
      options.plan.ground.projection.is_auto = false;
      options.plan.ground.projection.kind = ProjectionKind::kEquirectangular;
      options.strict = true;
      Georeference& place = info.georeference;
      place = {};
      place.unit = HorizontalUnit::kDegree;
      place.has_origin = true;
      place.origin_x = longitude;
      place.origin_y = latitude;
      place.spacing_x = 0.1;
      place.spacing_y = spacing_y;
    };
  };
  EXPECT_THAT(converting(in_degrees(0.0, 1005.0, 2000.0 / 63.0)),
              HasSubstr("the latitudes: found -995 to 1005 degrees, must be from -90 to 90"));
  EXPECT_THAT(converting(in_degrees(500000.0, 40.0, 0.1)), HasSubstr("the first longitude: found 500000 degrees"));
  EXPECT_THAT(converting(in_degrees(7.0, 4e6, 0.1)), HasSubstr("to 4000000 degrees"));
  const auto source = waves();
  ConvertOptions options;
  in_degrees(7.0, 92.0, 0.1)(options, source->mutable_info());
  EXPECT_THAT(refusal([&] { (void)convert(*source, folder / "pole.isohf", options); }, ErrorCode::kWarning),
              HasSubstr("there is no ground beyond 90"));
}

TEST_F(HandedIn, GridsTooLargeForMemoryAreAnErrorAndReadersNameTheRows) {
  const ArchiveReader reader(archive());
  SampleGrid grid = source_grid(reader.metadata().source);
  const SampleGrid usual = grid;
  grid.width = kMaxSide;
  grid.spacing_x = 600.0 / static_cast<double>(kMaxSide);
  // Some systems promise any memory; AddressSanitizer takes all addresses, and ends a program that asks for so much.
  rlimit usual_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &usual_limit), 0);
  const rlimit limit{std::min<rlim_t>(usual_limit.rlim_max, rlim_t{1} << 40U), usual_limit.rlim_max};
  if (!test::kSanitized) setrlimit(RLIMIT_AS, &limit);
  for (const RestoreMethod method : {RestoreMethod::kHex, RestoreMethod::kBarycentric, RestoreMethod::kAverage}) {
    if (test::kSanitized) continue;
    EXPECT_THAT(refusal([&] { RowReader(reader, grid, method); }, ErrorCode::kOutOfMemory),
                HasSubstr("samples: out of memory"));
  }
  if (!test::kSanitized) setrlimit(RLIMIT_AS, &usual_limit);
  grid.width = kHuge;
  EXPECT_THAT(refusal([&] { RowReader(reader, grid); }), HasSubstr("must be 1 to 2^40"));
  RowReader rows(reader, usual);
  std::vector<double> row(static_cast<std::size_t>(usual.width));
  EXPECT_EQ(refusal([&] { rows.read(2, -1, row); }),
            "-1 rows from row 2 on are asked for, of 64 the first 0 are behind; calls come in increasing order");
  EXPECT_THAT(refusal([&] { rows.read_all(nullptr); }), HasSubstr("there is no function"));
}

TEST_F(HandedIn, FunctionsOnArchivesRefuseWhatIsNotThere) {
  const ArchiveReader reader(archive());
  const Metadata& metadata = reader.metadata();
  EXPECT_THAT(refusal([&] { (void)metadata.plane_grid(-1); }), HasSubstr("plane -1"));
  EXPECT_THAT(refusal([&] { (void)metadata.plane_grid(99); }), HasSubstr("plane 99"));
  EXPECT_THAT(refusal([] { (void)severity_of(999); }), HasSubstr("no finding ISOHF-0999"));
  EXPECT_THAT(refusal([&] { (void)metadata.grid.shape().strip_index_count(-1); }), HasSubstr("level -1"));
  EXPECT_THAT(refusal([&] { (void)metadata.grid.shape().stitch_index_count(99); }), HasSubstr("level 99"));
  EXPECT_THAT(refusal([&] { (void)grid_over({0, 0, 1, 1}, true, {}, {}); }), HasSubstr("needs `size` or `spacing`"));
  EXPECT_THAT(refusal([&] { (void)grid_over({0, 0, 1, 1}, true, {}, 0.0); }), HasSubstr("`spacing` is 0"));
  EXPECT_THAT(refusal([&] { (void)grid_over({0, 0, 1, 1}, true, {}, 1e-300); }), HasSubstr("too many samples"));
  EXPECT_THAT(refusal([&] {
                (void)grid_in_system(metadata, {0, 0, 1, 1}, nullptr, GridSize{5, 5}, {});
              }),
              HasSubstr("no reference system"));
  EXPECT_THAT(refusal([&] { shade_rows(reader, {}, nullptr); }), HasSubstr("there is no function"));
  EXPECT_THAT(refusal([&] { subtract_archives(archive(), archive(), nullptr); }), HasSubstr("there is no function"));
}

}  // namespace
}  // namespace isohf
