#include "isohf/surface/resample/acquisition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "isohf/error.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using testing::HasSubstr;

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "nothing thrown";
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
constexpr Spline kSplines[] = {{Filter::kNearest, 0},
                               {Filter::kBilinear, 1},
                               {Filter::kBspline2, 2},
                               {Filter::kBspline3, 3},
                               {Filter::kBspline5, 5}};

TEST(Acquisition, TextRoundTrips) {
  for (const char* text : {"point", "box", "tent", "gaussian:0.7", "gaussian:1e-05", "gaussian:0.1"}) {
    EXPECT_EQ(to_string(acquisition_from_string(text)), text);
  }
  EXPECT_EQ(acquisition_from_string("gaussian:0.70").sigma, 0.7);
}

TEST(Acquisition, OtherTextsAreRefused) {
  for (const char* text : {"", "Box", "gauss", "gaussian", "gaussian:", "gaussian:0", "gaussian:-1", "gaussian:nan",
                           "gaussian:inf", "gaussian:1e9", "gaussian:1 ", "gaussian:0,7", "tent:2", "box "}) {
    EXPECT_THAT(refusal([&] { (void)acquisition_from_string(text); }),
                HasSubstr(std::string("\"").append(text).append("\"")));
  }
}

TEST(Acquisition, FirIsReadFromItsFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "taps.txt";
  test::write_file(path, "1 2 1\n");
  const Acquisition fir = with_taps(acquisition_from_string("fir:" + path));
  EXPECT_EQ(fir.taps, (std::vector<double>{0.25, 0.5, 0.25}));
  EXPECT_EQ(to_string(fir), "fir:" + path);
  std::filesystem::remove(path);
  try {
    (void)with_taps(acquisition_from_string("fir:" + path));
    FAIL() << "a missing file was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
    EXPECT_THAT(error.what(), HasSubstr(path));
  }
  EXPECT_THROW((void)with_taps(acquisition_from_string("fir:")), Error);
  EXPECT_THROW((void)with_taps(acquisition_from_string("fir:" + folder.path())), Error);
}

TEST(Acquisition, FirFilesOfMoreThan64KibibytesAreRefused) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "long.txt";
  test::write_file(path, "1" + std::string(65536, ' '));
  EXPECT_THAT(refusal([&] { (void)with_taps(acquisition_from_string("fir:" + path)); }), HasSubstr("65536 bytes"));
  test::write_file(path, "1" + std::string(65535, ' '));
  EXPECT_EQ(with_taps(acquisition_from_string("fir:" + path)).taps.size(), 1U);
}

TEST(Acquisition, FirTextTakesCommentsAndAnySpace) {
  const Acquisition fir = fir_from_text("# five taps\r\n-1e-1 .1#near\n\t1 0.1\n-0.1 # end", "f");
  ASSERT_EQ(fir.taps.size(), 5U);
  EXPECT_DOUBLE_EQ(fir.taps[0], -0.1);
  EXPECT_DOUBLE_EQ(fir.taps[1], 0.1);
  EXPECT_DOUBLE_EQ(fir.taps[2], 1.0);
  EXPECT_EQ(fir_from_text("4", "f").taps, std::vector<double>{1.0});
}

TEST(Acquisition, BadFirTextIsRefusedWithItsPlace) {
  const auto message = [](const std::string& text) { return refusal([&] { (void)fir_from_text(text, "f.txt"); }); };
  EXPECT_THAT(message(""), HasSubstr("f.txt: 0 taps"));
  EXPECT_THAT(message("# 1 2 1"), HasSubstr("0 taps"));
  EXPECT_THAT(message("1 1"), HasSubstr("2 taps"));
  EXPECT_THAT(message("1 2 x"), HasSubstr("byte 4: \"x\""));
  EXPECT_THAT(message("1,2,1"), HasSubstr("\"1,2,1\""));
  EXPECT_THAT(message("1 nan 1"), HasSubstr("\"nan\""));
  EXPECT_THAT(message("1 1e999 1"), HasSubstr("\"1e999\""));
  EXPECT_THAT(message("1 2 1.01"), HasSubstr("symmetric"));
  EXPECT_THAT(message("1 -2 1"), HasSubstr("sum to 0"));
  EXPECT_THAT(message("0"), HasSubstr("sum to 0"));
  EXPECT_THAT(message(std::string(1, '\0')), HasSubstr("byte 0"));
  std::string many;
  for (int i = 0; i < 257; ++i) many += "1 ";
  EXPECT_THAT(message(many), HasSubstr("more than 255"));
}

TEST(SampledResponse, OfPointsIsTheKernelAtIntegers) {
  EXPECT_EQ(sampled_response(Kernel::make(Filter::kLanczos6), Acquisition{}), std::vector<double>{1.0});
  const std::vector<double> quintic = sampled_response(Kernel::make(Filter::kBspline5), Acquisition{});
  ASSERT_EQ(quintic.size(), 3U);
  EXPECT_NEAR(quintic[0], 66.0 / 120.0, 1e-15);
  EXPECT_NEAR(quintic[1], 26.0 / 120.0, 1e-15);
  EXPECT_NEAR(quintic[2], 1.0 / 120.0, 1e-15);
}

TEST(SampledResponse, OfBoxAndTentIsTheBsplineOfHigherDegree) {
  for (const Spline& spline : kSplines) {
    for (const int order : {1, 2}) {
      const std::vector<double> response =
          sampled_response(Kernel::make(spline.filter), acquisition_from_string(order == 1 ? "box" : "tent"));
      for (int k = 0; k < 6; ++k) {
        const double value = k < static_cast<int>(response.size()) ? response[static_cast<std::size_t>(k)] : 0.0;
        EXPECT_NEAR(value, bspline(spline.degree + order, k), 2e-14) << to_string(spline.filter) << order << " " << k;
      }
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
  const Acquisition fir = fir_from_text("1 3 -1 20 -1 3 1", "f");
  for (const char* name : {"nearest", "bilinear", "limited-cubic", "catmull-rom", "bspline2", "bspline3", "bspline5",
                           "lanczos3", "lanczos6"}) {
    const Kernel kernel = Kernel::make(filter_from_string(name));
    for (const Acquisition& acquisition :
         {Acquisition{}, acquisition_from_string("box"), acquisition_from_string("tent"),
          acquisition_from_string("gaussian:0.01"), acquisition_from_string("gaussian:1.5"), fir}) {
      const std::vector<double> response = sampled_response(kernel, acquisition);
      double sum = response[0];
      for (std::size_t k = 1; k < response.size(); ++k) sum += 2.0 * response[k];
      EXPECT_NEAR(sum, 1.0, 1e-13) << name << " " << to_string(acquisition);
    }
  }
}

}  // namespace
}  // namespace isohf
