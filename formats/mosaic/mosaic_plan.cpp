#include "formats/mosaic/mosaic_layout.h"
#include "isohf/projection/crs.h"
#include "isohf/projection/crs_operation.h"
#include "isohf/projection/source_system.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "formats/mosaic/reader_pool.h"
#include "isohf/error.h"
#include "isohf/projection/choose_projection.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kOpenedAtOnce = 16;
constexpr std::size_t kMostWarnings = 10;
/// Places without a file that a warning names.
constexpr std::size_t kHolesNamed = 4;
/// Axes of ellipsoids that are written in fewer digits are the same.
constexpr double kSameBody = 1e-9;

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

/// Takes what the first files of a mosaic leave open from a later one; names what contradicts, else empty.
class Agreement {
 public:
  /// Compares a value that both state; takes it where only `other` does.
  template <typename T>
  void same(std::optional<T>& ours, const std::optional<T>& other, const char* what) {
    if (!other) return;
    if (!ours) {
      ours = other;
    } else if (*ours != *other) {
      differ(what, fmt::format("{}", *other), fmt::format("{}", *ours));
    }
  }
  void same(std::string& ours, const std::string& other, const char* what) {
    if (other.empty()) return;
    if (ours.empty()) {
      ours = other;
    } else if (ours != other) {
      differ(what, other, ours);
    }
  }
  void same_length(std::optional<double>& ours, const std::optional<double>& other, const char* what) {
    if (ours && other && std::abs(*ours - *other) <= kSameBody * std::abs(*ours)) return;
    same(ours, other, what);
  }
  void differ(const char* what, const std::string& found, const std::string& wanted) {
    if (why_.empty()) why_ = fmt::format("its {} is {}, that of", what, found);
    if (wanted_.empty()) wanted_ = wanted;
  }

  [[nodiscard]] bool holds() const { return why_.empty(); }
  /// "its EPSG code is 4326, that of a.tif 32632"
  [[nodiscard]] std::string why(const std::string& other) const {
    constexpr std::size_t kMostShown = 60;
    const auto cut = [](const std::string& text) {
      return text.size() <= kMostShown ? text : text.substr(0, kMostShown) + "...";
    };
    return fmt::format("{} {} is {}", why_, other, cut(wanted_));
  }

 private:
  std::string why_;
  std::string wanted_;
};

void agree_on_heights(ReferenceSystem& ours, const ReferenceSystem& other, Agreement& agreement) {
  agreement.same(ours.body, other.body, "body");
  // A .hgt or DTED names what its heights are above, by no code.
  const auto contradicts = [](const ReferenceSystem& one, const ReferenceSystem& two) {
    const bool is_name = one.vertical_datum == "EGM96" || one.vertical_datum == "NAVD88";
    return is_name && !one.vertical_epsg && !two.vertical_datum.empty() &&
           two.vertical_datum.find(one.vertical_datum) == std::string::npos;
  };
  if (contradicts(ours, other) || contradicts(other, ours)) {
    agreement.differ("vertical datum", other.vertical_datum, ours.vertical_datum);
  }
  // Names differ from format to format: the one beside a code, and of these the longest, whichever file comes first.
  const auto worth = [](const ReferenceSystem& of) {
    return std::tuple(of.vertical_epsg.has_value(), of.vertical_datum.size(), of.vertical_datum);
  };
  if (!other.vertical_datum.empty() && worth(ours) < worth(other)) ours.vertical_datum = other.vertical_datum;
  agreement.same(ours.vertical_epsg, other.vertical_epsg, "vertical EPSG code");
}

void agree_on_system(ReferenceSystem& ours, const ReferenceSystem& other, Agreement& agreement) {
  // Of two texts, or a text and a code, PROJ tells whether they are one system.
  const bool by_code = ours.epsg && other.epsg;
  const bool same_text = ours.wkt == other.wkt && ours.epsg == other.epsg;
  const std::optional<bool> same = by_code || same_text ? std::nullopt : are_same(ours, other);
  if (same == false) {
    agreement.differ("reference system", system_text(other), system_text(ours));
  } else if (same == true) {
    return;
  }
  agreement.same(ours.epsg, other.epsg, "EPSG code");
  agreement.same_length(ours.semi_major_axis_m, other.semi_major_axis_m, "semi-major axis");
  agreement.same_length(ours.inverse_flattening, other.inverse_flattening, "inverse flattening");
  // Codes say all; texts are compared where there are none. Names of one system differ from program to program.
  if (by_code) return;
  const bool by_text = !ours.wkt.empty() && !other.wkt.empty();
  agreement.same(ours.wkt, other.wkt, "reference system");
  if (!by_text && !(ours.epsg || other.epsg)) agreement.same(ours.name, other.name, "reference system");
}

