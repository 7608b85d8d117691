#include "formats/mosaic/mosaic_plan.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <tuple>
#include <utility>

#include "formats/mosaic/companions.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/choose_projection.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/crs_operation.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/projection_wkt.h"

namespace isohf {
namespace {

constexpr std::size_t kOpenedAtOnce = 16;
constexpr std::size_t kMostWarnings = 10;

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw Error(ErrorCode::kUnsupported, path + ": " + why);
}

void refuse_duplicates(const std::vector<std::string>& paths) {
  std::map<std::pair<dev_t, ino_t>, std::size_t> known;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    struct stat status {};
    if (::stat(paths[i].c_str(), &status) != 0) continue;  // opening it says why
    const auto [found, is_new] = known.insert({{status.st_dev, status.st_ino}, i});
    if (is_new) continue;
    const std::string& other = paths[found->second];
    throw Error(
        ErrorCode::kInvalidArgument,
        paths[i] + ": " + (other == paths[i] ? "is named twice among the inputs" : "is the same file as " + other));
  }
}

bool states_system(const ReferenceSystem& system) {
  return system.epsg || !system.wkt.empty() || !system.name.empty() || system.semi_major_axis_m;
}

/// "its body is Mars, that of a.tif is Moon"
std::string difference(const char* what, const std::string& found, const std::string& path, const std::string& ours) {
  return fmt::format("its {} is {}, that of {} is {}", what, printable(found), path, printable(ours));
}

/// Why two files' coordinates are not in one reference system; empty if they are. `ours`, which is that of the file at
/// `path`, takes the system of `other` if it states none.
std::string contradiction(Georeference& ours, const Georeference& other, const std::string& path) {
  if (other.unit != ours.unit || other.metres_per_unit != ours.metres_per_unit) {
    return fmt::format("its coordinates are in {}, those of {} in {}", unit_name(other), path, unit_name(ours));
  }
  ReferenceSystem& system = ours.system;
  const bool has_text = !system_text(system).empty();
  const bool has_other = !system_text(other.system).empty();
  const std::optional<bool> same = are_same(system, other.system);
  if (same == true || !states_system(other.system)) return {};
  const bool has_other_name =
      !has_text && !has_other && !system.name.empty() && !other.system.name.empty() && system.name != other.system.name;
  if (same == false || (has_text && has_other) || has_other_name)
    return difference("reference system", name_of(other), path, name_of(ours));
  // One of them names no more than an ellipsoid.
  constexpr double kSameBody = 1e-9;  // axes that are written in fewer digits
  const auto differ = [](const std::optional<double>& a, const std::optional<double>& b) {
    return a && b && std::abs(*a - *b) > kSameBody * std::abs(*a);
  };
  if (differ(system.semi_major_axis_m, other.system.semi_major_axis_m) ||
      differ(system.inverse_flattening, other.system.inverse_flattening)) {
    return fmt::format("its ellipsoid is not that of {}", path);
  }
  if (!has_text) system = other.system;
  return {};
}

/// The same of bodies and of what heights are above.
std::string contradiction_of_heights(ReferenceSystem& ours, const ReferenceSystem& other, const std::string& path) {
  if (ours.body.empty()) ours.body = other.body;
  if (!other.body.empty() && other.body != ours.body) return difference("body", other.body, path, ours.body);
  // A .hgt or DTED names what its heights are above, by no code.
  const auto contradicts = [](const ReferenceSystem& one, const ReferenceSystem& two) {
    const bool is_name = one.vertical_datum == "EGM96" || one.vertical_datum == "NAVD88";
    return is_name && !one.vertical_epsg && !two.vertical_datum.empty() &&
           two.vertical_datum.find(one.vertical_datum) == std::string::npos;
  };
  if (contradicts(ours, other) || contradicts(other, ours))
    return difference("vertical datum", other.vertical_datum, path, ours.vertical_datum);
  if (ours.vertical_epsg && other.vertical_epsg && ours.vertical_epsg != other.vertical_epsg) {
    return difference("vertical EPSG code", std::to_string(*other.vertical_epsg), path,
                      std::to_string(*ours.vertical_epsg));
  }
  // Names differ from format to format: the one beside a code, and of these the longest, whichever file comes first.
  const auto worth = [](const ReferenceSystem& of) {
    return std::tuple(of.vertical_epsg.has_value(), of.vertical_datum.size(), of.vertical_datum);
  };
  if (!other.vertical_datum.empty() && worth(ours) < worth(other)) ours.vertical_datum = other.vertical_datum;
  if (!ours.vertical_epsg) ours.vertical_epsg = other.vertical_epsg;
  return {};
}

