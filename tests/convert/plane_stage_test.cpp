#include "isohf/convert/stages/plane_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "isohf/archive.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/shade.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "support/altered_archive.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Hills with a lake of voids, wide enough for planes of 12x19 tiles.
class Hills : public test::MemorySource<float> {
 public:
  Hills()
      : MemorySource(SampleType::kFloat32, 210, 150, [](std::int64_t c, std::int64_t r) {
          const auto x = static_cast<double>(c);
          const auto z = static_cast<double>(r);
          if (std::hypot(x - 60.0, z - 40.0) < 25.0) return std::numeric_limits<double>::quiet_NaN();
          return 300.0 + 20.0 * std::sin(x * 0.05) * std::cos(z * 0.04) + 3.0 * std::sin(x * 0.6 + z * 0.3);
        }) {}
};

ConvertOptions options_of(CodeType type = CodeType::kU16) {
  ConvertOptions options;
  options.plan.shape = {12, 19};
  options.plan.levels = 2;
  options.code_type = type;
  options.overwrite = true;
  options.producer = "isohf test";
  options.z_range = {270.0, 330.0};
  return options;
}

std::set<int> findings_in(const std::string& archive) {
  std::set<int> ids;
  for (const Finding& found : verify_archive(archive).findings) ids.insert(found.id);
  return ids;
}

TEST(PlaneStage, PlanesOfEveryCodeTypePassVerify) {
  const test::TemporaryFolder folder;
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    Hills source;
    const ConvertSummary summary = convert(source, folder / "a.isohf", options_of(type));
    EXPECT_GT(summary.plane_bytes, 0U);
    EXPECT_EQ(summary.metadata.planes, (PlaneInfo{8, 2}));
    const Planes planes = planes_of(summary.metadata);
    for (int plane = 1; plane <= planes.count(); ++plane) {
      EXPECT_EQ(summary.metadata.plane_grid(plane), planes.grid(plane));
    }
    EXPECT_EQ(findings_in(folder / "a.isohf"), std::set<int>());
  }
}

TEST(PlaneStage, VerifyFindsWhatIsNotThatOfTheTilesBelow) {
  const test::TemporaryFolder folder;
  Hills source;
  (void)convert(source, folder / "a.isohf", options_of());
  for (const bool is_there : {true, false}) {
    test::AlteredArchive altered(folder / "a.isohf");
    if (is_there) altered.set("planes/1/0/1.tile", altered.bytes("planes/1/0/2.tile"));
    if (!is_there) altered.remove("planes/2/0/0.tile");
    altered.write(folder / "b.isohf");
    EXPECT_TRUE(findings_in(folder / "b.isohf").count(finding::kPlane)) << is_there;
  }
}

TEST(PlaneStage, VerifyFindsARangeThatIsNotThatOfAllBelow) {
  const test::TemporaryFolder folder;
  Hills source;
  (void)convert(source, folder / "a.isohf", options_of());
  const TileEntry entry = ArchiveReader(folder / "a.isohf").tile_entry({1, 0}, 1);
  for (const auto& [low, high] :
       {std::pair{entry.code_min + 1, entry.code_max}, {entry.code_min, entry.code_max - 1}}) {
    test::AlteredArchive altered(folder / "a.isohf");
    altered.ranges["planes/1/0/1.tile"] = {low, high};
    altered.write(folder / "b.isohf");
    EXPECT_EQ(findings_in(folder / "b.isohf"), std::set<int>{finding::kPlaneRange});
  }
}

/// Counts what is read of a file.
class CountedFile : public ByteSource {
 public:
  explicit CountedFile(const std::string& path) : file_(open_file_source(path)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return file_->size_bytes(); }
  std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    bytes += out.size();
    return file_->read(offset_bytes, out);
  }
  mutable std::atomic<std::uint64_t> bytes = 0;

 private:
  std::shared_ptr<const ByteSource> file_;
};

/// Waves, and finer ones on them; 1200 x 900 samples.
double wave(double x, double z) {
  return 300.0 + 90.0 * std::sin(x * 0.011) * std::cos(z * 0.013) + 0.2 * std::sin(x * 1.7) * std::sin(z * 1.1);
}