/// Collects what the files say, one after the other.
class Survey {
 public:
  /// joins: files in different reference systems may stand beside each other.
  Survey(MosaicPlan& plan, bool joins) : plan_(&plan), joins_(joins) {}

  /// What the files' coordinates are in: of each reference system once, and which is whose.
  [[nodiscard]] const std::vector<Georeference>& systems() const { return systems_; }
  [[nodiscard]] const std::vector<std::size_t>& system_of() const { return system_of_; }

  void add(const std::string& path, SourceInfo info, const FileStamp& stamp) {
    Georeference& place = info.georeference;
    if (!place.has_origin) {
      refuse(path,
             "does not say where it lies, and a mosaic is joined by that; give it a world file (.tfw, .pgw, .wld), or "
             "convert it alone");
    }
    if (place.registration == Registration::kUnknown) place.registration = Registration::kArea;
    if (placed_.empty()) {
      begin(path, info);
    } else {
      compare(path, info);
    }
    count_warnings(path, info.warnings);
    silent_ += states_system(place.system) ? 0 : 1;
    plan_->block_height = std::max(plan_->block_height, std::min(info.block_height, info.height));
    PlacedMember placed;
    placed.origin_x = place.origin_x;
    placed.origin_y = place.origin_y;
    placed.spacing_x = place.spacing_x;
    placed.spacing_y = place.spacing_y;
    MosaicMember& member = placed.member;
    member.path = path;
    member.width = info.width;
    member.height = info.height;
    member.order = static_cast<std::int64_t>(placed_.size());
    member.stamp = stamp;
    const SampleKind kind = SampleKind::of(info);
    const auto found = std::find(plan_->kinds.begin(), plan_->kinds.end(), kind);
    member.kind = static_cast<std::size_t>(found - plan_->kinds.begin());
    if (found == plan_->kinds.end()) plan_->kinds.push_back(kind);
    placed_.push_back(std::move(placed));
  }

  /// Hands the members over; warnings of files come first in the plan's.
  std::vector<PlacedMember> finish() {
    SourceInfo& info = plan_->info;
    Warning::Kind untold = Warning::Kind::kNote;
    for (const FileWarning& warning : warnings_) {
      if (info.warnings.size() == kMostWarnings) {
        untold = std::max(untold, warning.text.kind);
        continue;
      }
      const std::string others = warning.files == 1 ? "" : fmt::format(" and {} more files", warning.files - 1);
      info.warnings.push_back(warning.text.reworded(fmt::format("{}{}: {}", warning.path, others, warning.text)));
    }
    if (const std::size_t told = info.warnings.size(); told < warnings_.size()) {
      info.warnings.push_back({fmt::format("and {} more warnings of other kinds", warnings_.size() - told), untold});
    }
    if (silent_ > 0 && states_system(info.georeference.system)) {
      info.warnings.push_back(fmt::format(
          "{} of {} files do not say their reference system; the others' is taken for them", silent_, placed_.size()));
    }
    return std::move(placed_);
  }

 private:
  struct FileWarning {
    Warning text;
    std::string path;
    std::int64_t files = 0;
  };

  void begin(const std::string& path, const SourceInfo& info) {
    first_ = path;
    SourceInfo& whole = plan_->info;
    whole.format = info.format;
    whole.channel = info.channel;
    whole.vertical_unit = info.vertical_unit;
    whole.metres_per_vertical_unit = info.metres_per_vertical_unit;
    whole.georeference = info.georeference;
    systems_.push_back(info.georeference);
    system_of_.push_back(0);
  }

