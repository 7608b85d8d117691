#include "terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>

// One more copy of the noise loop for machines with AVX2, chosen when the program starts. No fused multiply-add, so
// both copies give the same bits. Sanitizers run before the choice is made and must not see it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define ISOHF_WIDE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define ISOHF_WIDE_CLONES
#endif

namespace isohf::terrain {
namespace {

constexpr int kChunk = 256;
constexpr double kFixedOne = 4294967296.0;

/// One value of noise with its slope, for each sample of a chunk.
struct NoiseRow {
  float value[kChunk];
  float slope_x[kChunk];
  float slope_z[kChunk];
};

/// Heights in metres and their gradient, for each sample of a chunk.
struct SlopeRow {
  float height[kChunk];
  float slope_x[kChunk];
  float slope_z[kChunk];
};

struct OffsetRow {
  float x[kChunk] = {};
  float z[kChunk] = {};
};

/// Mixes a lattice corner into 32 bits, of which every one depends on every bit of the corner.
inline std::uint32_t mix(std::uint32_t h) {
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

std::uint64_t mix64(std::uint64_t h) {
  h += 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

/// Gradient noise (value about -0.8 .. 0.8) and its exact derivative in lattice units, turned back to raster axes.
/// offset: displacement of each sample in features.
ISOHF_WIDE_CLONES
void gradient_noise(const NoiseLattice& lattice, std::int64_t column, std::int64_t row, int count,
                    const OffsetRow& offset, NoiseRow& out) {
  const std::int64_t u0 = lattice.u_origin + column * lattice.u_per_column + row * lattice.u_per_row;
  const std::int64_t v0 = lattice.v_origin + column * lattice.v_per_column + row * lattice.v_per_row;
  const float to_u = lattice.cosine * lattice.cells_per_feature;
  const float to_v = lattice.sine * lattice.cells_per_feature;
  for (int i = 0; i < count; ++i) {
    const std::int64_t pu = u0 + i * lattice.u_per_column;
    const std::int64_t pv = v0 + i * lattice.v_per_column;
    // The upper 24 bits of the fraction are what a float holds.
    const float fu = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(pu) >> 8)) * 0x1p-24F +
                     offset.x[i] * to_u - offset.z[i] * to_v;
    const float fv = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(pv) >> 8)) * 0x1p-24F +
                     offset.x[i] * to_v + offset.z[i] * to_u;
    std::int32_t tu = static_cast<std::int32_t>(fu);
    std::int32_t tv = static_cast<std::int32_t>(fv);
    tu -= static_cast<float>(tu) > fu ? 1 : 0;
    tv -= static_cast<float>(tv) > fv ? 1 : 0;
    const float x = fu - static_cast<float>(tu);
    const float y = fv - static_cast<float>(tv);
    const auto iu = static_cast<std::uint32_t>(pu >> 32) + static_cast<std::uint32_t>(tu);
    const auto iv = static_cast<std::uint32_t>(pv >> 32) + static_cast<std::uint32_t>(tv);

    const std::uint32_t hu0 = iu * 0x9e3779b1u + lattice.seed;
    const std::uint32_t hu1 = hu0 + 0x9e3779b1u;
    const std::uint32_t hv0 = iv * 0x85ebca77u;
    const std::uint32_t hv1 = hv0 + 0x85ebca77u;
    const std::uint32_t h00 = mix(hu0 ^ hv0);
    const std::uint32_t h10 = mix(hu1 ^ hv0);
    const std::uint32_t h01 = mix(hu0 ^ hv1);
    const std::uint32_t h11 = mix(hu1 ^ hv1);
    constexpr float kUnit = 0x1p-31F;
    const auto gradient_x = [](std::uint32_t h) { return static_cast<float>(static_cast<std::int32_t>(h)) * kUnit; };
    const auto gradient_y = [](std::uint32_t h) {
      return static_cast<float>(static_cast<std::int32_t>(h << 16)) * kUnit;
    };
    const float ax = gradient_x(h00), ay = gradient_y(h00);
    const float bx = gradient_x(h10), by = gradient_y(h10);
    const float cx = gradient_x(h01), cy = gradient_y(h01);
    const float dx = gradient_x(h11), dy = gradient_y(h11);

