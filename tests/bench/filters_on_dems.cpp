// Compares the kernels on rasters of real terrain; prints the table of docs/decisions/0010-default-filter.md.
// usage: filters_on_dems RASTER...   at most 1201 x 1201 samples of each are used

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "isohf/base/sample.h"
#include "isohf/raster.h"
#include "support/rasters/trigonometric_field.h"

namespace {

using isohf::Acquisition;
using isohf::evaluate;
using isohf::Filter;
using isohf::Kernel;
using isohf::Prefilter;
using isohf::View2D;

constexpr Filter kFilters[] = {Filter::kNearest,    Filter::kBilinear, Filter::kLimitedCubic,
                               Filter::kCatmullRom, Filter::kBspline2, Filter::kBspline3,
                               Filter::kBspline5,   Filter::kLanczos3, Filter::kLanczos6};
constexpr std::int64_t kLargest = 1201;

struct Raster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::vector<float> heights;
  [[nodiscard]] View2D<float> view() { return {heights.data(), columns, rows}; }
  [[nodiscard]] float at(std::int64_t c, std::int64_t r) const {
    return heights[static_cast<std::size_t>(r * columns + c)];
  }
};

Raster load(const std::string& path) {
  const auto source = isohf::open_raster(path, {});
  const isohf::SourceInfo& info = source->info();
  Raster raster{std::min(info.width, kLargest), std::min(info.height, kLargest), {}};
  const auto count = static_cast<std::size_t>(raster.columns * raster.rows);
  std::vector<std::byte> raw(count * isohf::size_bytes(info.sample_type));
  source->read_window({0, 0, raster.columns, raster.rows}, raw);
  raster.heights.resize(count);
  isohf::heights_from_samples(info, 0.0, raw, raster.heights);
  return raster;
}

/// Root mean square over the pairs of which neither is void.
class RootMeanSquare {
 public:
  void add(double value, double truth) {
    if (std::isnan(value) || std::isnan(truth)) return;
    sum_ += (value - truth) * (value - truth);
    ++count_;
  }
  [[nodiscard]] double get() const { return std::sqrt(sum_ / static_cast<double>(count_)); }

 private:
  double sum_ = 0.0;
  std::int64_t count_ = 0;
};

Raster coefficients_of(Raster raster, Filter filter, const Acquisition& acquisition) {
  Prefilter::make(filter, acquisition).filter(raster.view());
  return raster;
}

/// Every second sample of every second row predicts the others.
double held_out(const Raster& source, Filter filter) {
  Raster coarse{(source.columns + 1) / 2, (source.rows + 1) / 2, {}};
  for (std::int64_t r = 0; r < source.rows; r += 2) {
    for (std::int64_t c = 0; c < source.columns; c += 2) coarse.heights.push_back(source.at(c, r));
  }
  Raster coefficients = coefficients_of(coarse, filter, {});
  const Kernel kernel = Kernel::make(filter);
  RootMeanSquare error;
  for (std::int64_t r = 0; r < 2 * coarse.rows - 1; ++r) {
    for (std::int64_t c = 0; c < 2 * coarse.columns - 1; ++c) {
      if (((r | c) & 1) == 0) continue;
      error.add(evaluate(kernel, coefficients.view(), coarse.view(), 0.5 * static_cast<double>(c),
                         0.5 * static_cast<double>(r)),
                static_cast<double>(source.at(c, r)));
    }
  }
  return error.get();
}

/// Means of two by two samples predict the samples.
double from_means(const Raster& source, Filter filter, const Acquisition& acquisition) {
  Raster coarse{source.columns / 2, source.rows / 2, {}};
  for (std::int64_t r = 0; r < coarse.rows; ++r) {
    for (std::int64_t c = 0; c < coarse.columns; ++c) {
      coarse.heights.push_back(0.25F * (source.at(2 * c, 2 * r) + source.at(2 * c + 1, 2 * r) +
                                        source.at(2 * c, 2 * r + 1) + source.at(2 * c + 1, 2 * r + 1)));
    }
  }
  Raster coefficients = coefficients_of(coarse, filter, acquisition);
  const Kernel kernel = Kernel::make(filter);
  RootMeanSquare error;
  for (std::int64_t r = 0; r < 2 * coarse.rows; ++r) {
    for (std::int64_t c = 0; c < 2 * coarse.columns; ++c) {
      error.add(evaluate(kernel, coefficients.view(), coarse.view(), 0.5 * static_cast<double>(c) - 0.25,
                         0.5 * static_cast<double>(r) - 0.25),
                static_cast<double>(source.at(c, r)));
    }
  }
  return error.get();
}

