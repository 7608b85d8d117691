#include "isohf/base/memory/kept_rows.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(KeptRows, HoldsWhatWasWrittenInMemoryAndInAFile) {
  const test::TemporaryFolder folder;
  constexpr std::size_t kWidth = 37;
  for (const ScratchFolder& scratch : {ScratchFolder(), ScratchFolder(folder.path())}) {
    KeptRows<double> rows(kWidth, scratch);
    std::map<std::int64_t, std::vector<double>> expected;
    std::mt19937 random(5);
    for (int i = 0; i < 400; ++i) {
      // Rows come and go as in a window that moves on, and their places are used again.
      const std::int64_t row = 3 * i;
      rows.add(row);
      std::vector<double>& values = expected[row];
      values.resize(kWidth);
      std::iota(values.begin(), values.end(), i * 100.0);
      rows.write(row, 0, std::span(values).first(20));
      rows.write(row, 20, std::span(values).subspan(20));
      if (expected.size() > 9) {
        rows.drop(expected.begin()->first);
        expected.erase(expected.begin());
      }
      const auto& [at, kept] = *std::next(expected.begin(), random() % expected.size());
      const std::size_t first = random() % kWidth;
      std::vector<double> buffer;
      const auto read = rows.read(at, first, kWidth - first, buffer);
      ASSERT_TRUE(std::equal(read.begin(), read.end(), kept.begin() + static_cast<std::ptrdiff_t>(first), kept.end()));
    }
  }
  EXPECT_TRUE(folder.names().empty()) << "the file has no name";
}

TEST(KeptRows, AFolderThatIsNoneIsNamed) {
  KeptRows<float> rows(4, ScratchFolder("/nonexistent"));
  const Error error = test::error_of([&] { rows.add(0); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(error.what()).find("/nonexistent"), std::string::npos);
}

}  // namespace
}  // namespace isohf