    const float a = ax * x + ay * y;
    const float b = bx * (x - 1) + by * y;
    const float c = cx * x + cy * (y - 1);
    const float d = dx * (x - 1) + dy * (y - 1);
    // Quintic fade and its derivative: the noise has continuous curvature, so hillsides show no lattice.
    const float sx = x * x * x * (x * (x * 6 - 15) + 10);
    const float sy = y * y * y * (y * (y * 6 - 15) + 10);
    const float tx = 30 * x * x * (x * (x - 2) + 1);
    const float ty = 30 * y * y * (y * (y - 2) + 1);
    const float twist = a - b - c + d;
    out.value[i] = a + sx * (b - a) + sy * (c - a) + sx * sy * twist;
    const float du = ax + sx * (bx - ax) + sy * (cx - ax) + sx * sy * (ax - bx - cx + dx) + tx * (b - a + sy * twist);
    const float dv = ay + sx * (by - ay) + sy * (cy - ay) + sx * sy * (ay - by - cy + dy) + ty * (c - a + sx * twist);
    out.slope_x[i] = du * lattice.cosine + dv * lattice.sine;
    out.slope_z[i] = dv * lattice.cosine - du * lattice.sine;
  }
}

/// Adds one octave of gullies to heights and gradients (metres per metre). Around a jittered pivot in each lattice cell
/// a wave runs across the slope, so that its troughs run down it; the waves of nine cells are blended. Depth grows with
/// wavelength and slope. The gradient ignores how the slope itself turns: it only steers the next, finer octave.
ISOHF_WIDE_CLONES
void carve_gullies(const NoiseLattice& lattice, std::int64_t column, std::int64_t row, int count, float wavelength_m,
                   float strength, SlopeRow& land) {
  const std::int64_t u0 = lattice.u_origin + column * lattice.u_per_column + row * lattice.u_per_row;
  const std::int64_t v0 = lattice.v_origin + column * lattice.v_per_column + row * lattice.v_per_row;
  for (int i = 0; i < count; ++i) {
    const std::int64_t pu = u0 + i * lattice.u_per_column;
    const std::int64_t pv = v0 + i * lattice.v_per_column;
    const float x = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(pu) >> 8)) * 0x1p-24F;
    const float y = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(pv) >> 8)) * 0x1p-24F;
    const auto iu = static_cast<std::uint32_t>(pu >> 32);
    const auto iv = static_cast<std::uint32_t>(pv >> 32);
    const float gx = land.slope_x[i];
    const float gz = land.slope_z[i];
    const float steepness = std::sqrt(gx * gx + gz * gz);
    const float to_unit = 1 / (steepness + 0.01F);
    // Across the slope, in lattice axes.
    const float across_x = -gz * to_unit;
    const float across_z = gx * to_unit;
    const float across_u = across_x * lattice.cosine - across_z * lattice.sine;
    const float across_v = across_x * lattice.sine + across_z * lattice.cosine;
    float wave = 0;
    float rise = 0;
    float weights = 0;
    for (int k = 0; k < 9; ++k) {
      const int du = k % 3 - 1;
      const int dv = k / 3 - 1;
      const std::uint32_t h = mix(((iu + static_cast<std::uint32_t>(du)) * 0x9e3779b1u + lattice.seed) ^
                                  ((iv + static_cast<std::uint32_t>(dv)) * 0x85ebca77u));
      // Pivots keep 0.2 off the cell's edge, so that none outside the nine cells is closer than 1.2.
      const float px =
          x - (static_cast<float>(du) + 0.5F + 0.3F * 0x1p-31F * static_cast<float>(static_cast<std::int32_t>(h)));
      const float py = y - (static_cast<float>(dv) + 0.5F +
                            0.3F * 0x1p-31F * static_cast<float>(static_cast<std::int32_t>(h << 16)));
      const float near = std::max(1 - (px * px + py * py) * (1 / 1.44F), 0.0F);
      const float weight = near * near * near;
      // A cosine made of two parabola-like halves: turns from a pivot on a crest, 1 - 2 smoothstep.
      const float turns = px * across_u + py * across_v;
      const float from_crest = turns - static_cast<float>(static_cast<std::int32_t>(turns + 64.5F) - 64);
      const float t = 2 * std::abs(from_crest);
      wave += weight * (1 - 2 * t * t * (3 - 2 * t));
      rise -= weight * (from_crest < 0 ? -24.0F : 24.0F) * t * (1 - t);
      weights += weight;
    }
    // Cliffs have no gullies: without this, each octave would steepen what the one before made.
    const float steep = steepness / (1 + 0.6F * steepness * steepness);
    const float depth = strength * steep / weights;
    land.height[i] += wavelength_m * depth * (wave - 0.25F * weights);
    land.slope_x[i] += depth * rise * across_x;
    land.slope_z[i] += depth * rise * across_z;
  }
}

