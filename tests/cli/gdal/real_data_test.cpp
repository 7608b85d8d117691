/// Real elevation files become archives that pass every check and lie close to their source.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/real_files.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

TEST(RealData, ConvertsAndPassesEveryCheck) {
  const auto files = real_files({".tif", ".TIF", ".exr", ".png", ".hgt", ".hgt.zip"});
  if (files.empty()) GTEST_SKIP() << kNoRealFiles;
  const TemporaryFolder folder;
  // Every fourth file under the sanitizers.
  for (std::size_t i = 0; i < files.size(); i += kSanitized ? 4 : 1) {
    const std::string file = files[i];
    SCOPED_TRACE(file);
    std::vector<std::string> convert = {"convert", file, folder / "a.isohf", "--overwrite", "--quiet"};
    // How elevations are packed into colours no picture says.
    for (const auto& [name, encoding] : {std::pair{"/terrarium.png", "terrarium"},
                                         {"/n44e006_mapbox.png", "mapbox"},
                                         {"/gale_rgba_float_16_57775_31917.png", "rgba-float"}}) {
      if (file.ends_with(name)) convert.insert(convert.end(), {"--encoding", encoding});
    }
    const RunResult converted = run_isohf(convert);
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    // The last column of one globe is the first again, but for 1 m in some rows.
    if (file.ends_with("ETOPO1_1deg.tif")) {
      EXPECT_NE(converted.err.find("is left out, although its samples are others"), std::string::npos) << converted.err;
    } else {
      EXPECT_EQ(converted.err, "");
    }
    const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", file, "--json", "--quiet"});
    ASSERT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const nlohmann::json report = nlohmann::json::parse(verified.out);
    EXPECT_GT(report.at("against").at("samples_compared").get<std::int64_t>(), 0);
    EXPECT_EQ(report.at("against").at("lost_inside"), 0);
    // The least is that of 3 x 2 samples, 28.96 dB; noise has 32 and more, terrain 45 to 73.
    EXPECT_GT(report.at("against").at("psnr_db").get<double>(), 28.0);
    EXPECT_EQ(report.at("against").at("invented_inside"), 0);
  }
}

}  // namespace
}  // namespace isohf::test
