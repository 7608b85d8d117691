#include "paging/tile_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "isohf/archive.h"
#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf::view {
namespace {

/// Another reader of the same bytes, whatever its file's name has become: one whose reference systems are understood as
/// far as can be, which may load PROJ. `archive`, which several threads may be reading, outlives it.
ArchiveReader understood(const ArchiveReader& archive) {
  ArchiveReader another({std::shared_ptr<void>(), &archive.source()}, archive.path());
  try {
    understand_source(another);
  } catch (const Error&) {
    // Places have no longitude and latitude then, nor one in the sky.
  }
  return another;
}

/// Falls that are as near are the same.
constexpr double kSameFall = 1e-9;

/// The place of an archive's world; nullopt if that is not known.
std::optional<WorldGeoreference> understood_places(const ArchiveReader& archive) {
  try {
    return WorldGeoreference(understood(archive).metadata());
  } catch (const Error&) {
    return std::nullopt;  // nor coordinates
  }
}

SourceFacts facts_of(const Metadata& metadata) {
  const GroundScale ground = ground_scale(metadata);
  const Quantisation& stored = metadata.quantisation;
  SourceFacts facts{scaled(metadata.grid, ground),
                    {stored.offset * ground.elevation, stored.scale * ground.elevation},
                    scaled(metadata.valid, ground),
                    ground};
  if (metadata.planes.count > 0) {
    facts.planes.emplace(facts.grid, metadata.planes.stride, metadata.planes.count, metadata.wraps_x);
  }
  facts.textures = texture_info(metadata);
  return facts;
}

class ArchiveSource final : public TileSource {
 public:
  explicit ArchiveSource(ArchiveReader reader) : TileSource(facts_of(reader.metadata())), reader_(std::move(reader)) {
    const Metadata& metadata = reader_.metadata();
    facts_.is_to_scale = ground_unit() == "metre";
    for (int plane = 1; facts_.planes && plane <= facts_.planes->count(); ++plane) {
      coarse_.push_back(std::make_unique<Coarse>(*this, plane));
    }
    if (is_float()) {
      // Floats on the GPU would be four bytes a vertex: round them to 65535 steps over the dataset's range.
      // The statistics' leaves out what lies beyond the source.
      const TileBounds whole = whole_bounds(*this);
      facts_.scale = {whole.low, whole.high > whole.low ? (whole.high - whole.low) / (kVoidCode - 1) : 1.0};
      for (const auto& coarse : coarse_) coarse->set_scale(facts_.scale);
    }
    if (facts_.textures) textures_.emplace(reader_);
    if (const auto info = shadow_seed_info(metadata)) {
      seeds_.emplace(reader_);
      const double fall = info->fall_per_half_step(metadata.grid, metadata.quantisation, info->sun_min_deg);
      facts_.seeded_fall = (1.0 - kSameFall) * fall * (is_float() ? world_per_elevation() / scale().scale : 1.0);
    }
  }

  [[nodiscard]] TileBounds bounds(TileIndex tile) const override { return bounds(tile, 0); }
  [[nodiscard]] const TileSource& plane(int plane) const override {
    if (plane == 0) return *this;
    return *coarse_[static_cast<std::size_t>(plane) - 1];
  }

  void read(TileIndex tile, std::span<std::uint16_t> codes) const override { convert(reader_.read_tile(tile), codes); }
  void read_heights(TileIndex tile, std::span<float> heights) const override {
    exact_codes(reader_.read_tile(tile), heights);
  }
  CasterRows read_casters(TileIndex tile, LightTravel travel, std::span<float> heights) const override {
    const TileCodes stored = reader_.read_tile(tile);
    exact_codes(stored, heights);
    HullSeeds seeds = seeds_->hulls(tile, stored);
    CasterRows casters = std::move(travel == LightTravel::kEastward ? seeds.eastward : seeds.westward);
    for (ShadowCaster& caster : casters.casters) {
      if (is_float()) caster.height = exact_code_of(caster.height);
    }
    return casters;
  }

  [[nodiscard]] std::vector<float> sun_shares(std::span<const WorldPoint> points, const Sun& sun) const override {
    std::vector<WorldPoint> places;
    for (const WorldPoint point : points) places.push_back(to_archive(point));
    std::vector<SunSample> samples(places.size());
    Surface(reader_).sample(places, sun, 0.0, std::span(samples));
    std::vector<float> shares;
    for (const SunSample& sample : samples) shares.push_back(static_cast<float>(sample.share));
    return shares;
  }