  /// Finds the system of a file among those of the ones before; a new one where they may differ.
  void find_system(const std::string& path, const Georeference& place) {
    std::string why;
    for (std::size_t i = 0; i < systems_.size(); ++i) {
      Georeference& ours = systems_[i];
      if (place.unit == ours.unit && place.metres_per_unit == ours.metres_per_unit) {
        Agreement agreement;
        agree_on_system(ours.system, place.system, agreement);
        if (agreement.holds()) return system_of_.push_back(i);
        if (why.empty()) why = agreement.why(first_);
      } else if (why.empty()) {
        why = fmt::format("its coordinates are in {}, those of {} in {}", unit_name(place), first_, unit_name(ours));
      }
    }
    const auto is_known = [](const Georeference& each) {
      return each.unit == HorizontalUnit::kDegree ||
             (each.unit == HorizontalUnit::kMetre && !system_text(each.system).empty());
    };
    if (!is_known(place) || !is_known(systems_.front())) {
      refuse(
          path,
          why +
              "; not both of the reference systems are known, so that they cannot be joined: `reference_system` says "
              "what all are in, or leave this file out");
    }
    if (!joins_) refuse(path, why + "; `projection` joins them on one map (auto, EPSG:n, ...), or leave this file out");
    systems_.push_back(place);
    system_of_.push_back(systems_.size() - 1);
  }

  void compare(const std::string& path, const SourceInfo& info) {
    SourceInfo& whole = plan_->info;
    if (whole.format != info.format) whole.format = "mosaic";
    const Georeference& place = info.georeference;
    const Georeference& ours = whole.georeference;
    if (place.registration != ours.registration) {
      refuse(path, fmt::format("its samples stand for {}, those of {} for {}; `registration` says what holds for all",
                               words(place.registration), first_, words(ours.registration)));
    }
    find_system(path, place);
    Agreement agreement;
    agree_on_heights(whole.georeference.system, place.system, agreement);
    if (!agreement.holds()) {
      refuse(path, agreement.why(first_) + "; bring one of them to the other's (gdalwarp) or leave it out");
    }
    // Where nothing is said they are taken for metres.
    if (whole.metres_per_vertical_unit != info.metres_per_vertical_unit) {
      const auto words = [](const SourceInfo& of) {
        return of.vertical_unit.empty() ? std::string("a unit that nothing states") : of.vertical_unit;
      };
      const bool is_one_unknown = info.vertical_unit.empty() || whole.vertical_unit.empty();
      refuse(path, fmt::format("its elevations are in {}, those of {} in {}; convert one of them first (gdal_calc){}",
                               words(info), first_, words(whole),
                               is_one_unknown && place.system.epsg
                                   ? fmt::format(", or say what all are in, as by `reference_system` EPSG:{}+6360",
                                                 *place.system.epsg)
                                   : ""));
    }
    if (whole.vertical_unit.empty()) whole.vertical_unit = info.vertical_unit;
  }

  static const char* words(Registration registration) {
    return registration == Registration::kPoint ? "points" : "areas";
  }

  void count_warnings(const std::string& path, const std::vector<Warning>& texts) {
    for (const Warning& text : texts) {
      // Readers that name their file in a warning would make each one its own.
      const std::string prefix = path + ": ";
      const std::string bare = text.substr(text.starts_with(prefix) ? prefix.size() : 0);
      const auto found = std::find_if(warnings_.begin(), warnings_.end(),
                                      [&](const FileWarning& warning) { return warning.text == bare; });
      if (found != warnings_.end()) {
        ++found->files;
      } else if (warnings_.size() < 100 * kMostWarnings) {
        warnings_.push_back({text.reworded(bare), path, 1});
      }
    }
  }

  MosaicPlan* plan_;
  bool joins_;
  std::vector<Georeference> systems_;
  std::vector<std::size_t> system_of_;
  std::string first_;
  std::vector<PlacedMember> placed_;
  std::vector<FileWarning> warnings_;
  std::int64_t silent_ = 0;
};

