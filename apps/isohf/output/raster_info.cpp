#include "output/raster_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "input/source_place.h"
#include "interrupt.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/base/file.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/sampling/source/source_rows.h"
#include "isohf/sampling/source/source_statistics.h"
#include "options/describe.h"
#include "output/json_output.h"
#include "output/progress.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

struct RasterInfo {
  SourceInfo source;
  std::string library;
  Registration registration = Registration::kPoint;  ///< as used
  std::optional<SourcePlace> place;
  std::optional<SourceSurvey> survey;
};

Registration registration_used(const Georeference& place) {
  if (place.registration != Registration::kUnknown) return place.registration;
  return place.has_origin ? Registration::kArea : Registration::kPoint;
}

SourceSurvey survey(HeightSource& source, const Common& common) {
  const std::atomic<bool>& cancel = watch_interrupts();
  ProgressDisplay display(common, ProgressMode::kAuto);
  const SourceInfo& info = source.info();
  constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;
  const ReadStep step = ReadStep::make(info, kReadBytes);
  SourceSurvey survey(info, true);
  std::vector<std::byte> raw;
  for (std::int64_t row = 0; row < info.height; row += step.rows) {
    for (const Window& window : step.windows(info, row)) {
      if (cancel.load(std::memory_order_relaxed)) throw Error(ErrorCode::kCancelled, "interrupted");
      raw.resize(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
      source.read_window(window, raw);
      survey.add(raw);
    }
    display.update("statistics", "rows", std::min(row + step.rows, info.height), info.height);
  }
  return survey;
}

const char* unit_name(const Georeference& place) {
  switch (place.unit) {
    case HorizontalUnit::kMetre:
      return place.metres_per_unit == 1.0 ? "metre" : "linear";
    case HorizontalUnit::kDegree:
      return "degree";
    case HorizontalUnit::kUnknown:
      break;
  }
  return "unknown";
}

std::string describe_unit(const Georeference& place) {
  const std::string name = unit_name(place);
  if (name == "linear") return fmt::format("units of {:.9g} m", place.metres_per_unit);
  return name == "unknown" ? "units not known" : name + "s";
}

std::string describe_reference(const ReferenceSystem& system) {
  std::string text = system.name;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (system.epsg) add(fmt::format("EPSG:{}", *system.epsg));
  if (!system.body.empty()) add(system.body);
  if (system.semi_major_axis_m) {
    const double inverse_flattening = system.inverse_flattening.value_or(0.0);
    add(fmt::format("radius {:.10g} m", *system.semi_major_axis_m) +
        (inverse_flattening > 0.0 ? fmt::format(", flattening 1/{:.10g}", inverse_flattening) : ", sphere"));
  }
  if (text.empty()) text = system.wkt.empty() ? "not known" : "as WKT (--json prints it)";
  if (!system.vertical_datum.empty()) add("heights above " + system.vertical_datum);
  if (system.vertical_epsg) add(fmt::format("vertical EPSG:{}", *system.vertical_epsg));
  return text;
}

bool is_from_file(const RasterInfo& raster) {
  return raster.source.georeference.registration != Registration::kUnknown;
}

std::string describe_registration(const RasterInfo& raster) {
  std::string text = to_string(raster.registration);
  text += raster.registration == Registration::kArea ? ": samples in the middle of pixels" : ": samples on posts";
  if (is_from_file(raster)) return text + ", as the file says";
  return text + (raster.source.georeference.has_origin ? ", taken for granted with a georeference"
                                                       : ", taken for granted without a georeference");
}

std::string describe_voids(const SourceInfo& info) {
  std::string text;
  const bool is_transparency = info.void_values.size() == 1 && !is_floating(info.sample_type) &&
                               info.valid_min == info.void_values.front() + 1.0 && !std::isfinite(info.valid_max);
  if (is_transparency) return fmt::format("transparent samples, read as {}", info.void_values.front());
  for (const double value : info.void_values) text += fmt::format("{}, ", value);
  if (is_floating(info.sample_type)) text += "NaN and infinities, ";
  if (std::isfinite(info.valid_min) || std::isfinite(info.valid_max)) {
    text += fmt::format("samples outside {} to {}, ", info.valid_min, info.valid_max);
  }
  if (text.empty()) return "none declared";
  return text.substr(0, text.size() - 2);
}

std::string text_from(const RasterInfo& raster) {
  const SourceInfo& info = raster.source;
  const Georeference& place = info.georeference;
  std::string text;
  const auto say = [&](const char* what, const std::string& value) {
    text += fmt::format("{:<12} {}\n", what, printable(value));
  };
  say("raster", fmt::format("{}: {}, read by {}", info.path, info.format, raster.library));
  say("size", fmt::format("{} x {} {}{}, stored in blocks of {} x {}", info.width, info.height,
                          to_string(info.sample_type), info.channel.empty() ? "" : ", channel " + info.channel,
                          info.block_width > 0 ? info.block_width : info.width, info.block_height));
  if (place.has_origin) {
    say("place", fmt::format("first sample at {:.12g} East, {:.12g} North ({})", place.origin_x, place.origin_y,
                             describe_unit(place)));
  } else {
    say("place", "not known");
  }
  say("spacing", fmt::format("{:.12g} between columns, {:.12g} between rows{}", place.spacing_x, place.spacing_y,
                             place.has_origin ? "" : fmt::format(" ({})", describe_unit(place))));
  if (raster.place) text += text_from(*raster.place);
  say("registration", describe_registration(raster));
  say("reference", describe_reference(place.system));
  say("elevations", (info.z_scale == 1.0 && info.z_offset == 0.0
                         ? std::string("samples as they are")
                         : fmt::format("sample * {:.12g} + {:.12g}", info.z_scale, info.z_offset)) +
                        ", unit " + (info.vertical_unit.empty() ? "not known" : info.vertical_unit));
  say("voids", describe_voids(info));
  if (raster.survey) {
    const SourceScan scan = raster.survey->scan();
    if (scan.valid > 0) {
      say("range", fmt::format("{:.9g} .. {:.9g}, mean {:.9g}", scan.range.min, scan.range.max,
                               raster.survey->mean().value_or(0.0)));
    } else {
      say("range", "no elevation at all");
    }
    say("samples",
        fmt::format("{}, {} of them void", describe_count(scan.valid + scan.voids), describe_count(scan.voids)));
  }
  return text;
}

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

ordered_json document_of(const SourceSurvey& survey) {
  const SourceScan scan = survey.scan();
  ordered_json undeclared = ordered_json::array();
  for (const UndeclaredVoid& found : survey.undeclared_voids()) {
    undeclared.push_back({{"value", found.value}, {"count", found.count}});
  }
  return {{"samples", scan.valid + scan.voids},
          {"voids", scan.voids},
          {"min", scan.valid > 0 ? ordered_json(scan.range.min) : ordered_json(nullptr)},
          {"max", scan.valid > 0 ? ordered_json(scan.range.max) : ordered_json(nullptr)},
          {"mean", or_null(survey.mean())},
          {"undeclared_voids", undeclared}};
}

ordered_json document_of(const RasterInfo& raster, const std::vector<Warning>& warnings) {
  const SourceInfo& info = raster.source;
  const Georeference& place = info.georeference;
  const ReferenceSystem& system = place.system;
  ordered_json voids = ordered_json::array();
  for (const double value : info.void_values) voids.push_back(number_or_text(value));
  ordered_json json;
  json["raster"] = info.path;
  json["format"] = info.format;
  json["library"] = raster.library;
  json["width"] = info.width;
  json["height"] = info.height;
  json["sample_type"] = to_string(info.sample_type);
  json["channel"] = or_null(info.channel);
  json["block"] = {{"width", info.block_width > 0 ? info.block_width : info.width}, {"height", info.block_height}};
  json["origin"] =
      place.has_origin ? ordered_json{{"x", place.origin_x}, {"y", place.origin_y}} : ordered_json(nullptr);
  json["spacing"] = {{"x", place.spacing_x}, {"y", place.spacing_y}};
  json["unit"] = unit_name(place);
  json["metres_per_unit"] = place.unit == HorizontalUnit::kMetre ? ordered_json(place.metres_per_unit) : nullptr;
  add_source_place(raster.place, json);
  json["registration"] = to_string(raster.registration);
  json["registration_from"] = is_from_file(raster) ? "file" : "default";
  json["crs"] = {{"name", or_null(system.name)}, {"epsg", or_null(system.epsg)}, {"wkt", or_null(system.wkt)}};
  json["body"] = {{"name", or_null(system.body)},
                  {"semi_major_axis_m", or_null(system.semi_major_axis_m)},
                  {"inverse_flattening", or_null(system.inverse_flattening)}};
  json["vertical_datum"] = {{"name", or_null(system.vertical_datum)}, {"epsg", or_null(system.vertical_epsg)}};
  json["vertical_unit"] = or_null(info.vertical_unit);
  json["z_scale"] = info.z_scale;
  json["z_offset"] = info.z_offset;
  json["void_values"] = voids;
  json["valid_samples"] = {{"min", number_or_text(info.valid_min)}, {"max", number_or_text(info.valid_max)}};
  json["statistics"] = raster.survey ? document_of(*raster.survey) : ordered_json(nullptr);
  json["warnings"] = warnings;
  return json;
}

}  // namespace

