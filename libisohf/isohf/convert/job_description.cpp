#include "isohf/convert/job_description.h"
#include "isohf/convert/stages/texture_stage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libdeflate.h>
#include <sys/stat.h>
#include <zlib.h>

#include <GeographicLib/Constants.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "isohf/archive.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/journal.h"

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/error.h"
#include "isohf/projection/crs/proj.h"

namespace isohf {
namespace {

/// As UTF-8, which JSON keeps and hashes are of: what is none is taken for ISO 8859-1, as .prj files have it.
void make_utf8(std::string& text) {
  try {
    (void)nlohmann::json(text).dump();  // refuses what is none
  } catch (const nlohmann::json::exception&) {
    std::string converted;
    for (const char byte : text) {
      const auto code = static_cast<unsigned char>(byte);
      if (code < 0x80U) {
        converted += byte;
      } else {
        converted += static_cast<char>(0xC0U | (code >> 6U));
        converted += static_cast<char>(0x80U | (code & 0x3FU));
      }
    }
    text = std::move(converted);
  }
}

SourceRecord record_of(const SourceInfo& info, const SourceFrame& frame, const SourceNote& note) {
  const Georeference& place = info.georeference;
  SourceRecord record;
  record.name = note.name.empty() ? std::filesystem::path(info.path).filename().string() : note.name;
  record.mosaic = note.mosaic;
  record.options = note.options;
  record.format = info.format;
  record.width = info.width;
  record.height = info.height;
  record.repeats_column = info.repeats_column;
  record.sample_type = to_string(info.sample_type);
  record.channel = info.channel;
  record.z_scale = info.z_scale;
  record.z_offset = info.z_offset;
  record.void_values = info.void_values;
  if (std::isfinite(info.valid_min) || std::isfinite(info.valid_max))
    record.raw_range = {info.valid_min, info.valid_max};
  record.valid_range = info.valid_range;
  record.fill_distance = info.fill_distance;
  record.registration = frame.registration;
  record.first_sample_x = frame.first_sample_x;
  record.first_sample_z = frame.first_sample_z;
  record.spacing_x = frame.spacing_x;
  record.spacing_z = frame.spacing_z;
  if (place.has_origin) {
    record.origin_x = place.origin_x;
    record.origin_y = place.origin_y;
  }
  record.crs_unit = place.unit == HorizontalUnit::kMetre    ? "metre"
                    : place.unit == HorizontalUnit::kDegree ? "degree"
                                                            : "unknown";
  if (place.has_origin || place.unit != HorizontalUnit::kUnknown) {
    record.crs_spacing_x = place.spacing_x;
    record.crs_spacing_y = place.spacing_y;
  }
  if (place.unit == HorizontalUnit::kMetre) record.metres_per_unit = place.metres_per_unit;
  record.ground = frame.ground;
  record.crs_name = place.system.name;
  record.crs_epsg = place.system.epsg;
  record.crs_wkt = place.system.wkt;
  record.body = place.system.body;
  record.semi_major_axis_m = place.system.semi_major_axis_m;
  record.inverse_flattening = place.system.inverse_flattening;
  record.vertical_datum = place.system.vertical_datum;
  record.vertical_epsg = place.system.vertical_epsg;
  for (std::string* text : {&record.name, &record.format, &record.channel, &record.crs_name, &record.crs_wkt,
                            &record.body, &record.vertical_datum}) {
    make_utf8(*text);
  }
  return record;
}

std::string producer_of(const ConvertOptions& options) {
  return options.producer.empty() ? "isohf " ISOHF_VERSION : options.producer;
}

std::string describe_voids(const SourceInfo& info) {
  return fmt::format("[{}] {}:{} fill {}", fmt::join(info.void_values, " "), info.valid_min, info.valid_max,
                     info.fill_distance);
}

std::string heights_fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options,
                                bool of_files) {
  struct stat status {};
  const bool known = of_files && ::stat(info.path.c_str(), &status) == 0;
  const TileShape& shape = plan.grid.shape();
  return fmt::format(
      "{} | {} {} bytes {}.{:09} {}x{} {} channel '{}' scale {} {} void {} | shape {}x{}/{} tiles {}x{} extent {} {} "
      "first {} {} "
      "spacing {} {} | {} range {} step {} clamp {} | {} {} | level {} | statistics of the source | seeds {}",
      of_files ? producer_of(options) : "",
      // The archive itself knows its source by the name that it states.
      of_files || options.source_note.name.empty() ? std::filesystem::path(info.path).filename().string()
                                                   : options.source_note.name,
      known ? status.st_size : 0, known ? status.st_mtim.tv_sec : 0, known ? status.st_mtim.tv_nsec : 0, info.width,
      info.height, to_string(info.sample_type), info.channel, info.z_scale, info.z_offset, describe_voids(info),
      shape.columns(), shape.rows(), shape.levels(), plan.grid.tile_columns(), plan.grid.tile_rows(),
      plan.grid.extent_x(), plan.grid.extent_z(), plan.frame.first_sample_x, plan.frame.first_sample_z,
      plan.frame.spacing_x, plan.frame.spacing_z, to_string(options.code_type),
      options.z_range ? fmt::format("{}:{}", options.z_range->first, options.z_range->second) : "data",
      options.step           ? fmt::format("{}", *options.step)
      : options.max_rounding ? fmt::format("rounding {}", *options.max_rounding)
                             : "auto",
      options.clamp_range, to_string(options.filter.value_or(kDefaultFilter)), to_string(options.acquisition),
      level_of(options.effort),
      options.shadow_seeds ? fmt::format("{} []", options.shadow_seeds->sun_min_deg) : "none");
}

/// of_files: with sizes and times of the files, and the program's version.
std::string fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options, bool of_files) {
  std::string job = heights_fingerprint(info, plan, options, of_files);
  if (of_files && !options.source_note.fingerprint.empty()) job += " | " + options.source_note.fingerprint;
  if (const std::string& datum = info.georeference.system.vertical_datum; !datum.empty()) job += " | above " + datum;
  if (of_files && !options.planes) job += " | no planes";
  if (options.step && options.max_rounding) job += fmt::format(" | rounding {}", *options.max_rounding);
  if (options.max_error) job += fmt::format(" | max error {}", *options.max_error);
  if (plan.frame.projection) {
    const ProjectionRecord& on = *plan.frame.projection;
    job += fmt::format(" | on {} {} {} {} {} {} {} at {} {}{}", to_string(on.spec.kind),
                       on.spec.ellipsoid.semi_major_axis_m, on.spec.longitude_0, on.spec.latitude_0, on.spec.parallel_1,
                       on.spec.parallel_2, on.spec.scale_0, on.origin.easting, on.origin.northing,
                       plan.frame.wraps_x ? " round" : "");
    if (!on.spec.system.text.empty()) job += fmt::format(" by {} {}", on.spec.system.text, on.spec.system.operation);
  } else if (plan.frame.wraps_x) {
    job += " | round";
  }
  if (options.texture) {
    const TextureRequest& texture = *options.texture;
    const PhotoInfo& photo = texture.photo->info();
    struct stat status {};
    const bool known = of_files && ::stat(photo.path.c_str(), &status) == 0;
    job += fmt::format(" | texture {} {} bytes {}.{:09} {}x{}x{} {} {} {}",
                       std::filesystem::path(photo.path).filename().string(), known ? status.st_size : 0,
                       known ? status.st_mtim.tv_sec : 0, known ? status.st_mtim.tv_nsec : 0, photo.width, photo.height,
                       photo.channels, texture.format ? to_string(*texture.format) : "auto", texture.max_size,
                       kTextureQuality);
    if (photo.georeference) {
      job += fmt::format(" at {} {} step {} {}", photo.georeference->origin_x, photo.georeference->origin_y,
                         photo.georeference->spacing_x, photo.georeference->spacing_y);
    }
  }
  return job;
}