/// Warnings of many files, each once.
class FileWarnings {
 public:
  void add(const std::string& path, const std::vector<Warning>& texts) {
    for (const Warning& text : texts) {
      // Readers that name their file in a warning would make each one its own.
      const std::string prefix = path + ": ";
      const std::string bare = text.substr(text.starts_with(prefix) ? prefix.size() : 0);
      const auto found = std::ranges::find_if(seen_, [&](const Seen& seen) { return seen.text == bare; });
      if (found != seen_.end()) {
        ++found->files;
      } else if (seen_.size() < 100 * kMostWarnings) {
        seen_.push_back({text.reworded(bare), path, 1});
      }
    }
  }

  void report(std::vector<Warning>& warnings) const {
    Warning::Kind untold = Warning::Kind::kNote;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto& [text, path, files] = seen_[i];
      if (i >= kMostWarnings) {
        untold = std::max(untold, text.kind);
        continue;
      }
      const std::string others = files == 1 ? "" : fmt::format(" and {} more files", files - 1);
      warnings.push_back(text.reworded(fmt::format("{}{}: {}", path, others, text)));
    }
    if (seen_.size() > kMostWarnings)
      warnings.push_back({fmt::format("and {} more warnings of other kinds", seen_.size() - kMostWarnings), untold});
  }

 private:
  struct Seen {
    Warning text;
    std::string path;
    std::int64_t files = 0;
  };
  std::vector<Seen> seen_;
};

const char* words(Registration registration) {
  return registration == Registration::kPoint ? "points" : "areas";
}

/// Collects what the files state, one after the other.
class Survey {
 public:
  /// joins: files in different reference systems may stand next to each other.
  Survey(MosaicPlan& plan, bool joins) : plan_(&plan), joins_(joins) {}

  void add(MosaicMember member, const SourceInfo& info) {
    const std::string& path = member.path;
    if (!info.georeference.has_origin) {
      refuse(path,
             "does not say where it lies, and a mosaic is joined by that; give it a world file (.tfw, .pgw, .wld), or "
             "convert it alone");
    }
    Georeference place = info.georeference;
    if (place.registration == Registration::kUnknown) place.registration = Registration::kArea;
    if (placed.empty()) {
      SourceInfo& whole = plan_->info;
      whole.format = info.format;
      whole.channel = info.channel;
      whole.vertical_unit = info.vertical_unit;
      whole.metres_per_vertical_unit = info.metres_per_vertical_unit;
      whole.georeference = place;
      first_ = path;
    }
    system_of.push_back(find_system(path, place));
    compare(path, info, place);
    warnings_.add(path, info.warnings);
    silent_ += states_system(place.system) ? 0 : 1;
    plan_->block_height = std::max(plan_->block_height, std::min(info.block_height, info.height));
    const SampleKind kind = SampleKind::of(info);
    const auto found = std::ranges::find(plan_->kinds, kind);
    member.kind = static_cast<std::size_t>(found - plan_->kinds.begin());
    if (found == plan_->kinds.end()) plan_->kinds.push_back(kind);
    member.width = info.width;
    member.height = info.height;
    placed.push_back({std::move(member), place.origin_x, place.origin_y, place.spacing_x, place.spacing_y, nullptr});
  }