void convert_waves(const std::string& path, ConvertOptions options) {
  test::MemorySource<float> source(SampleType::kFloat32, 1200, 900, [](std::int64_t c, std::int64_t r) {
    return wave(static_cast<double>(c), static_cast<double>(r));
  });
  options.plan.shape = {36, 35};
  (void)convert(source, path, options);
}

std::vector<double> rows_of(const ArchiveReader& archive, const SampleGrid& grid, RestoreMethod method) {
  std::vector<double> all;
  RowReader(archive, grid, method).read_all([&](std::int64_t, std::span<const double> rows) {
    all.insert(all.end(), rows.begin(), rows.end());
  });
  return all;
}

TEST(PlaneStage, RowsFarApartAreReadFromThePlaneThatSuffices) {
  const test::TemporaryFolder folder;
  convert_waves(folder / "a.isohf", {});
  const auto file = std::make_shared<CountedFile>(folder / "a.isohf");
  const ArchiveReader archive(file, "a.isohf");
  const Metadata& metadata = archive.metadata();
  const SampleGrid few = grid_over(metadata.valid, true, GridSize{4, 3}, {});
  ASSERT_EQ(usual_method(metadata, few), RestoreMethod::kPlane);
  file->bytes = 0;
  const std::vector<double> of_plane = rows_of(archive, few, RestoreMethod::kPlane);
  EXPECT_LT(file->bytes * 20, archive.size_bytes());
  const std::vector<double> of_tiles = rows_of(archive, few, RestoreMethod::kAverage);
  for (std::size_t i = 0; i < of_plane.size(); ++i)
    EXPECT_NEAR(of_plane[i], of_tiles[i], 2.0) << i << ": waves of 180, a hundredth of that";
}

TEST(PlaneStage, RowsByAverageAreTheMeansOfTheSource) {
  const test::TemporaryFolder folder;
  convert_waves(folder / "a.isohf", {});
  const ArchiveReader archive(folder / "a.isohf");
  // 20 x 25 samples of the source each.
  const SampleGrid grid = {60, 36, archive.metadata().valid.x0 + 9.5, archive.metadata().valid.z0 + 12.0, 20.0, 25.0};
  const std::vector<double> found = rows_of(archive, grid, RestoreMethod::kAverage);
  for (std::int64_t row = 0; row < grid.height; ++row) {
    for (std::int64_t column = 0; column < grid.width; ++column) {
      const double mean = found[static_cast<std::size_t>(row * grid.width + column)];
      double sum = 0.0;
      for (int z = 0; z < 25; ++z) {
        for (int x = 0; x < 20; ++x) {
          sum += wave(static_cast<double>(column * 20 + x), static_cast<double>(row * 25 + z));
        }
      }
      // The surface ends on the middle of the source's first and last samples: half of those does not count.
      const bool is_whole = column > 0 && column < 59 && row > 0 && row < 35;
      ASSERT_NEAR(mean, sum / 500.0, is_whole ? 0.02 : 0.5) << column << " " << row;
    }
  }
  // However many rows are read at once.
  RowReader some(archive, grid, RestoreMethod::kAverage);
  std::vector<double> rows(static_cast<std::size_t>(7 * grid.width));
  some.read(3, 7, rows);
  EXPECT_TRUE(
      std::ranges::equal(rows, std::span(found).subspan(static_cast<std::size_t>(3 * grid.width), rows.size())));
}

