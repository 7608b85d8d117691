#include "isohf/verify/metadata_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/metadata/cut_record.h"
#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/projection/projection.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/restore/lossless.h"
#include "isohf/surface.h"

namespace isohf {
namespace {

using Json = nlohmann::json;

/// What follows from other members is written with all its digits; other programs may add in another order.
constexpr double kSameTo = 1e-9;

class Contradictions {
 public:
  explicit Contradictions(const ArchiveReader& archive)
      : archive_(archive), metadata_(archive.metadata()), json_(Json::parse(archive.metadata_json())) {}

  std::vector<std::string> run() {
    check_lattice();
    check_names();
    check_place();
    check_ground();
    check_statistics();
    check_mosaic();
    check_residuals();
    return std::move(found_);
  }

 private:
  void add(const std::string& where, const std::string& what) { found_.push_back("metadata: " + where + ": " + what); }

  /// A number that follows from others, by its path.
  void check_number(const char* path, double expected, double scale) {
    const Json* at = &json_;
    for (std::string rest = path; !rest.empty();) {
      const std::string key = rest.substr(0, rest.find('.'));
      rest.erase(0, key.size() + 1);
      at = at->is_object() && at->contains(key) ? &at->at(key) : nullptr;
      if (at == nullptr) return add(path, fmt::format("is missing, must be {}", expected));
    }
    if (!at->is_number()) return add(path, fmt::format("is no number, must be {}", expected));
    if (!(std::abs(at->get<double>() - expected) <= kSameTo * scale)) {
      add(path, fmt::format("is {}, must be {}", at->get<double>(), expected));
    }
  }

  void check_one_of(const char* where, const std::string& name, std::initializer_list<const char*> known) {
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    add(where, fmt::format("is \"{}\", must be one of {}", name, fmt::join(known, ", ")));
  }

  /// check throws Error where the name is not known.
  template <typename Check>
  void check_name(const char* where, Check check) {
    try {
      check();
    } catch (const Error& error) {
      add(where, error.what());
    }
  }

  void check_lattice() {
    const TileGrid& grid = metadata_.grid;
    check_number("lattice.origin.x", 0.0, grid.sigma_x());
    check_number("lattice.origin.z", 0.0, grid.sigma_z());
    check_number("lattice.column_step", 2.0 * grid.sigma_x(), grid.sigma_x());
    check_number("lattice.row_step", grid.sigma_z(), grid.sigma_z());
    check_number("lattice.odd_row_shift", grid.sigma_x(), grid.sigma_x());
    const Quantisation& codes = metadata_.quantisation;
    const Json expected = codes.type == CodeType::kF32 ? Json("nan") : Json(codes.void_code());
    if (const auto found = json_.at("samples").value("void", Json()); found != expected) {
      add("samples.void", fmt::format("is {}, must be {}", found.dump(), expected.dump()));
    }
    if (!metadata_.z_range || codes.type == CodeType::kF32) return;
    const auto [first, second] = *metadata_.z_range;
    const double code = (second - first) / codes.scale;
    if (first != codes.offset) add("samples.range", fmt::format("begins at {}, the codes at {}", first, codes.offset));
    if (!(std::abs(code - std::round(code)) <= 1e-6) || std::round(code) > codes.max_code())
      add("samples.range", fmt::format("ends at {}, which is no code's elevation", second));
  }

  void check_names() {
    const SourceRecord& source = metadata_.source;
    check_one_of("units.horizontal", metadata_.horizontal_unit, {"metre", "unknown"});
    if (metadata_.vertical_unit.empty()) add("units.vertical", "is empty");
    const auto text = [](const Json& object, const char* member) { return object.at(member).get<std::string>(); };
    check_name("filter", [&] { (void)filter_from_string(text(json_, "filter")); });
    check_name("acquisition", [&] { (void)acquisition_from_string(text(json_, "acquisition")); });
    if (json_.contains("edges") && !json_.at("edges").is_null())
      check_name("edges", [&] { (void)edges_from_string(text(json_, "edges")); });
    check_one_of("source.registration", text(json_.at("source"), "registration"), {"area", "point"});
    check_name("source.sample_type", [&] { (void)sample_type_from_string(source.sample_type); });
    check_one_of("source.crs.unit", source.crs_unit, {"metre", "degree", "unknown", ""});
  }

