#include "isohf/sampling/resample/acquisition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

using testing::HasSubstr;

std::string refusal(const std::string& text) {
  const Error error = test::error_of([&] { (void)acquisition_from_string(text); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  return error.what();
}

/// The B-spline of degree n by one-sided powers: 1/n! sum of (-1)^i (n+1 over i) (x + (n+1)/2 - i)^n, bases >= 0.
double bspline(int n, double x) {
  double sum = 0.0;
  double binomial = 1.0;
  for (int i = 0; i <= n + 1; ++i) {
    const double base = x + 0.5 * (n + 1) - i;
    if (base > 0.0) sum += ((i & 1) != 0 ? -binomial : binomial) * std::pow(base, n);
    binomial = binomial * (n + 1 - i) / (i + 1);
  }
  return sum / std::tgamma(n + 1.0);
}

struct Spline {
  Filter filter;
  int degree;
};
constexpr Spline kSplines[] = {{Filter::kNearest, 0}, {Filter::kBilinear, 1}, {Filter::kBspline3, 3}};

TEST(Acquisition, TextRoundTrips) {
  for (const char* text :
       {"point", "box", "gaussian:0.7", "gaussian:1e-05", "gaussian:0.1", "1,2,1", "0.1,0.8,0.1", "3"}) {
    EXPECT_EQ(to_string(acquisition_from_string(text)), text);
  }
  EXPECT_EQ(acquisition_from_string("gaussian:0.70").sigma, 0.7);
}

TEST(Acquisition, OtherTextsAreRefused) {
  for (const char* text : {"",
                           "Box",
                           "gauss",
                           "gaussian",
                           "gaussian:",
                           "gaussian:0",
                           "gaussian:-1",
                           "gaussian:nan",
                           "gaussian:inf",
                           "gaussian:1e9",
                           "gaussian:1 ",
                           "gaussian:0,7",
                           "tent",
                           "box ",
                           "fir:taps.txt",
                           "1 2 1",
                           "1,2,x",
                           "1,,1",
                           "1,2,1,",
                           "1,nan,1",
                           "1,1e999,1"}) {
    EXPECT_THAT(refusal(text), HasSubstr(std::string("\"").append(text).append("\"")));
  }
}

TEST(Acquisition, TapsAreDividedByTheirSumWhereTheyAreUsed) {
  const Acquisition given = acquisition_from_string("1,2,1");
  EXPECT_EQ(given.taps, (std::vector<double>{1.0, 2.0, 1.0})) << "so that their text gives the same archive again";
  EXPECT_EQ(with_taps(given).taps, (std::vector<double>{0.25, 0.5, 0.25}));
  EXPECT_EQ(with_taps(acquisition_from_string("4")).taps, std::vector<double>{1.0});
}

TEST(Acquisition, TapsThatAreNoFilterAreRefusedWithWhatOneIs) {
  for (const auto& [text, why] : {std::pair{"1,1", "there are 2"},
                                  {"1,4,4,1", "there are 4"},
                                  {"1,2,1.01", "taps 1 and 3 are 1 and 1.01"},
                                  {"1,-2,1", "they sum to 0"},
                                  {"0", "they sum to 0"}}) {
    EXPECT_THAT(refusal(text), HasSubstr(why)) << text;
    EXPECT_THAT(refusal(text), HasSubstr("Give an odd number of taps, the same from both ends")) << text;
  }
  std::string many = "1";
  for (int i = 1; i < 257; ++i) many += ",1";
  EXPECT_THAT(refusal(many), HasSubstr("more than 255"));
}

TEST(SampledResponse, OfPointsIsTheKernelAtIntegers) {
  EXPECT_EQ(sampled_response(Kernel::make(Filter::kLimitedCubic), Acquisition{}), std::vector<double>{1.0});
  const std::vector<double> cubic = sampled_response(Kernel::make(Filter::kBspline3), Acquisition{});
  ASSERT_EQ(cubic.size(), 2U);
  EXPECT_NEAR(cubic[0], 4.0 / 6.0, 1e-15);
  EXPECT_NEAR(cubic[1], 1.0 / 6.0, 1e-15);
}

TEST(SampledResponse, OfABoxIsTheBsplineOfTheNextDegree) {
  for (const Spline& spline : kSplines) {
    const std::vector<double> response = sampled_response(Kernel::make(spline.filter), acquisition_from_string("box"));
    for (int k = 0; k < 6; ++k) {
      const double value = k < static_cast<int>(response.size()) ? response[static_cast<std::size_t>(k)] : 0.0;
      EXPECT_NEAR(value, bspline(spline.degree + 1, k), 2e-14) << to_string(spline.filter) << " " << k;
    }
  }
}

TEST(SampledResponse, OfAGaussianAndNearestIsADifferenceOfErrorFunctions) {
  for (const double sigma : {0.001, 0.1, 0.5, 0.7, 3.0}) {
    Acquisition gaussian;
    gaussian.kind = Acquisition::Kind::kGaussian;
    gaussian.sigma = sigma;
    const std::vector<double> response = sampled_response(Kernel::make(Filter::kNearest), gaussian);
    for (int k = 0; k < static_cast<int>(response.size()); ++k) {
      const double scale = 1.0 / (sigma * std::sqrt(2.0));
      const double exact = 0.5 * (std::erf((k + 0.5) * scale) - std::erf((k - 0.5) * scale));
      EXPECT_NEAR(response[static_cast<std::size_t>(k)], exact, 1e-14) << sigma << " " << k;
    }
  }
}

TEST(SampledResponse, SumsToOne) {
  const Acquisition taps = with_taps(acquisition_from_string("1,3,-1,20,-1,3,1"));
  for (const char* name : {"nearest", "bilinear", "limited-cubic", "bspline3"}) {
    const Kernel kernel = Kernel::make(filter_from_string(name));
    for (const Acquisition& acquisition :
         {Acquisition{}, acquisition_from_string("box"), acquisition_from_string("gaussian:0.01"),
          acquisition_from_string("gaussian:1.5"), taps}) {
      const std::vector<double> response = sampled_response(kernel, acquisition);
      double sum = response[0];
      for (std::size_t k = 1; k < response.size(); ++k) sum += 2.0 * response[k];
      EXPECT_NEAR(sum, 1.0, 1e-13) << name << " " << to_string(acquisition);
    }
  }
}

}  // namespace
}  // namespace isohf
