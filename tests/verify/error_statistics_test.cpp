#include "isohf/verify/accuracy/error_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace isohf {
namespace {

TEST(ErrorHistogram, KnowsPercentilesTo1Point1PercentFromAbove) {
  std::mt19937 random(7);
  std::vector<double> errors;
  for (int i = 0; i < 5000; ++i) errors.push_back(std::exp(std::normal_distribution<double>(0.0, 3.0)(random)));
  ErrorHistogram all;
  ErrorHistogram parts[2];
  for (std::size_t i = 0; i < errors.size(); ++i) {
    all.add(errors[i]);
    parts[i % 2].add(errors[i]);
  }
  parts[1].add(parts[0]);
  std::sort(errors.begin(), errors.end());
  for (const double share : {0.01, 0.5, 0.9, 0.99, 1.0}) {
    const double exact = errors[static_cast<std::size_t>(std::ceil(share * 5000.0)) - 1];
    EXPECT_GE(all.percentile(share), exact * (1 - 1e-6));  // errors are binned as floats
    EXPECT_LE(all.percentile(share), exact * 1.0158);      // a bin is at most 1/64 wide
    EXPECT_EQ(all.percentile(share), parts[1].percentile(share));
  }
}

TEST(ErrorHistogram, ZerosAreZeroAndNothingIsZero) {
  ErrorHistogram histogram;
  EXPECT_EQ(histogram.percentile(0.99), 0.0);
  histogram.add(0.0);
  EXPECT_EQ(histogram.percentile(0.99), 0.0);
}

TEST(ErrorSums, AddUpRunByRun) {
  ErrorSums first;
  ErrorSums later;
  first.add(3.0, {1, 2});
  later.add(4.0, {5, 6});
  later.add(4.0, {7, 8});
  first.add(later);
  EXPECT_EQ(first.count, 3);
  EXPECT_DOUBLE_EQ(first.rms(), std::sqrt(41.0 / 3.0));
  EXPECT_EQ(first.max, 4.0);
  EXPECT_EQ(first.worst.x, 5.0);  // the first of equals
  EXPECT_EQ(ErrorSums{}.rms(), 0.0);
  EXPECT_DOUBLE_EQ(psnr_db(100.0, 1.0), 40.0);
  EXPECT_TRUE(std::isinf(psnr_db(100.0, 0.0)));
}

}  // namespace
}  // namespace isohf
