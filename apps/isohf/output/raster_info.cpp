#include "output/raster_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/io/foreign_file.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/sampling/source/read_step.h"
#include "options/describe.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

/// JSON has no numbers that are not finite.
ordered_json number_or_text(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : (value > 0.0 ? "inf" : "-inf");
}

ordered_json or_null(const std::string& text) {
  return text.empty() ? ordered_json(nullptr) : ordered_json(text);
}

template <typename T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

const char* unit_word(const Georeference& place) {
  if (place.unit == HorizontalUnit::kDegree) return "degree";
  if (place.unit == HorizontalUnit::kUnknown) return "unknown";
  return place.metres_per_unit == 1.0 ? "metre" : "linear";
}

std::string describe_nodata(const SourceInfo& info) {
  const bool is_transparency = info.void_values.size() == 1 && !is_floating(info.sample_type) &&
                               info.valid_min == info.void_values.front() + 1.0 && !std::isfinite(info.valid_max);
  if (is_transparency) return fmt::format("transparent samples, read as {}", info.void_values.front());
  std::string text;
  for (const double value : info.void_values) text += fmt::format("{}, ", value);
  if (is_floating(info.sample_type)) text += "NaN and infinities, ";
  if (std::isfinite(info.valid_min) || std::isfinite(info.valid_max)) {
    text += fmt::format("samples outside {} to {}, ", info.valid_min, info.valid_max);
  }
  return text.empty() ? "none declared" : text.substr(0, text.size() - 2);
}

void add_statistics(const SourceSurvey& survey, Report& report) {
  const SourceScan scan = survey.scan();
  const bool has_elevations = scan.valid > 0;
  ordered_json undeclared = ordered_json::array();
  for (const UndeclaredVoid& found : survey.outliers().voids) {
    undeclared.push_back({{"value", found.value}, {"count", found.count}});
  }
  const ordered_json statistics = {{"samples", scan.valid + scan.voids},
                                   {"voids", scan.voids},
                                   {"min", has_elevations ? ordered_json(scan.range.min) : ordered_json(nullptr)},
                                   {"max", has_elevations ? ordered_json(scan.range.max) : ordered_json(nullptr)},
                                   {"mean", or_null(survey.mean())},
                                   {"undeclared_voids", undeclared}};
  report.add("statistics", statistics, "range",
             has_elevations ? fmt::format("{:.9g} .. {:.9g}, mean {:.9g}", scan.range.min, scan.range.max,
                                          survey.mean().value_or(0.0))
                            : "no elevation at all");
  report.line("samples", fmt::format("{}, {} of them nodata", describe_count(scan.valid + scan.voids),
                                     describe_count(scan.voids)));
}

}  // namespace

bool is_archive(const std::string& path, const OpenOptions& options) {
  if (options.raw) return false;
  if (native_format_of(path, options) != nullptr) return false;
  return path.ends_with(".isohf") || foreign_file(path).is == "an isohf archive";
}

std::string describe_reference(const ReferenceSystem& system) {
  std::string text = system.name;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (system.epsg) add(fmt::format("EPSG:{}", *system.epsg));
  if (system.body != "Earth") {
    if (!system.body.empty()) add(system.body);
    if (system.semi_major_axis_m) add(fmt::format("radius {:.10g} m", *system.semi_major_axis_m));
  }
  if (text.empty()) text = system.wkt.empty() ? "not known" : "as WKT (--json prints it)";
  if (!system.vertical_datum.empty()) add("heights above " + system.vertical_datum);
  if (system.vertical_epsg) add(fmt::format("vertical EPSG:{}", *system.vertical_epsg));
  return text;
}

void add_place(const std::optional<SourcePlace>& place, Report& report) {
  for (const char* member : {"bounds", "centre", "lonlat", "map_scale"}) report.add(member, nullptr);
  if (!place) return;
  const MapBounds& bounds = place->bounds;
  const MapPoint middle = bounds.middle();
  report.add("bounds", {{"west", bounds.west}, {"south", bounds.south}, {"east", bounds.east}, {"north", bounds.north}},
             "bounds",
             fmt::format("{:.12g} to {:.12g} East, {:.12g} to {:.12g} North", bounds.west, bounds.east, bounds.south,
                         bounds.north));
  report.add("centre", {{"x", middle.easting}, {"y", middle.northing}});
  report.detail("centre", fmt::format("{:.12g} East, {:.12g} North", middle.easting, middle.northing));
  if (!place->ground) {
    if (!place->why_no_ground.empty()) report.line("lon/lat", "not known: " + place->why_no_ground);
    return;
  }
  const ordered_json ground = ordered_json::parse(format_ground(*place->ground));
  report.add("lonlat", {{"bounds", ground["bounds"]}, {"centre", ground["centre"]}});
  if (!place->has_map_scale) return;
  const GeoExtent& extent = place->ground->extent;
  const GeoPoint& centre = place->ground->centre;
  report.line("lon/lat", fmt::format("{}, latitude {:.9g} to {:.9g}{}",
                                     extent.east - extent.west > 360.0 - 1e-6
                                         ? "all longitudes"
                                         : fmt::format("longitude {:.9g} to {:.9g}", extent.west, extent.east),
                                     extent.south, extent.north,
                                     std::isfinite(centre.longitude)
                                         ? fmt::format("; centre {:.9g}, {:.9g}", centre.longitude, centre.latitude)
                                         : ""));
  report.add("map_scale", ground["map_scale"]);
  const std::string scale = describe_map_scale(*place->ground);
  const bool is_true = place->ground->worst_error <= MapGround::kTrueEnough;
  is_true ? report.detail("map scale", scale) : report.line("map scale", scale);
}