/// An equal-density iso lattice over the source, odd rows half a step to the East.
struct Lattice {
  double step = std::sqrt(2.0 / std::sqrt(3.0));
  double row_step = 0.5 * std::sqrt(3.0) * step;
  Raster vertices;
  double overshoot = 0.0;  ///< furthest that a vertex leaves the range of the four samples around it
};

Lattice lattice_of(Raster source, Filter filter) {
  Raster coefficients = coefficients_of(source, filter, {});
  const Kernel kernel = Kernel::make(filter);
  Lattice lattice;
  lattice.vertices.columns = static_cast<std::int64_t>(static_cast<double>(source.columns - 1) / lattice.step);
  lattice.vertices.rows = static_cast<std::int64_t>(static_cast<double>(source.rows - 1) / lattice.row_step) + 1;
  for (std::int64_t r = 0; r < lattice.vertices.rows; ++r) {
    for (std::int64_t c = 0; c < lattice.vertices.columns; ++c) {
      const double u = (static_cast<double>(c) + 0.5 * static_cast<double>(r & 1)) * lattice.step;
      const double v = static_cast<double>(r) * lattice.row_step;
      const double height = evaluate(kernel, coefficients.view(), source.view(), u, v);
      lattice.vertices.heights.push_back(static_cast<float>(height));
      const auto column = std::min(static_cast<std::int64_t>(u), source.columns - 2);
      const auto row = std::min(static_cast<std::int64_t>(v), source.rows - 2);
      float low = std::numeric_limits<float>::infinity();
      float high = -low;
      for (const std::int64_t i : {column, column + 1}) {
        for (const std::int64_t j : {row, row + 1}) {
          low = source.at(i, j) < low ? source.at(i, j) : low;
          high = source.at(i, j) > high ? source.at(i, j) : high;
        }
      }
      const double beyond = std::max(height - static_cast<double>(high), static_cast<double>(low) - height);
      if (beyond > lattice.overshoot) lattice.overshoot = beyond;  // never where void
    }
  }
  return lattice;
}

/// The lattice's triangles, read at the source's places: what a renderer shows of each sample.
double rendered(const Raster& source, const Lattice& lattice) {
  RootMeanSquare error;
  for (std::int64_t y = 0; y < source.rows; ++y) {
    const double v = static_cast<double>(y) / lattice.row_step;
    const auto r = static_cast<std::int64_t>(v);
    if (r + 1 >= lattice.vertices.rows) break;
    const double t = v - static_cast<double>(r);
    for (std::int64_t x = 0; x < source.columns; ++x) {
      // Along the edges that lean to the East going down a row: s is constant, and a cell of four vertices spans [0, 1)
      // in (f, t), cut by the other diagonal.
      const auto odd = static_cast<double>(r & 1);
      const double s = static_cast<double>(x) / lattice.step - 0.5 * odd - 0.5 * t;
      const auto i = static_cast<std::int64_t>(std::floor(s));
      const std::int64_t below = i + (r & 1);  // of the next row, whose own shift is the opposite
      if (i < 0 || std::max(i, below) + 1 >= lattice.vertices.columns) continue;
      const double f = s - static_cast<double>(i);
      const auto vertex = [&](std::int64_t c, std::int64_t row) {
        return static_cast<double>(lattice.vertices.at(c, row));
      };
      const double height = f + t <= 1.0
                                ? (1.0 - f - t) * vertex(i, r) + f * vertex(i + 1, r) + t * vertex(below, r + 1)
                                : (1.0 - t) * vertex(i + 1, r) + (1.0 - f) * vertex(below, r + 1) +
                                      (f + t - 1.0) * vertex(below + 1, r + 1);
      error.add(height, static_cast<double>(source.at(x, y)));
    }
  }
  return error.get();
}

void print_table(const std::string& path) {
  const Raster source = load(path);
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const float height : source.heights) {
    if (height < low) low = height;
    if (height > high) high = height;
  }
  std::printf("%s, %lld x %lld, %g to %g\n\n", path.substr(path.rfind('/') + 1).c_str(),
              static_cast<long long>(source.columns), static_cast<long long>(source.rows), static_cast<double>(low),
              static_cast<double>(high));
  std::printf(
      "| filter | held out | from means, point | from means, box | rendered | overshoot "
      "|\n|---|---|---|---|---|---|\n");
  const Acquisition box = isohf::acquisition_from_string("box");
  for (const Filter filter : kFilters) {
    const Lattice lattice = lattice_of(source, filter);
    std::printf("| %s | %.4g | %.4g | %.4g | %.4g | %.3g |\n", to_string(filter).c_str(), held_out(source, filter),
                from_means(source, filter, {}), from_means(source, filter, box), rendered(source, lattice),
                lattice.overshoot);
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    for (int i = 1; i < argc; ++i) print_table(argv[i]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "filters_on_dems: %s\n", error.what());
    return 1;
  }
  return 0;
}