/// What the files of a mosaic are brought to, where they are in different reference systems.
class Joining {
 public:
  Joining(const std::vector<Georeference>& systems, const std::vector<PlacedMember>& members,
          const std::vector<std::size_t>& system_of)
      : systems_(systems), grounds_(systems.size()), maps_(systems.size()) {
    std::vector<MapBounds> bounds(systems.size(), MapBounds{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL});
    for (std::size_t i = 0; i < members.size(); ++i) {
      const PlacedMember& placed = members[i];
      MapBounds& all = bounds[system_of[i]];
      all.west = std::min(all.west, placed.origin_x);
      all.north = std::max(all.north, placed.origin_y);
      all.east = std::max(all.east, placed.origin_x + static_cast<double>(placed.member.width) * placed.spacing_x);
      all.south = std::min(all.south, placed.origin_y - static_cast<double>(placed.member.height) * placed.spacing_y);
    }
    for (std::size_t i = 0; i < systems.size(); ++i) {
      grounds_[i] = {bounds[i].west, bounds[i].south, bounds[i].east, bounds[i].north};
      if (systems[i].unit == HorizontalUnit::kDegree) continue;
      maps_[i] = understand_map(system_text(systems[i].system), systems[i].metres_per_unit);
      if (const auto ground = ground_under(*maps_[i], bounds[i])) grounds_[i] = ground->extent;
    }
  }

  /// What the request comes to for all of the ground: a code or WKT.
  [[nodiscard]] std::string target(const ProjectionRequest& onto) const {
    if (onto.kind == ProjectionKind::kSystem) return onto.system;
    GeoExtent all = grounds_.front();
    for (const GeoExtent& ground : grounds_) {
      const double turn = 360.0 * std::round((all.middle().longitude - ground.middle().longitude) / 360.0);
      all.west = std::min(all.west, ground.west + turn);
      all.east = std::max(all.east, ground.east + turn);
      all.south = std::min(all.south, ground.south);
      all.north = std::max(all.north, ground.north);
    }
    const Georeference& first = systems_.front();
    const ProjectionSpec spec =
        choose_projection(onto, {"mosaic", first.system.body, ellipsoid(0), all, false, false, false}).spec;
    constexpr int kWgs84 = 4326;
    const auto code = projection_epsg(spec, kWgs84);
    return code ? fmt::format("EPSG:{}", *code) : projection_wkt(spec, "");
  }

  /// Has the whole lie in `system`, and says how the members of each system come there.
  [[nodiscard]] std::vector<std::shared_ptr<const MosaicWay>> ways_to(const std::string& system,
                                                                      SourceInfo& whole) const {
    const std::string target = on_body_of(systems_[0].system, ellipsoid(0), system).text;
    std::vector<std::shared_ptr<const MosaicWay>> ways(systems_.size());
    SourceInfo there;
    take_system(target, there);
    Georeference& place = whole.georeference;
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
      if (way.is_ballpark) {
        whole.warnings.push_back(loss(
            fmt::format("PROJ knows no way from the datum of {} to that of \"{}\": they are taken for one, which may "
                        "be off by some "
                        "hundred metres",
                        name_of(systems_[i]), way.system.name)));
      }
      ways[i] = std::make_shared<MosaicWay>(MosaicWay{std::move(way.map), maps_[i]});
    }
    const std::string datum = place.system.vertical_datum;
    const std::optional<int> code = place.system.vertical_epsg;
    place.unit = there.georeference.unit;
    place.metres_per_unit = there.georeference.metres_per_unit;
    place.system = there.georeference.system;
    place.system.vertical_datum = datum;
    place.system.vertical_epsg = code;
    return ways;
  }

 private:
  [[nodiscard]] Ellipsoid ellipsoid(std::size_t i) const {
    if (maps_[i]) return maps_[i]->ellipsoid();
    const ReferenceSystem& system = systems_[i].system;
    if (!system.semi_major_axis_m) return {};
    return {*system.semi_major_axis_m, system.inverse_flattening.value_or(0.0)};
  }
  const std::vector<Georeference>& systems_;
  std::vector<GeoExtent> grounds_;
  std::vector<std::shared_ptr<const ReferenceMap>> maps_;  ///< nullptr: degrees
};