 private:
  /// A coarse plane of the archive.
  class Coarse final : public TileSource {
   public:
    Coarse(const ArchiveSource& whole, int plane)
        : TileSource({whole.planes()->grid(plane), whole.scale(), whole.covered(), whole.facts_.ground_scale}),
          whole_(whole),
          plane_(plane) {}
    void set_scale(ViewScale scale) { facts_.scale = scale; }
    [[nodiscard]] TileBounds bounds(TileIndex tile) const override { return whole_.bounds(tile, plane_); }
    [[nodiscard]] const Metadata* metadata() const override { return whole_.metadata(); }
    void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
      whole_.convert(whole_.reader_.read_tile(tile, plane_), codes);
    }
    void read_heights(TileIndex tile, std::span<float> heights) const override {
      whole_.exact_codes(whole_.reader_.read_tile(tile, plane_), heights);
    }

   private:
    const ArchiveSource& whole_;
    int plane_;
  };

 public:
  [[nodiscard]] Place describe(WorldPoint at, double height) const override {
    Place place = TileSource::describe(at, height);
    place.unit = height_unit();
    std::call_once(georeference_once_, [this] { georeference_ = understood_places(reader_); });
    if (!georeference_) return place;
    if (georeference_->has_source() && reader_.metadata().source.crs_unit != "degree") {
      place.map = georeference_->source_from_world(place.at);
    }
    if (georeference_->has_geo()) place.geo = georeference_->geo_from_world(place.at);
    // Sources that are registered by areas may end half a sample beyond a pole.
    if (place.geo && std::abs(place.geo->latitude) > 90.0) place.geo.reset();
    return place;
  }
  [[nodiscard]] const Metadata* metadata() const override { return &reader_.metadata(); }
  [[nodiscard]] DaySky sky() const override { return DaySky(understood(reader_)); }

  [[nodiscard]] bool has_texture(TileIndex tile) const override { return textures_ && textures_->has(tile); }
  [[nodiscard]] Picture read_texture(TileIndex tile, int level) const override {
    return textures_->read_rgba(tile, level);
  }

 private:
  [[nodiscard]] TileBounds bounds(TileIndex tile, int plane) const {
    const TileEntry entry = reader_.tile_entry(tile, plane);
    if (!entry.stored) return {};
    if (is_float()) {
      return {true, std::bit_cast<float>(entry.code_min) * world_per_elevation(),
              std::bit_cast<float>(entry.code_max) * world_per_elevation()};
    }
    return {true, scale().offset + scale().scale * entry.code_min, scale().offset + scale().scale * entry.code_max};
  }

  [[nodiscard]] bool is_float() const { return reader_.metadata().quantisation.type == CodeType::kF32; }
  [[nodiscard]] static std::uint16_t rounded(double code) {
    return static_cast<std::uint16_t>(std::clamp(std::round(code), 0.0, kVoidCode - 1.0));
  }
  /// A tile's heights in codes, unrounded: [C x R] out, NaN void.
  void exact_codes(const TileCodes& stored, std::span<float> heights) const {
    if (is_float()) {
      std::transform(stored.heights.begin(), stored.heights.end(), heights.begin(),
                     [this](float height) { return static_cast<float>(exact_code_of(height)); });
      return;
    }
    const std::uint32_t void_code = reader_.metadata().quantisation.void_code();
    std::transform(stored.codes.begin(), stored.codes.end(), heights.begin(), [=](std::uint16_t code) {
      return code == void_code ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code);
    });
  }
  [[nodiscard]] double exact_code_of(double elevation) const {
    return (elevation * world_per_elevation() - scale().offset) / scale().scale;
  }
  [[nodiscard]] std::uint16_t code_of(float elevation) const { return rounded(exact_code_of(elevation)); }

  void convert(const TileCodes& stored, std::span<std::uint16_t> codes) const {
    if (stored.type == CodeType::kF32) {
      ISOHF_ASSERT(stored.heights.size() == codes.size());
      std::transform(stored.heights.begin(), stored.heights.end(), codes.begin(),
                     [this](float height) { return std::isnan(height) ? kVoidCode : code_of(height); });
      return;
    }
    ISOHF_ASSERT(stored.codes.size() == codes.size());
    const std::uint32_t void_code = reader_.metadata().quantisation.void_code();
    std::transform(stored.codes.begin(), stored.codes.end(), codes.begin(),
                   [=](std::uint16_t code) { return code == void_code ? kVoidCode : code; });
  }

  ArchiveReader reader_;
  mutable std::once_flag georeference_once_;
  mutable std::optional<WorldGeoreference> georeference_;
  std::optional<TextureReader> textures_;
  std::optional<ShadowSeedReader> seeds_;
  std::vector<std::unique_ptr<Coarse>> coarse_;
};

}  // namespace