/// A lattice of the given wavelength, turned by `turn` steps of 36.87 degrees, whose multiples never fall on one
/// another.
NoiseLattice make_lattice(double wavelength_samples, double feature_samples, int turn, std::uint64_t seed) {
  double cosine = 1;
  double sine = 0;
  for (int i = 0; i < turn; ++i) {
    const double c = 0.8 * cosine - 0.6 * sine;
    sine = 0.6 * cosine + 0.8 * sine;
    cosine = c;
  }
  const double step = kFixedOne / wavelength_samples;
  NoiseLattice lattice;
  lattice.u_per_column = std::llround(step * cosine);
  lattice.u_per_row = std::llround(-step * sine);
  lattice.v_per_column = std::llround(step * sine);
  lattice.v_per_row = std::llround(step * cosine);
  const std::uint64_t mixed = mix64(seed);
  // Far from zero, so that the raster's corner is no special place of the lattice.
  lattice.u_origin = static_cast<std::int64_t>(mixed >> 20);
  lattice.v_origin = static_cast<std::int64_t>(mix64(mixed) >> 20);
  lattice.cosine = static_cast<float>(cosine);
  lattice.sine = static_cast<float>(sine);
  lattice.cells_per_feature = static_cast<float>(feature_samples / wavelength_samples);
  lattice.seed = static_cast<std::uint32_t>(mix64(mixed + 1));
  return lattice;
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

constexpr int kVoidCell = 64;         // samples; each cell holds one void patch or none
constexpr float kVoidRadius = 24;     // samples
constexpr float kPlain = 0.06F;       // of relief: height of an average plain
constexpr float kContinent = 0.30F;   // of relief: swing of the lowlands
constexpr float kFill = 0.06F;        // of relief: height over which rock goes over into sediment
constexpr float kGullyDepth = 0.18F;  // of wavelength and slope
constexpr float kHighest = 1.6F;      // of relief: bound on every height, reached by none
constexpr double kFinest = 2.6;       // samples: the shortest wavelength that a raster can hold

}  // namespace

Terrain::Terrain(const TerrainOptions& options) : options_(options) {
  const double feature = options.feature_m / options.spacing_m;
  std::uint64_t seed = mix64(options.seed);
  int turn = 0;
  for (std::size_t i = 0; i < continent_.size(); ++i) {
    continent_[i] = make_lattice(6 * feature / static_cast<double>(1 << i), feature, turn++, ++seed);
  }
  for (std::size_t i = 0; i < bend_.size(); ++i) {
    bend_[i] = make_lattice((i % 2 == 0 ? 1.7 : 0.6) * feature, feature, turn++, ++seed);
  }
  void_edge_ = make_lattice(kVoidCell / 4.0, feature, turn++, ++seed);
  for (std::size_t i = 0; i < ridges_.size(); ++i) {
    ridges_[i] = make_lattice(feature / static_cast<double>(1 << i), feature, turn++, ++seed);
  }
  grit_ = make_lattice(4, feature, turn++, ++seed);
  for (double wavelength = feature / 3; wavelength > kFinest; wavelength /= 2) {
    gullies_.push_back(make_lattice(wavelength, feature, turn++, ++seed));
  }
}

std::array<double, 2> Terrain::bounds() const {
  return {options_.base_m - (options_.coast ? 0 : kHighest * options_.relief_m) - options_.roughness_m,
          options_.base_m + kHighest * options_.relief_m + options_.roughness_m};
}

void Terrain::row(std::int64_t column, std::int64_t row, std::span<float> heights) const {
  const auto size = static_cast<std::int64_t>(heights.size());
  for (std::int64_t at = 0; at < size; at += kChunk) {
    const int count = static_cast<int>(std::min<std::int64_t>(kChunk, size - at));
    chunk(column + at, row, count, heights.data() + at);
  }
}