  /// Warnings of files come first in the plan's.
  void finish() {
    SourceInfo& info = plan_->info;
    if (systems.size() == 1) {
      const std::string datum = info.georeference.system.vertical_datum;
      const std::optional<int> code = info.georeference.system.vertical_epsg;
      const std::string body = info.georeference.system.body;
      info.georeference.system = systems.front().system;
      info.georeference.system.vertical_datum = datum;
      info.georeference.system.vertical_epsg = code;
      info.georeference.system.body = body;
    }
    warnings_.report(info.warnings);
    if (silent_ > 0 && states_system(systems.front().system)) {
      info.warnings.push_back(fmt::format(
          "{} of {} files do not say their reference system; the others' is taken for them", silent_, placed.size()));
    }
  }

  std::vector<Georeference> systems;   ///< that the files' coordinates are in, each once
  std::vector<std::size_t> system_of;  ///< each file's
  std::vector<PlacedMember> placed;

 private:
  /// The system of a file among those of the ones before; a new one if it is none of them.
  std::size_t find_system(const std::string& path, const Georeference& place) {
    std::string why;
    for (std::size_t i = 0; i < systems.size(); ++i) {
      const std::string differs = contradiction(systems[i], place, first_);
      if (differs.empty()) return i;
      if (why.empty()) why = differs;
    }
    const auto is_known = [](const Georeference& each) {
      return each.unit == HorizontalUnit::kDegree ||
             (each.unit == HorizontalUnit::kMetre && !system_text(each.system).empty());
    };
    if (!systems.empty() && (!is_known(place) || !is_known(systems.front()))) {
      refuse(path, why +
                       "; not both of the reference systems are known, so that they cannot be joined: "
                       "`reference_system` says what all are in, or leave this file out");
    }
    if (!systems.empty() && !joins_)
      refuse(path, why + "; `projection` joins them on one map (auto, EPSG:n, ...), or leave this file out");
    systems.push_back(place);
    return systems.size() - 1;
  }

  void compare(const std::string& path, const SourceInfo& info, const Georeference& place) {
    SourceInfo& whole = plan_->info;
    if (whole.format != info.format) whole.format = "mosaic";
    if (place.registration != whole.georeference.registration) {
      refuse(path, fmt::format("its samples stand for {}, those of {} for {}; `registration` says what holds for all",
                               words(place.registration), first_, words(whole.georeference.registration)));
    }
    const std::string why = contradiction_of_heights(whole.georeference.system, place.system, first_);
    if (!why.empty()) refuse(path, why + "; bring one of them to the other's (gdalwarp) or leave it out");
    // If nothing is stated they are taken for metres.
    if (whole.metres_per_vertical_unit != info.metres_per_vertical_unit) {
      const auto unit = [](const SourceInfo& of) {
        return of.vertical_unit.empty() ? std::string("a unit that nothing states") : of.vertical_unit;
      };
      const bool is_one_unknown = info.vertical_unit.empty() || whole.vertical_unit.empty();
      refuse(path, fmt::format("its elevations are in {}, those of {} in {}; convert one of them first (gdal_calc){}",
                               unit(info), first_, unit(whole),
                               is_one_unknown && place.system.epsg
                                   ? fmt::format(", or say what all are in, as by `reference_system` EPSG:{}+6360",
                                                 *place.system.epsg)
                                   : ""));
    }
    if (whole.vertical_unit.empty()) whole.vertical_unit = info.vertical_unit;
  }

  MosaicPlan* plan_;
  bool joins_;
  std::string first_;
  FileWarnings warnings_;
  std::int64_t silent_ = 0;
};

/// Brings members in different reference systems to one map.
class Joining {
 public:
  explicit Joining(const Survey& found) : systems_(found.systems), grounds_(systems_.size()), maps_(systems_.size()) {
    std::vector<MapBounds> bounds(systems_.size(), MapBounds{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL});
    for (std::size_t i = 0; i < found.placed.size(); ++i) {
      const PlacedMember& placed = found.placed[i];
      MapBounds& all = bounds[found.system_of[i]];
      all.west = std::min(all.west, placed.origin_x);
      all.north = std::max(all.north, placed.origin_y);
      all.east = std::max(all.east, placed.origin_x + static_cast<double>(placed.member.width) * placed.spacing_x);
      all.south = std::min(all.south, placed.origin_y - static_cast<double>(placed.member.height) * placed.spacing_y);
    }
    for (std::size_t i = 0; i < systems_.size(); ++i) {
      grounds_[i] = {bounds[i].west, bounds[i].south, bounds[i].east, bounds[i].north};
      if (systems_[i].unit == HorizontalUnit::kDegree) continue;
      maps_[i] = understand_map(system_text(systems_[i].system), systems_[i].metres_per_unit);
      if (const auto ground = ground_under(*maps_[i], bounds[i])) grounds_[i] = ground->extent;
    }
  }