RasterInfo describe_raster(const std::string& path, const OpenOptions& options, const Job* statistics) {
  const std::unique_ptr<HeightSource> source = open_raster(path, options);
  const SourceInfo info = source->info();
  const Georeference& place = info.georeference;
  const ReferenceSystem& system = place.system;
  const Format* const format = native_format_of(path, options);
  const std::string library = format != nullptr ? library_of(*format) : "OpenImageIO";
  const bool is_from_file = place.registration != Registration::kUnknown;
  const Registration registration = is_from_file       ? place.registration
                                    : place.has_origin ? Registration::kArea
                                                       : Registration::kPoint;
  const bool is_area = registration == Registration::kArea;
  const std::int64_t block_width = info.block_width > 0 ? info.block_width : info.width;
  std::vector<Warning> warnings = info.warnings;

  RasterInfo raster;
  Report& report = raster.report;
  report.add("raster", info.path, "raster",
             fmt::format("{}: {}, {} x {} {}{}", info.path, info.format, info.width, info.height,
                         to_string(info.sample_type), info.channel.empty() ? "" : ", channel " + info.channel));
  report.add("format", info.format);
  report.add("library", library);
  report.add("width", info.width);
  report.add("height", info.height);
  report.add("sample_type", to_string(info.sample_type));
  report.add("channel", or_null(info.channel));
  report.add("block", {{"width", block_width}, {"height", info.block_height}});
  report.detail("stored", fmt::format("in blocks of {} x {}, read by {}", block_width, info.block_height, library));
  report.add("crs", {{"name", or_null(system.name)}, {"epsg", or_null(system.epsg)}, {"wkt", or_null(system.wkt)}},
             "reference", describe_reference(system));
  report.add("origin", place.has_origin ? ordered_json{{"x", place.origin_x}, {"y", place.origin_y}} : nullptr);
  if (!place.has_origin) report.line("bounds", "not known");
  add_place(source_place(place, info.width, info.height, registration), report);
  report.add("spacing", {{"x", place.spacing_x}, {"y", place.spacing_y}}, "spacing",
             fmt::format("{:.12g} between columns, {:.12g} between rows, in {}", place.spacing_x, place.spacing_y,
                         unit_name(place)));
  report.add("unit", unit_word(place));
  report.add("metres_per_unit",
             place.unit == HorizontalUnit::kMetre ? ordered_json(place.metres_per_unit) : ordered_json(nullptr));
  report.add("registration", to_string(registration), "registration",
             fmt::format("{}: samples {}{}", to_string(registration), is_area ? "at the centres of pixels" : "on posts",
                         is_from_file ? "" : ", by default"));
  report.add("registration_from", is_from_file ? "file" : "default");
  report.add("body", {{"name", or_null(system.body)},
                      {"semi_major_axis_m", or_null(system.semi_major_axis_m)},
                      {"inverse_flattening", or_null(system.inverse_flattening)}});
  report.add("vertical_datum", {{"name", or_null(system.vertical_datum)}, {"epsg", or_null(system.vertical_epsg)}});
  report.add("vertical_unit", or_null(info.vertical_unit), "elevations",
             fmt::format("{}, unit {}",
                         info.z_scale == 1.0 && info.z_offset == 0.0
                             ? "samples as they are"
                             : fmt::format("sample * {:.12g} + {:.12g}", info.z_scale, info.z_offset),
                         info.vertical_unit.empty() ? "not known" : info.vertical_unit));
  report.add("z_scale", info.z_scale);
  report.add("z_offset", info.z_offset);
  ordered_json voids = ordered_json::array();
  for (const double value : info.void_values) voids.push_back(number_or_text(value));
  report.add("void_values", voids, "nodata", describe_nodata(info));
  report.add("valid_samples", {{"min", number_or_text(info.valid_min)}, {"max", number_or_text(info.valid_max)}});
  report.add("statistics", nullptr);
  if (statistics != nullptr) {
    const SourceSurvey survey = survey_whole(*source, *statistics);
    add_statistics(survey, report);
    if (const std::string warning = survey.warning(); !warning.empty()) warnings.push_back(loss(warning));
  }
  report.add("warnings", json_from(warnings));
  for (const Warning& warning : warnings) raster.warnings.push_back(warning.reworded(path + ": " + warning));
  return raster;
}

}  // namespace isohf::cli