/// How a finished archive differs from what the job would make now; empty if it does not.
std::string difference_from_job(const std::string& archive, const SourceInfo& info,
                                const std::vector<std::string>& files, const ConvertOptions& options) {
  std::error_code none;
  const auto written = std::filesystem::last_write_time(archive, none);
  for (const std::string& file : files) {
    if (std::filesystem::last_write_time(file, none) > written) return file + " was changed after it was written";
  }
  const auto made = nlohmann::json::parse(ArchiveReader(archive).metadata_json());
  const auto asked =
      nlohmann::json::parse(format_metadata(describe_job(info, make_plan(info, options.plan), options, {})));
  const bool same_job = made.contains(kJobName) && made.at(kJobName) == asked.at(kJobName);
  if (same_job && made.value("planes", nlohmann::json()) == asked.value("planes", nlohmann::json())) return {};
  // Members that are known before the work, by themselves and then by their own members.
  std::string found;
  const auto compare = [&](const std::string& name, const nlohmann::json& theirs, const nlohmann::json& ours) {
    if (theirs == ours) return;
    found += fmt::format("{}{} {}, not {}", found.empty() ? "" : ", ", name, theirs.dump(), ours.dump());
  };
  for (const char* name : {"tile_shape", "tiles", "extent", "valid", "projection", "planes", "wraps_x", "filter",
                           "acquisition", "edges", "level", "source"}) {
    const nlohmann::json theirs = made.value(name, nlohmann::json());
    const nlohmann::json ours = asked.value(name, nlohmann::json());
    if (!theirs.is_object() || !ours.is_object()) {
      const bool follows_filter =
          std::string_view(name) == "edges" && made.value("filter", "") != asked.value("filter", "");
      if (!follows_filter) compare(name, theirs, ours);
      continue;
    }
    for (const auto& [member, value] : ours.items()) {
      if (member != "stored")
        compare(fmt::format("{}.{}", name, member), theirs.value(member, nlohmann::json()), value);
    }
  }
  const std::string type = to_string(options.code_type);
  compare("samples.type", made.at("samples").at("type"), type);
  return "was made otherwise: " +
         (found.empty() ? "other elevation codes, shadow seeds, textures or residuals" : found);
}