  /// Has the whole lie in the system that the request comes to, and returns how the members of each system come there.
  [[nodiscard]] std::vector<std::shared_ptr<const MosaicWay>> ways(const ProjectionRequest& onto,
                                                                   SourceInfo& whole) const {
    const std::string target = on_body_of(systems_[0].system, ellipsoid(0), system_of(onto)).text;
    std::vector<std::shared_ptr<const MosaicWay>> ways(systems_.size());
    SourceInfo there;
    take_system(target, there);
    for (std::size_t i = 0; i < systems_.size(); ++i) {
      if (systems_[i].unit == there.georeference.unit &&
          systems_[i].metres_per_unit == there.georeference.metres_per_unit &&
          are_same(systems_[i].system, there.georeference.system) == true) {
        continue;
      }
      GeoExtent ground = grounds_[i];
      if (ground.east - ground.west < 360.0) {
        ground.west = std::remainder(ground.west, 360.0);
        ground.east = std::remainder(ground.east, 360.0);
      }
      WayToSystem way = find_way(systems_[i].system, target, ground, ellipsoid(i));
      if (way.is_ballpark) whole.warnings.push_back(loss(ballpark_note("the datum of " + name_of(systems_[i]), way)));
      ways[i] = std::make_shared<MosaicWay>(MosaicWay{std::move(way.map), maps_[i]});
    }
    Georeference& place = whole.georeference;
    place.unit = there.georeference.unit;
    place.metres_per_unit = there.georeference.metres_per_unit;
    there.georeference.system.vertical_datum = place.system.vertical_datum;
    there.georeference.system.vertical_epsg = place.system.vertical_epsg;
    place.system = there.georeference.system;
    return ways;
  }

 private:
  /// What the request comes to for all of the ground: a code or WKT.
  [[nodiscard]] std::string system_of(const ProjectionRequest& onto) const {
    if (onto.kind == ProjectionKind::kSystem) return onto.system;
    GeoExtent all = grounds_.front();
    for (const GeoExtent& ground : grounds_) {
      const double turn = 360.0 * std::round((all.middle().longitude - ground.middle().longitude) / 360.0);
      all.west = std::min(all.west, ground.west + turn);
      all.east = std::max(all.east, ground.east + turn);
      all.south = std::min(all.south, ground.south);
      all.north = std::max(all.north, ground.north);
    }
    const ProjectionProblem problem{"mosaic", systems_[0].system.body, ellipsoid(0), all, false, false, false};
    const ProjectionSpec spec = choose_projection(onto, problem).spec;
    constexpr int kWgs84 = 4326;
    const auto code = projection_epsg(spec, kWgs84);
    return code ? fmt::format("EPSG:{}", *code) : projection_wkt(spec, "");
  }

  [[nodiscard]] Ellipsoid ellipsoid(std::size_t i) const {
    return maps_[i] ? maps_[i]->ellipsoid() : ellipsoid_of(systems_[i].system);
  }

  const std::vector<Georeference>& systems_;
  std::vector<GeoExtent> grounds_;
  std::vector<std::shared_ptr<const ReferenceMap>> maps_;  ///< nullptr: degrees
};