bool is_archive(const std::string& path, const OpenOptions& options) {
  if (options.raw) return false;
  const bool is_known = native_format_of(path, options) != nullptr;
  // A local file header, then the first member's name at byte 30.
  std::vector<std::byte> head(30 + std::strlen(kMetadataName));
  head.resize(File(path, File::Mode::kRead).read_at(0, head));
  const std::string start(reinterpret_cast<const char*>(head.data()), head.size());
  const bool is_zip = start.starts_with("PK\x03\x04");
  if (is_zip && start.substr(std::min<std::size_t>(30, start.size())) == kMetadataName) return true;
  if (is_known || path.ends_with(".npz")) return false;
  return is_zip || path.ends_with(".isohf");
}

void print_raster_info(const std::string& path, const OpenOptions& options, bool with_statistics, const Common& common,
                       bool is_one_of_many) {
  const std::unique_ptr<HeightSource> source = open_raster(path, options);
  RasterInfo raster;
  raster.source = source->info();
  const Format* const format = native_format_of(path, options);
  raster.library = format != nullptr ? library_of(*format) : "OpenImageIO";
  const Georeference& place = raster.source.georeference;
  raster.registration = registration_used(place);
  raster.place =
      source_place(place, raster.source.width, raster.source.height, raster.registration == Registration::kArea);
  std::vector<Warning> warnings = raster.source.warnings;
  if (with_statistics) {
    raster.survey = survey(*source, common);
    if (const std::string warning = raster.survey->warning(); !warning.empty()) warnings.push_back(warning);
  }
  std::vector<Warning> named;
  for (const Warning& warning : warnings) named.push_back(warning.reworded(path + ": " + warning));
  print_warnings(common, named);
  StandardOutput out(common);
  if (common.json) {
    const ordered_json document = document_of(raster, warnings);
    out.write(is_one_of_many ? json_line(document) : json_text(document));
  } else if (!common.quiet) {
    out.write(text_from(raster));
  }
  out.finish();
}

}  // namespace isohf::cli