TEST(PlaneStage, RowsThatNoPlaneSufficesForAreReadFromTheTiles) {
  const test::TemporaryFolder folder;
  convert_waves(folder / "a.isohf", {});
  const ArchiveReader archive(folder / "a.isohf");
  const TileGrid& tiles = archive.metadata().grid;
  const auto usual = [](const Metadata& metadata, double columns, double rows) {
    return usual_method(metadata, {9, 9, 0.0, 0.0, columns, rows});
  };
  EXPECT_EQ(usual(archive.metadata(), 511 * tiles.sigma_x(), 320 * tiles.sigma_z()), RestoreMethod::kAverage);
  EXPECT_EQ(usual(archive.metadata(), 640 * tiles.sigma_x(), 255 * tiles.sigma_z()), RestoreMethod::kAverage);
  EXPECT_EQ(usual(archive.metadata(), 640 * tiles.sigma_x(), 320 * tiles.sigma_z()), RestoreMethod::kPlane);
  const SourceRecord& source = archive.metadata().source;
  EXPECT_EQ(usual(archive.metadata(), 1.5 * source.spacing_x, source.spacing_z), RestoreMethod::kAverage);
  EXPECT_EQ(usual(archive.metadata(), source.spacing_x, 1.5 * source.spacing_z), RestoreMethod::kAverage);
  EXPECT_EQ(usual(archive.metadata(), 1.49 * source.spacing_x, 1.49 * source.spacing_z), RestoreMethod::kHex);
  ConvertOptions options;
  options.planes = false;
  convert_waves(folder / "b.isohf", options);
  EXPECT_EQ(usual(ArchiveReader(folder / "b.isohf").metadata(), 400.0, 400.0), RestoreMethod::kAverage);
}

TEST(PlaneStage, RowsOfAPlaneEndWhereTheSurfaceDoes) {
  const test::TemporaryFolder folder;
  convert_waves(folder / "a.isohf", {});
  const ArchiveReader archive(folder / "a.isohf");
  const WorldBounds& ground = archive.metadata().valid;
  const double step = 65 * 8 * archive.grid().sigma_x();
  const auto across = static_cast<std::int64_t>(ground.x1 / step) + 3;
  const auto down = static_cast<std::int64_t>(ground.z1 / step) + 3;
  const std::vector<double> rows = rows_of(archive, {across, down, 0.0, 0.0, step, step}, RestoreMethod::kPlane);
  for (std::int64_t r = 0; r < down; ++r) {
    for (std::int64_t c = 0; c < across; ++c) {
      const double beyond = std::max((static_cast<double>(c) - 0.5) * step - ground.x1,
                                     (static_cast<double>(r) - 0.5) * step - ground.z1);
      if (beyond < 0.0 && beyond > -step / 8.0) continue;  // the places whose mean it is lie an eighth apart
      EXPECT_EQ(std::isnan(rows[static_cast<std::size_t>(r * across + c)]), beyond > 0.0) << c << " " << r;
    }
  }
}

TEST(PlaneStage, ShadeReadsThePlaneThatSuffices) {
  const test::TemporaryFolder folder;
  convert_waves(folder / "a.isohf", {});
  const auto file = std::make_shared<CountedFile>(folder / "a.isohf");
  const ArchiveReader archive(file, "a.isohf");
  ASSERT_EQ(archive.metadata().planes.stride, 8);
  ShadeOptions request;
  request.sun_elevation_deg = 30.0;
  request.size = GridSize{60, 45};
  file->bytes = 0;
  int plane = 0;
  Picture coarse(60, 45, 4);
  std::size_t at = 0;
  plane = shade_rows(archive, request, [&](std::span<const std::byte> rows) {
            std::memcpy(coarse.samples.data() + at, rows.data(), rows.size());
            at += rows.size();
          }).plane;
  EXPECT_EQ(plane, 1);
  EXPECT_LT(file->bytes * 10, archive.size_bytes());
  // The ground is drawn to its edge, and looks as the tiles themselves do.
  ConvertOptions options;
  options.planes = false;
  convert_waves(folder / "b.isohf", options);
  const Picture fine = shade(ArchiveReader(folder / "b.isohf"), request);
  double sum = 0.0;
  for (std::size_t i = 0; i < coarse.samples.size(); ++i) {
    if (i % 4 == 3) {
      ASSERT_EQ(coarse.samples[i], 255);
    }
    sum += std::abs(int{coarse.samples[i]} - int{fine.samples[i]});
  }
  EXPECT_LT(sum / static_cast<double>(coarse.samples.size()), 4.0) << "of 255";
}

}  // namespace
}  // namespace isohf