/// A file's own description, made to lie where a list puts it.
void put_in_list(const ListedMosaic& list, const ListedRaster& raster, SourceInfo& info) {
  const Window& at = raster.window;
  if (at.columns != info.width || at.rows != info.height) {
    refuse(raster.path, fmt::format("has {} x {} samples, of which {} x {} are taken; {}", info.width, info.height,
                                    at.columns, at.rows, list.remedy));
  }
  Georeference& place = info.georeference;
  const Georeference own = place;
  place.spacing_x = list.place.spacing_x;
  place.spacing_y = list.place.spacing_y;
  place.origin_x = list.place.origin_x + static_cast<double>(at.column) * place.spacing_x;
  place.origin_y = list.place.origin_y - static_cast<double>(at.row) * place.spacing_y;
  place.has_origin = true;
  const auto is_near = [](double a, double b, double spacing) { return std::abs(a - b) <= kSnapTolerance * spacing; };
  const auto last = [](double first, std::int64_t samples, double spacing) {
    return first + static_cast<double>(samples - 1) * spacing;
  };
  if (!own.has_origin || !list.place.has_origin) return;
  const double east = last(place.origin_x, info.width, place.spacing_x);
  const double south = last(place.origin_y, info.height, -place.spacing_y);
  if (is_near(own.origin_x, place.origin_x, place.spacing_x) &&
      is_near(own.origin_y, place.origin_y, place.spacing_y) &&
      is_near(last(own.origin_x, info.width, own.spacing_x), east, place.spacing_x) &&
      is_near(last(own.origin_y, info.height, -own.spacing_y), south, place.spacing_y)) {
    return;
  }
  refuse(raster.path, fmt::format("begins at {:.10g}, {:.10g} by itself, and is put at {:.10g}, {:.10g}; {}",
                                  own.origin_x, own.origin_y, place.origin_x, place.origin_y, list.remedy));
}