  /// Where the samples lie, and what of the world they cover, follow from each other.
  void check_place() {
    const SourceRecord& source = metadata_.source;
    const TileGrid& grid = metadata_.grid;
    if (source.width < 2 || source.height < 2) return;  // a surface that was made of no raster
    if (metadata_.projection && metadata_.horizontal_unit != "metre") add("units.horizontal", "is not metre, on a map");
    check_number("valid.x0", 0.0, grid.world_width());
    check_number("valid.z0", 0.0, grid.world_height());
    if (metadata_.projection && source.crs_unit == "degree") check_ellipsoid();
    if (is_warped(metadata_)) {
      const ProjectionSpec& spec = metadata_.projection->spec;
      // Of another map, or on one, which only PROJ understands.
      if (source.crs_unit != "degree" || (spec.kind == ProjectionKind::kSystem && !spec.map)) return;
      if (!source.origin_x || !source.origin_y) return add("source.crs", "has no origin, which the projection needs");
      return check_name("source.crs", [&] { check_warped_degrees(); });
    }
    const double half = source.registration == Registration::kArea ? 0.5 : 0.0;
    if (!is_cut(metadata_)) {
      check_number("source.first_sample.x", half * source.spacing_x, source.spacing_x);
      check_number("source.first_sample.z", half * source.spacing_z, source.spacing_z);
    }
    const auto end = [](double first, std::int64_t samples, double beyond, double spacing, double world) {
      return std::clamp(first + (static_cast<double>(samples - 1) + beyond) * spacing, 0.0, world);
    };
    check_number("valid.x1",
                 end(source.first_sample_x, source.width, metadata_.wraps_x ? 1.0 - half : half, source.spacing_x,
                     grid.world_width()),
                 grid.world_width());
    check_number("valid.z1", end(source.first_sample_z, source.height, half, source.spacing_z, grid.world_height()),
                 grid.world_height());
    if (metadata_.projection && source.crs_unit == "degree" && source.origin_x && source.origin_y)
      check_scaled_degrees();
  }

  /// The ground under a source on a map: only who understands the map can tell more.
  void check_ground() {
    if (!metadata_.source.ground) return;
    const MapGround& ground = *metadata_.source.ground;
    const GeoExtent& bounds = ground.extent;
    constexpr double kSlack = 1e-6;
    const auto within = [](double value, double least, double most) {
      return value >= least - kSlack && value <= most + kSlack;
    };
    const bool is_ground = within(bounds.south, -90.0, bounds.north) && within(bounds.north, bounds.south, 90.0) &&
                           within(bounds.east, bounds.west, bounds.west + 360.0) && within(bounds.west, -720.0, 720.0);
    if (!is_ground) add("source.ground.bounds", "are no rectangle of longitudes and latitudes");
    if (!within(ground.centre.latitude, bounds.south, bounds.north))
      add("source.ground.centre", "lies outside of the bounds");
    if (!(ground.least_scale > 0.0 && ground.least_scale <= ground.mean_scale + kSlack &&
          ground.mean_scale <= ground.most_scale + kSlack && ground.worst_error >= 0.0)) {
      add("source.ground.map_scale", "has a mean that is not between least and most, or an error below 0");
    }
    if (!within(ground.worst_place.latitude, -90.0, 90.0)) add("source.ground.map_scale", "names no latitude");
  }

  /// The map is of the source's body.
  void check_ellipsoid() {
    const SourceRecord& source = metadata_.source;
    const Ellipsoid& found = metadata_.projection->spec.ellipsoid;
    Ellipsoid expected;
    if (source.semi_major_axis_m) expected = {*source.semi_major_axis_m, source.inverse_flattening.value_or(0.0)};
    const auto differ = [](double a, double b) { return !(std::abs(a - b) <= kSameTo * std::abs(b)); };
    if (differ(found.semi_major_axis_m, expected.semi_major_axis_m) ||
        differ(found.inverse_flattening, expected.inverse_flattening)) {
      add("projection",
          fmt::format("is of an ellipsoid of {} m, 1/{}; the source's is of {} m, 1/{}", found.semi_major_axis_m,
                      found.inverse_flattening, expected.semi_major_axis_m, expected.inverse_flattening));
    }
  }

  /// Degrees on a map: the first sample's place, the spacings in the middle of the ground, and the ground's rectangle.
  void check_warped_degrees() {
    const SourceRecord& source = metadata_.source;
    const ProjectionRecord& map = *metadata_.projection;
    const WorldPoint first = ExactWarp(*archive_geometry(metadata_).warp).world_from_source({0.0, 0.0});
    const double half = source.registration == Registration::kArea ? 0.5 : 0.0;
    const auto past_first = [&](std::int64_t samples) { return static_cast<double>(samples - 1) + half; };
    GeoExtent ground;
    ground.west = *source.origin_x - half * source.crs_spacing_x;
    ground.east = *source.origin_x + past_first(source.width) * source.crs_spacing_x;
    ground.north = std::min(*source.origin_y + half * source.crs_spacing_y, 90.0);
    ground.south = std::max(*source.origin_y - past_first(source.height) * source.crs_spacing_y, -90.0);
    const DegreeLengths degree = degree_lengths(map.spec.ellipsoid, ground.middle().latitude);
    const double spacing_x = source.crs_spacing_x * degree.along_parallel;
    const double spacing_z = source.crs_spacing_y * degree.along_meridian;
    check_projected("source.first_sample.x", source.first_sample_x, first.x, spacing_x);
    check_projected("source.first_sample.z", source.first_sample_z, first.z, spacing_z);
    check_projected("source.spacing.x", source.spacing_x, spacing_x, 1e-4 * spacing_x);
    check_projected("source.spacing.z", source.spacing_z, spacing_z, 1e-4 * spacing_z);
    // Rounded up, and found by walking along the ground's sides.
    const MapBounds bounds = projected_bounds(Projection(map.spec), ground);
    const auto check_end = [&](const char* where, double stated, double length, double world, double spacing) {
      check_projected(where, stated, std::min(length, world), 100.0 * std::max(spacing, 1e-4 * length));
    };
    check_end("valid.x1", metadata_.valid.x1, bounds.east - map.origin.easting, metadata_.grid.world_width(),
              spacing_x);
    check_end("valid.z1", metadata_.valid.z1, map.origin.northing - bounds.south, metadata_.grid.world_height(),
              spacing_z);
  }