/// Other versions of these may make other bytes. libdeflate and GeographicLib state those they were compiled against.
std::string library_versions() {
  return fmt::format("zlib {}, libdeflate {}, PROJ {}, GeographicLib {}", zlibVersion(), LIBDEFLATE_VERSION_STRING,
                     proj::release(), GEOGRAPHICLIB_VERSION_STRING);
}

}  // namespace

std::string job_fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options) {
  return fingerprint(info, plan, options, true) + " | " + library_versions();
}

Metadata describe_job(const SourceInfo& info, const Plan& plan, const ConvertOptions& options,
                      const Quantisation& quantisation) {
  Metadata metadata(plan.grid);
  metadata.quantisation = quantisation;
  metadata.z_range = options.z_range;
  metadata.horizontal_unit = plan.frame.in_metres ? "metre" : "unknown";
  metadata.vertical_unit = info.vertical_unit.empty() ? "unknown" : info.vertical_unit;
  make_utf8(metadata.vertical_unit);
  metadata.valid = plan.frame.bounds();
  metadata.valid.x1 = std::min(metadata.valid.x1, plan.grid.world_width());
  metadata.valid.z1 = std::min(metadata.valid.z1, plan.grid.world_height());
  metadata.projection = plan.frame.projection;
  metadata.wraps_x = plan.frame.wraps_x;
  if (options.planes) metadata.planes = planes_for(plan.grid);
  metadata.filter = options.filter.value_or(kDefaultFilter);
  metadata.edges = usual_edges(*metadata.filter);
  metadata.acquisition = options.acquisition;
  metadata.effort = options.effort;
  metadata.source = record_of(info, plan.frame, options.source_note);
  metadata.extensions.emplace_back(kStatisticsOfName, kStatisticsOfSource);
  metadata.producer = producer_of(options);
  const std::string job = fingerprint(info, plan, options, false) + (options.lossless ? " | lossless" : "");
  const Digest digest = sha256(std::as_bytes(std::span<const char>(job)));
  metadata.extensions.emplace_back(kJobName, '"' + hex(digest) + '"');
  return metadata;
}

bool is_converted(const std::string& output, const SourceInfo& info, const std::vector<std::string>& files,
                  const ConvertOptions& options) {
  std::error_code none;
  if (!std::filesystem::exists(output, none)) return false;
  ErrorCode code = ErrorCode::kInvalidArgument;
  std::string difference;
  try {
    difference = difference_from_job(output, info, files, options);
  } catch (const Error& error) {
    const std::string why = error.what();
    code = error.code();
    difference = "is not a complete archive: " + why.substr(why.starts_with(output + ": ") ? output.size() + 2 : 0);
  }
  if (difference.empty()) {
    // A run that was killed between its last two steps left its journal.
    const std::string part = output + ".part";
    if (!std::filesystem::exists(part, none)) std::filesystem::remove(part + ".journal", none);
    remove_part_aside(part);
    return true;
  }
  if (options.overwrite) return false;
  throw Error(code, {output, difference, "", "`overwrite` replaces it"});
}

}  // namespace isohf