/// What the files say, read in parallel, taken up in their order: the first error is that of the first file at fault.
std::vector<PlacedMember> survey(const std::vector<std::string>& paths, const OpenOptions& options,
                                 const ProjectionRequest& onto, MosaicPlan& plan) {
  struct Opened {
    SourceInfo info;
    FileStamp stamp;
    std::uint64_t reader_bytes = 0;
    std::exception_ptr failure;
  };
  plan.readers_at_once = oneapi::tbb::this_task_arena::max_concurrency();
  OpenOptions share = options;
  share.unpacked_bytes /= static_cast<std::uint64_t>(plan.readers_at_once);
  Survey found(plan, onto.is_given && (onto.is_auto || onto.kind != ProjectionKind::kNone));
  const std::size_t at_once = std::min(kOpenedAtOnce, most_open_rasters());
  for (std::size_t from = 0; from < paths.size(); from += at_once) {
    std::vector<Opened> opened(std::min(at_once, paths.size() - from));
    oneapi::tbb::parallel_for(std::size_t{0}, opened.size(), [&](std::size_t i) {
      try {
        opened[i].stamp = FileStamp::of(paths[from + i]);
        const std::unique_ptr<HeightSource> source = open_raster(paths[from + i], share);
        opened[i].info = source->info();
        opened[i].reader_bytes = source->buffer_bytes(UINT64_MAX);
      } catch (...) {
        opened[i].failure = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < opened.size(); ++i) {
      if (opened[i].failure) std::rethrow_exception(opened[i].failure);
      plan.reader_bytes = std::max(plan.reader_bytes, opened[i].reader_bytes);
      found.add(paths[from + i], std::move(opened[i].info), opened[i].stamp);
    }
  }
  std::vector<PlacedMember> members = found.finish();
  if (found.systems().size() == 1) {
    refuse_mixed_cuts(members, plan.kinds);
    return members;
  }
  const Joining joining(found.systems(), members, found.system_of());
  const auto ways = joining.ways_to(joining.target(onto), plan.info);
  for (std::size_t i = 0; i < members.size(); ++i) members[i].way = ways[found.system_of()[i]];
  plan.is_reprojected = true;
  return members;
}

}  // namespace

MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                       const std::optional<BoundingBox>& box, const ProjectionRequest& onto) {
  if (paths.empty()) throw Error(ErrorCode::kInvalidArgument, "a mosaic of no files");
  refuse_duplicates(paths);
  MosaicPlan plan;
  std::vector<PlacedMember> members = survey(paths, options, onto, plan);
  if (plan.info.georeference.unit == HorizontalUnit::kDegree && !plan.is_reprojected) join_antimeridian(members);
  place_members(std::move(members), plan);
  plan.info.path = fmt::format("mosaic of {} files", paths.size());
  plan.region = box ? samples_in(*box, plan.info) : Window{0, 0, plan.info.width, plan.info.height};
  plan.holes = find_holes(plan);
  const bool interpolated = plan.layers.size() > 1 || !plan.is_on_grid(plan.layers.front());
  const char* const why = !interpolated            ? nullptr
                          : plan.has_resolutions() ? "the files differ in resolution"
                                                   : "the files differ in reference system";
  plan.samples = choose_mosaic_samples(plan.kinds, plan.holes.samples > 0 || plan.is_reprojected, why);
  SourceInfo& info = plan.info;
  info.sample_type = plan.samples.kind.type;
  info.void_values = plan.samples.kind.void_values;
  for (const SampleKind& kind : plan.kinds) {
    for (const double value : kind.void_values) {
      if (std::ranges::find(info.void_values_of_files, value) == info.void_values_of_files.end())
        info.void_values_of_files.push_back(value);
    }
  }
  std::ranges::sort(info.void_values_of_files);
  info.valid_min = plan.samples.kind.valid_min;
  info.valid_max = plan.samples.kind.valid_max;
  info.z_scale = plan.samples.kind.z_scale;
  info.z_offset = plan.samples.kind.z_offset;
  info.block_width = info.width;
  info.warnings.insert(info.warnings.end(), plan.samples.notes.begin(), plan.samples.notes.end());
  if (plan.holes.samples > 0) info.warnings.push_back(plan.holes.describe(kHolesNamed));
  return plan;
}

}  // namespace isohf