/// Opens all files in parallel and takes up what they state in their order: the first error is that of the first file
/// at fault.
void open_all(const std::vector<std::string>& paths, const OpenOptions& options, const ListedMosaic* list,
              MosaicPlan& plan, Survey& survey) {
  struct Opened {
    SourceInfo info;
    FileStamp stamp;
    std::uint64_t reader_bytes = 0;
    std::shared_ptr<const void> unpacked;
    std::exception_ptr failure;
  };
  plan.readers_at_once = oneapi::tbb::this_task_arena::max_concurrency();
  const OpenOptions share = share_of(options, plan);
  const std::size_t at_once = std::min(kOpenedAtOnce, most_open_rasters());
  for (std::size_t from = 0; from < paths.size(); from += at_once) {
    std::vector<Opened> opened(std::min(at_once, paths.size() - from));
    oneapi::tbb::parallel_for(std::size_t{0}, opened.size(), [&](std::size_t i) {
      try {
        opened[i].stamp = FileStamp::of(paths[from + i]);
        const std::unique_ptr<HeightSource> source = open_raster(paths[from + i], share);
        opened[i].info = source->info();
        opened[i].reader_bytes = source->buffer_bytes();
        opened[i].unpacked = keep_unpacked(paths[from + i], share);
      } catch (...) {
        opened[i].failure = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < opened.size(); ++i) {
      if (opened[i].failure) std::rethrow_exception(opened[i].failure);
      plan.reader_bytes = std::max(plan.reader_bytes, opened[i].reader_bytes);
      if (opened[i].unpacked) plan.unpacked.push_back(std::move(opened[i].unpacked));
      MosaicMember member;
      member.path = paths[from + i];
      member.order = static_cast<std::int64_t>(from + i);
      member.stamp = opened[i].stamp;
      if (list != nullptr) put_in_list(*list, list->rasters[from + i], opened[i].info);
      survey.add(std::move(member), opened[i].info);
    }
  }
  survey.finish();
}

/// Makes the plan's only layer, and the whole, as large as the list wants.
void enlarge(const ListedMosaic& list, MosaicPlan& plan) {
  MosaicLayer& layer = plan.layers.front();
  const auto samples = [](double distance, double spacing) { return std::llround(distance / spacing); };
  const std::int64_t column = samples(layer.origin_x - list.place.origin_x, layer.spacing_x);
  const std::int64_t row = samples(list.place.origin_y - layer.origin_y, layer.spacing_y);
  for (MosaicMember& member : layer.members) {
    member.column += column;
    member.row += row;
  }
  Georeference& place = plan.info.georeference;
  layer.origin_x = place.origin_x = list.place.origin_x;
  layer.origin_y = place.origin_y = list.place.origin_y;
  layer.width = plan.info.width = list.width;
  layer.height = plan.info.height = list.height;
}

/// Checks how the members cover the region and chooses the samples of the whole.
void complete(MosaicPlan& plan, const Window& region) {
  check_coverage(plan, region);
  const bool interpolated = plan.layers.size() > 1 || !plan.is_on_grid(plan.layers.front());
  const bool has_resolutions = plan.layers.front().rank != plan.layers.back().rank;
  const char* const why = !interpolated     ? nullptr
                          : has_resolutions ? "the files differ in resolution"
                                            : "the files differ in reference system";
  plan.samples = choose_mosaic_samples(plan.kinds, plan.samples_missing > 0 || plan.is_reprojected, why);
  SourceInfo& info = plan.info;
  plan.samples.kind.put_into(info);
  for (const SampleKind& of_files : plan.kinds) {
    info.void_values_of_files.insert(info.void_values_of_files.end(), of_files.void_values.begin(),
                                     of_files.void_values.end());
  }
  std::ranges::sort(info.void_values_of_files);
  const auto twice = std::ranges::unique(info.void_values_of_files);
  info.void_values_of_files.erase(twice.begin(), twice.end());
  info.block_width = info.width;
  info.warnings.insert(info.warnings.end(), plan.samples.notes.begin(), plan.samples.notes.end());
}

}  // namespace

OpenOptions share_of(OpenOptions options, const MosaicPlan& plan) {
  options.buffer_bytes /= static_cast<std::uint64_t>(plan.readers_at_once);
  return options;
}

MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                       const std::optional<BoundingBox>& box, const ProjectionRequest& onto) {
  if (paths.empty()) throw Error(ErrorCode::kInvalidArgument, "a mosaic of no files");
  refuse_duplicates(paths);
  MosaicPlan plan;
  std::vector<std::string> elevations = paths;
  plan.info.warnings = leave_out_companions(elevations);
  Survey found(plan, onto.is_given && (onto.is_auto || onto.kind != ProjectionKind::kNone));
  open_all(elevations, options, nullptr, plan, found);
  if (found.systems.size() == 1) {
    if (plan.info.georeference.unit == HorizontalUnit::kDegree) join_antimeridian(found.placed);
  } else {
    const auto ways = Joining(found).ways(onto, plan.info);
    for (std::size_t i = 0; i < found.placed.size(); ++i) found.placed[i].way = ways[found.system_of[i]];
    plan.is_reprojected = true;
  }
  place_members(std::move(found.placed), plan);
  plan.info.path = elevations.size() == 1 ? std::filesystem::path(elevations[0]).filename().string()
                                          : fmt::format("mosaic of {} files", elevations.size());
  complete(plan, box ? samples_in(*box, plan.info) : Window{0, 0, plan.info.width, plan.info.height});
  return plan;
}

MosaicPlan plan_mosaic(const ListedMosaic& list, const OpenOptions& options) {
  MosaicPlan plan;
  std::vector<std::string> paths;
  for (const ListedRaster& raster : list.rasters) paths.push_back(raster.path);
  Survey found(plan, false);
  open_all(paths, options, &list, plan, found);
  place_members(std::move(found.placed), plan);
  enlarge(list, plan);
  complete(plan, {0, 0, list.width, list.height});
  return plan;
}

std::size_t most_open_rasters() {
  constexpr std::size_t kMostOpen = 64;
  // Left to the archive, its journal, the terminal, shared libraries and whatever the caller has open.
  constexpr std::size_t kFilesForOthers = 32;
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kMostOpen;
  const auto allowed = static_cast<std::size_t>(limit.rlim_cur);
  return std::clamp<std::size_t>(allowed > kFilesForOthers ? allowed - kFilesForOthers : 1, 1, kMostOpen);
}

}  // namespace isohf
