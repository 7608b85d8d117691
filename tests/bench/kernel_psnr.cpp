// Prints how faithfully each kernel carries band-limited fields from the ortho grid to the iso lattice, and back.
// usage: kernel_psnr [FIELDS]   fields averaged for each row, default 4

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "support/rasters/restored_field.h"
#include "support/rasters/trigonometric_field.h"

namespace {

constexpr int kSize = 128;
constexpr int kMargin = 24;        // 0.43^24, the quintic's slower pole, hides the edge below 1e-8
constexpr std::size_t kRings = 7;  // the last one is all that is inside
constexpr isohf::Filter kFilters[] = {
    isohf::Filter::kNearest,    isohf::Filter::kBilinear, isohf::Filter::kLimitedCubic,
    isohf::Filter::kCatmullRom, isohf::Filter::kBspline2, isohf::Filter::kBspline3,
    isohf::Filter::kBspline5,   isohf::Filter::kLanczos3, isohf::Filter::kLanczos6};
struct FieldKind {
  double p;
  double rho;
};
constexpr FieldKind kKinds[] = {{1.8, 1.0}, {1.8, 0.7}, {0.0, 0.7}};

double psnr_of_hex(isohf::Filter filter, const isohf::TrigonometricField& field, int margin) {
  return isohf::test::psnr_of_restoring(filter, field, margin, isohf::RestoreMethod::kHex);
}
double psnr_of_triangles(isohf::Filter filter, const isohf::TrigonometricField& field, int margin) {
  return isohf::test::psnr_of_restoring(filter, field, margin, isohf::RestoreMethod::kBarycentric);
}

using Measure = double (*)(isohf::Filter, const isohf::TrigonometricField&, int);

void print_table(const char* title, Measure measure, int fields) {
  std::printf("%s\n\n| field |", title);
  for (const isohf::Filter filter : kFilters) std::printf(" %s |", to_string(filter).c_str());
  std::printf("\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const FieldKind& kind : kKinds) {
    std::printf("| p=%.1f, rho=%.1f |", kind.p, kind.rho);
    for (const isohf::Filter filter : kFilters) {
      double sum = 0.0;
      for (int seed = 1; seed <= fields; ++seed) {
        sum += measure(filter, isohf::TrigonometricField(kSize, kind.p, kind.rho, static_cast<std::uint64_t>(seed)),
                       kMargin);
      }
      std::printf(" %.1f |", sum / fields);
      std::fflush(stdout);
    }
    std::printf("\n");
  }
  std::printf("\n");
}

/// PSNR of the iso lattice's vertices by their distance from the field's rim, beyond which no kernel sees it.
std::array<double, kRings> psnr_by_distance(const isohf::Kernel& kernel, const isohf::TrigonometricField& field) {
  const std::vector<float> samples = field.samples();
  std::vector<float> coefficients = samples;
  isohf::Prefilter::make(kernel.filter(), {}, kernel.edges()).filter({coefficients.data(), kSize, kSize});
  const double step = std::sqrt(2.0 / std::sqrt(3.0));
  const double row_step = 0.5 * std::sqrt(3.0) * step;
  std::array<double, kRings> squares{};
  std::array<std::int64_t, kRings> counts{};
  const double last = kSize - 1;
  for (int r = 0; r * row_step <= last; ++r) {
    const double first = 0.5 * (r & 1) * step;
    const int count = static_cast<int>((last - first) / step) + 1;
    const std::vector<double> exact = field.row(r * row_step, first, step, count);
    for (int c = 0; c < count; ++c) {
      const double u = first + c * step;
      const double v = r * row_step;
      const double distance = std::min({u, v, last - u, last - v});
      const auto ring = std::min(static_cast<std::size_t>(distance), kRings - 1);
      const double error =
          evaluate(kernel, {coefficients.data(), kSize, kSize}, u, v) - exact[static_cast<std::size_t>(c)];
      squares[ring] += error * error;
      ++counts[ring];
    }
  }
  std::array<double, kRings> result{};
  for (std::size_t ring = 0; ring < kRings; ++ring) result[ring] = isohf::psnr(samples, squares[ring], counts[ring]);
  return result;
}

void print_rim(int fields) {
  std::printf("At the rim by distance in samples, p=1.8, rho=0.7, dB\n\n| filter | edges | below 1 |");
  for (std::size_t ring = 1; ring + 1 < kRings; ++ring) std::printf(" to %zu |", ring + 1);
  std::printf(" inside |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const isohf::Filter filter : kFilters) {
    if (isohf::Kernel::make(filter).taps() < 3) continue;
    for (const isohf::Edges edges : {isohf::Edges::kMirror, isohf::Edges::kOdd}) {
      std::array<double, kRings> sums{};
      for (int seed = 1; seed <= fields; ++seed) {
        const isohf::TrigonometricField field(kSize, 1.8, 0.7, static_cast<std::uint64_t>(seed));
        const auto found = psnr_by_distance(isohf::Kernel::make(filter, edges), field);
        for (std::size_t ring = 0; ring < kRings; ++ring) sums[ring] += found[ring];
      }
      std::printf("| %s | %s |", to_string(filter).c_str(), to_string(edges).c_str());
      for (const double sum : sums) std::printf(" %.1f |", sum / fields);
      std::printf("\n");
      std::fflush(stdout);
    }
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int fields = argc > 1 ? std::atoi(argv[1]) : 4;
  if (fields < 1) {
    std::fprintf(stderr, "kernel_psnr: the number of fields must be at least 1\n");
    return 2;
  }
  print_rim(fields);
  print_table("Ortho to iso at equal density, dB", isohf::psnr_of_resampling, fields);
  print_table("Ortho to iso to ortho on the lattice with 15.5 % more samples, separable inverse, dB",
              isohf::psnr_of_round_trip, fields);
  print_table("isohf convert --spacing 1, restore --method hex, dB", psnr_of_hex, fields);
  print_table("isohf convert --spacing 1, restore --method barycentric, dB", psnr_of_triangles, fields);
  return 0;
}