  /// To a hundredth of `spacing` what the projection makes of the source's degrees.
  void check_projected(const char* where, double stated, double found, double spacing) {
    if (std::abs(stated - found) <= 0.01 * spacing) return;
    add(where, fmt::format("is {}, the projection makes {} of the source's degrees", stated, found));
  }

  /// Equirectangular: degrees times their lengths.
  void check_scaled_degrees() {
    const SourceRecord& source = metadata_.source;
    const ProjectionSpec& spec = metadata_.projection->spec;
    const DegreeLengths degree = degree_lengths(spec.ellipsoid, spec.latitude_0);
    const double spacing_x = source.crs_spacing_x * degree.along_parallel;
    const double spacing_z = source.crs_spacing_y * degree.along_meridian;
    check_projected("source.spacing.x", source.spacing_x, spacing_x, 1e-4 * spacing_x);
    check_projected("source.spacing.z", source.spacing_z, spacing_z, 1e-4 * spacing_z);
    // The map place of world (0, 0).
    const MapPoint& origin = metadata_.projection->origin;
    const double turn = 360.0 * degree.along_parallel;
    const double easting = (*source.origin_x - spec.longitude_0) * degree.along_parallel - source.first_sample_x;
    check_projected("projection.origin.easting", origin.easting,
                    origin.easting + std::remainder(easting - origin.easting, turn), spacing_x);
    check_projected("projection.origin.northing", origin.northing,
                    (*source.origin_y - spec.latitude_0) * degree.along_meridian + source.first_sample_z, spacing_z);
  }

  void check_statistics() {
    const Statistics& said = metadata_.statistics;
    if (said.voids > said.vertices) add("statistics.voids", "are more than the vertices");
    if (said.worst_rounding < 0.0) add("statistics.worst_rounding", "is below 0");
  }

  void check_mosaic() {
    if (!metadata_.source.mosaic) return;
    const MosaicRecord& mosaic = *metadata_.source.mosaic;
    check_one_of("source.mosaic.overlap", mosaic.overlap, {"last", "first"});
    if (mosaic.files < static_cast<std::int64_t>(mosaic.first_names.size()))
      add("source.mosaic.files", "are fewer than the names");
  }

  void check_residuals() {
    try {
      const auto record = lossless_record(metadata_);
      if (!record) return;
      const SourceRecord& source = metadata_.source;
      if (to_string(record->mapping.type) != source.sample_type)
        add("lossless.sample_type",
            fmt::format("is {}, the source's is {}", to_string(record->mapping.type), source.sample_type));
      if (record->mapping.z_scale != source.z_scale || record->mapping.z_offset != source.z_offset)
        add("lossless.z_scale, .z_offset", "are not the source's");
      const std::uint64_t bytes = members_in(archive_, "residual/{row:8}", is_residual).bytes;
      if (bytes != record->residual_bytes && !archive_.reads_by_directory())
        add("lossless.residual_bytes", fmt::format("is {}, the members have {}", record->residual_bytes, bytes));
    } catch (const Error&) {
      // Restoring the samples tells of it.
    }
  }

  const ArchiveReader& archive_;
  const Metadata& metadata_;
  Json json_;
  std::vector<std::string> found_;
};

}  // namespace

MemberTotals members_in(const ArchiveReader& archive, const std::string& table,
                        const std::function<bool(const std::string& name)>& is_one) {
  MemberTotals totals;
  for (const MemberTable& of : archive.tables()) {
    if (of.name != table) continue;
    totals.members += of.stored;
    totals.bytes += of.compressed_bytes;
  }
  for (const MemberEntry& member : archive.loose_members()) {
    if (!is_one(member.name)) continue;
    ++totals.members;
    totals.bytes += member.compressed_bytes;
  }
  return totals;
}

std::string why_other_data(const ArchiveReader& archive) {
  if (archive.reads_by_directory()) return {};
  for (const auto& [name, stated] : archive.metadata().extensions) {
    if (name != kDataCrcName) continue;
    const std::string found = fmt::format("\"{:08x}\"", data_crc32(archive.source(), archive.path()));
    if (found != stated) return fmt::format("the members' data have the CRC-32 {}, the metadata say {}", found, stated);
  }
  return {};
}

std::vector<std::string> contradictions_in(const ArchiveReader& archive) {
  return Contradictions(archive).run();
}

}  // namespace isohf