void Terrain::chunk(std::int64_t column, std::int64_t row, int count, float* heights) const {
  const OffsetRow none;
  NoiseRow noise;
  SlopeRow continent{};
  for (std::size_t k = 0; k < continent_.size(); ++k) {
    gradient_noise(continent_[k], column, row, count, none, noise);
    const float weight = 1.6F / static_cast<float>(1 << k);
    const float per_feature = weight * continent_[k].cells_per_feature;
    for (int i = 0; i < count; ++i) {
      continent.height[i] += weight * noise.value[i];
      continent.slope_x[i] += per_feature * noise.slope_x[i];
      continent.slope_z[i] += per_feature * noise.slope_z[i];
    }
  }

  OffsetRow bend;
  float jacobian[4][kChunk] = {};  // d bend.x / dx, d bend.x / dz, d bend.z / dx, d bend.z / dz
  for (std::size_t k = 0; k < bend_.size(); ++k) {
    gradient_noise(bend_[k], column, row, count, none, noise);
    float* axis = k < 2 ? bend.x : bend.z;
    const float weight = k % 2 == 0 ? 0.45F : 0.16F;
    const float per_feature = weight * bend_[k].cells_per_feature;
    for (int i = 0; i < count; ++i) {
      axis[i] += weight * noise.value[i];
      jacobian[k / 2 * 2][i] += per_feature * noise.slope_x[i];
      jacobian[k / 2 * 2 + 1][i] += per_feature * noise.slope_z[i];
    }
  }

  // Each octave is a crest line 1 - |n|, weaker where the land is low: valleys are smooth, crests are rough.
  SlopeRow ridges{};
  float amplitude[kChunk];
  for (int i = 0; i < count; ++i) amplitude[i] = 1;
  for (const NoiseLattice& lattice : ridges_) {
    gradient_noise(lattice, column, row, count, bend, noise);
    for (int i = 0; i < count; ++i) {
      const float n = 1.5F * noise.value[i];
      const float crest = std::sqrt(n * n + 0.015F);  // |n| with its crease rounded off
      const float slope = -1.5F * amplitude[i] * lattice.cells_per_feature * n / crest;
      const float x = slope * noise.slope_x[i];
      const float z = slope * noise.slope_z[i];
      ridges.height[i] += amplitude[i] * (0.55F - crest);
      ridges.slope_x[i] += x * (1 + jacobian[0][i]) + z * jacobian[2][i];
      ridges.slope_z[i] += x * jacobian[1][i] + z * (1 + jacobian[3][i]);
      amplitude[i] *= 0.45F * smooth_step(-0.6F, 0.5F, ridges.height[i] + 0.25F * continent.height[i]);
    }
  }

  const auto relief = static_cast<float>(options_.relief_m);
  const float steepness = relief / static_cast<float>(options_.feature_m);
  SlopeRow land{};
  for (int i = 0; i < count; ++i) {
    const float c = continent.height[i];
    const float plain = kPlain + kContinent * c;
    const float mountains = smooth_step(-0.7F, 0.3F, c);
    const float high = plain + 0.2F * mountains + (1.1F * mountains + 0.05F) * ridges.height[i];
    // Valleys are filled up to a floor that itself falls toward the plains.
    const float floor = plain + 0.02F * ridges.height[i];
    const float overlap = std::clamp(0.5F + (high - floor) / (2 * kFill), 0.0F, 1.0F);  // share of the rock
    const float filled = floor + overlap * (high - floor) + kFill * overlap * (1 - overlap);
    const float rock = (1.1F * mountains + 0.05F) * overlap + 0.02F * (1 - overlap);
    land.height[i] = relief * filled;
    land.slope_x[i] = steepness * (kContinent * continent.slope_x[i] + rock * ridges.slope_x[i]);
    land.slope_z[i] = steepness * (kContinent * continent.slope_z[i] + rock * ridges.slope_z[i]);
  }
  for (const NoiseLattice& lattice : gullies_) {
    carve_gullies(lattice, column, row, count, static_cast<float>(options_.feature_m) / lattice.cells_per_feature,
                  kGullyDepth, land);
  }

  gradient_noise(grit_, column, row, count, none, noise);
  const auto roughness = static_cast<float>(options_.roughness_m);
  const auto noise_seed = static_cast<std::uint32_t>(mix64(options_.seed ^ 0x5eed));
  for (int i = 0; i < count; ++i) {
    const float rock = std::clamp(land.height[i], -kHighest * relief, kHighest * relief);
    const bool sea = options_.coast && rock < 0;
    const auto hashed = mix(static_cast<std::uint32_t>(column + i) * 0x9e3779b1u ^
                            mix(static_cast<std::uint32_t>(row) * 0x85ebca77u + noise_seed));
    const float error = 0.5F * static_cast<float>(static_cast<std::int32_t>(hashed)) * 0x1p-31F + 0.5F * noise.value[i];
    heights[i] = (sea ? 0 : rock + roughness * error) + static_cast<float>(options_.base_m);
  }

  if (options_.void_fraction > 0) {
    gradient_noise(void_edge_, column, row, count, none, noise);
    // A patch covers pi r^2 of its cell, so that this share of cells with a patch gives the share of void samples.
    const double share = options_.void_fraction * kVoidCell * kVoidCell / (3.14159265 * kVoidRadius * kVoidRadius);
    for (int i = 0; i < count; ++i) {
      const std::int64_t c = column + i;
      const auto cell = mix(static_cast<std::uint32_t>(c / kVoidCell) * 0x9e3779b1u ^
                            mix(static_cast<std::uint32_t>(row / kVoidCell) + noise_seed + 1));
      if (cell * 0x1p-32 >= share) continue;
      const auto dx = static_cast<float>(c % kVoidCell) - 31.5F;
      const auto dz = static_cast<float>(row % kVoidCell) - 31.5F;
      const float reach = kVoidRadius + 9 * noise.value[i];
      if (dx * dx + dz * dz < reach * reach) heights[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace isohf::terrain
