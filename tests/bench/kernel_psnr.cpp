// Prints how faithfully each kernel carries band-limited fields from the ortho grid to the iso lattice, and back.
// usage: kernel_psnr [FIELDS]   fields averaged for each row, default 4

#include <cstdio>
#include <cstdlib>

#include "support/restored_field.h"
#include "support/trigonometric_field.h"

namespace {

constexpr int kSize = 128;
constexpr int kMargin = 24;  // 0.43^24, the quintic's slower pole, hides the mirrored edge below 1e-8
constexpr isohf::Filter kFilters[] = {isohf::Filter::kNearest,  isohf::Filter::kBilinear, isohf::Filter::kCatmullRom,
                                      isohf::Filter::kBspline2, isohf::Filter::kBspline3, isohf::Filter::kBspline5,
                                      isohf::Filter::kLanczos3, isohf::Filter::kLanczos6};
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
  std::printf("\n|---|---|---|---|---|---|---|---|---|\n");
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

}  // namespace

int main(int argc, char** argv) {
  const int fields = argc > 1 ? std::atoi(argv[1]) : 4;
  if (fields < 1) {
    std::fprintf(stderr, "kernel_psnr: the number of fields must be at least 1\n");
    return 2;
  }
  print_table("Ortho to iso at equal density, dB", isohf::psnr_of_resampling, fields);
  print_table("Ortho to iso to ortho on the lattice with 15.5 % more samples, separable inverse, dB",
              isohf::psnr_of_round_trip, fields);
  print_table("isohf convert --spacing 1, restore --method hex, dB", psnr_of_hex, fields);
  print_table("isohf convert --spacing 1, restore --method barycentric, dB", psnr_of_triangles, fields);
  return 0;
}