void TileSource::read_heights(TileIndex tile, std::span<float> heights) const {
  std::vector<std::uint16_t> codes(heights.size());
  read(tile, codes);
  std::transform(codes.begin(), codes.end(), heights.begin(), [](std::uint16_t code) {
    return code == kVoidCode ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code);
  });
}

CasterRows TileSource::read_casters(TileIndex, LightTravel, std::span<float>) const {
  throw Error(ErrorCode::kUnsupported, "this source has no shadow seeds");
}

Place TileSource::describe(WorldPoint at, double height) const {
  Place place;
  place.at = to_archive(at);
  place.elevation = height / world_per_elevation();
  place.decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(scale().scale / world_per_elevation()))), 0, 6);
  return place;
}

WorldPoint TileSource::from_archive(WorldPoint at) const {
  return {at.x * facts_.ground_scale.x, at.z * facts_.ground_scale.z};
}

std::vector<float> TileSource::sun_shares(std::span<const WorldPoint>, const Sun&) const {
  return {};
}

WorldPoint TileSource::to_archive(WorldPoint at) const {
  return {at.x / facts_.ground_scale.x, at.z / facts_.ground_scale.z};
}

std::string TileSource::ground_unit() const {
  if (facts_.ground_scale.z != 1.0) return "metre";
  return metadata() == nullptr || metadata()->horizontal_unit == "unknown" ? "" : metadata()->horizontal_unit;
}

std::string TileSource::height_unit() const {
  return metadata() == nullptr || metadata()->vertical_unit == "unknown" ? "" : metadata()->vertical_unit;
}

DaySky TileSource::sky() const {
  throw Error(ErrorCode::kInvalidArgument, "the sun's way over this ground is not known");
}

Picture TileSource::read_texture(TileIndex, int) const {
  throw Error(ErrorCode::kUnsupported, "this source has no textures");
}

TileVolume tile_volume(const TileGrid& grid, TileIndex tile, const TileBounds& bounds, const ViewState& view) {
  const Vec3 low = Vec3{static_cast<double>(tile.column) * grid.extent_x(), bounds.low * view.exaggeration,
                        static_cast<double>(tile.row) * grid.extent_z()} -
                   view.eye;
  return {low, low + Vec3{grid.extent_x(), (bounds.high - bounds.low) * view.exaggeration, grid.extent_z()}};
}

Planes planes_of(const TileSource& source) {
  return source.planes() != nullptr ? *source.planes() : Planes(source.grid(), 0, 0, false);
}

namespace {

TileBounds find_whole_bounds(const TileSource& source_of_tiles) {
  // The coarsest plane knows of all that lies below.
  const Planes* planes = source_of_tiles.planes();
  const TileSource& source = planes == nullptr ? source_of_tiles : source_of_tiles.plane(planes->count());
  TileBounds whole{false, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const TileGrid& grid = source.grid();
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    const TileBounds tile = source.bounds(grid.tile_at(flat));
    if (!tile.stored) continue;
    whole.stored = true;
    whole.low = std::min(whole.low, tile.low);
    whole.high = std::max(whole.high, tile.high);
  }
  if (!whole.stored) return {};
  return whole;
}

}  // namespace

TileBounds whole_bounds(const TileSource& source) {
  std::call_once(source.whole_once_, [&] { source.whole_ = find_whole_bounds(source); });
  return source.whole_;
}

std::unique_ptr<TileSource> open_archive(const std::string& path, const std::string& name) {
  return std::make_unique<ArchiveSource>(name.empty() ? ArchiveReader(path)
                                                      : ArchiveReader(open_file_source(path), name));
}

}  // namespace isohf::view
