#include "formats/mosaic/mosaic_layout.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <utility>

#include "formats/georeference/reference_system.h"
#include "formats/mosaic/reader_pool.h"
#include "isohf/error.h"
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
  throw Error(ErrorCode::kInvalidArgument, path + ": " + why);
}

void refuse_duplicates(const std::vector<std::string>& paths) {
  std::map<std::pair<dev_t, ino_t>, std::size_t> known;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    struct stat status {};
    if (::stat(paths[i].c_str(), &status) != 0) continue;  // opening it says why
    const auto [found, is_new] = known.insert({{status.st_dev, status.st_ino}, i});
    if (is_new) continue;
    const std::string& other = paths[found->second];
    refuse(paths[i], other == paths[i] ? "is named twice among the inputs" : "is the same file as " + other);
  }
}

std::string unit_name(const Georeference& place) {
  switch (place.unit) {
    case HorizontalUnit::kDegree:
      return "degrees";
    case HorizontalUnit::kMetre:
      return place.metres_per_unit == 1.0 ? "metres" : fmt::format("units of {} m", place.metres_per_unit);
    case HorizontalUnit::kUnknown:
      break;
  }
  return "an unknown unit";
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
  agreement.same(ours.body, other.body, "body");
  agreement.same_length(ours.semi_major_axis_m, other.semi_major_axis_m, "semi-major axis");
  agreement.same_length(ours.inverse_flattening, other.inverse_flattening, "inverse flattening");
  agreement.same(ours.vertical_epsg, other.vertical_epsg, "vertical EPSG code");
  // Codes say all; texts are compared where there are none. Names of one system differ from program to program.
  if (by_code) return;
  const bool by_text = !ours.wkt.empty() && !other.wkt.empty();
  agreement.same(ours.wkt, other.wkt, "reference system");
  if (!by_text && !(ours.epsg || other.epsg)) agreement.same(ours.name, other.name, "reference system");
}

/// Collects what the files say, one after the other.
class Survey {
 public:
  explicit Survey(MosaicPlan& plan) : plan_(&plan) {}

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
  }

  void compare(const std::string& path, const SourceInfo& info) {
    SourceInfo& whole = plan_->info;
    if (whole.format != info.format) whole.format = "mosaic";
    const Georeference& place = info.georeference;
    const Georeference& ours = whole.georeference;
    if (place.unit != ours.unit || place.metres_per_unit != ours.metres_per_unit) {
      refuse(path, fmt::format("its coordinates are in {}, those of {} in {}; reproject one of them (gdalwarp -t_srs)",
                               unit_name(place), first_, unit_name(ours)));
    }
    if (place.registration != ours.registration) {
      refuse(path, fmt::format("its samples stand for {}, those of {} for {}; `registration` says what holds for all",
                               words(place.registration), first_, words(ours.registration)));
    }
    Agreement agreement;
    agree_on_system(whole.georeference.system, place.system, agreement);
    if (!agreement.holds()) {
      refuse(path, agreement.why(first_) + "; reproject one of them (gdalwarp -t_srs) or leave it out");
    }
    if (!info.vertical_unit.empty()) {
      if (whole.vertical_unit.empty()) {
        whole.vertical_unit = info.vertical_unit;
        whole.metres_per_vertical_unit = info.metres_per_vertical_unit;
      } else if (whole.metres_per_vertical_unit != info.metres_per_vertical_unit) {
        refuse(path, fmt::format("its elevations are in {}, those of {} in {}; convert one of them first (gdal_calc)",
                                 info.vertical_unit, first_, whole.vertical_unit));
      }
    }
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
  std::string first_;
  std::vector<PlacedMember> placed_;
  std::vector<FileWarning> warnings_;
  std::int64_t silent_ = 0;
};

/// What the files say, read in parallel, taken up in their order: the first error is that of the first file at fault.
std::vector<PlacedMember> survey(const std::vector<std::string>& paths, const OpenOptions& options, MosaicPlan& plan) {
  struct Opened {
    SourceInfo info;
    FileStamp stamp;
    std::uint64_t reader_bytes = 0;
    std::exception_ptr failure;
  };
  plan.readers_at_once = oneapi::tbb::this_task_arena::max_concurrency();
  OpenOptions share = options;
  share.unpacked_bytes /= static_cast<std::uint64_t>(plan.readers_at_once);
  Survey found(plan);
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
  return found.finish();
}

}  // namespace

MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                       const std::optional<BoundingBox>& box) {
  if (paths.empty()) throw Error(ErrorCode::kInvalidArgument, "a mosaic of no files");
  refuse_duplicates(paths);
  MosaicPlan plan;
  std::vector<PlacedMember> members = survey(paths, options, plan);
  if (plan.info.georeference.unit == HorizontalUnit::kDegree) join_antimeridian(members);
  place_members(std::move(members), plan);
  plan.info.path = fmt::format("mosaic of {} files", paths.size());
  plan.region = box ? samples_in(*box, plan.info) : Window{0, 0, plan.info.width, plan.info.height};
  plan.holes = find_holes(plan);
  const bool interpolated = plan.layers.size() > 1 || !plan.is_on_grid(plan.layers.front());
  plan.samples = choose_mosaic_samples(plan.kinds, plan.holes.samples > 0, interpolated);
  SourceInfo& info = plan.info;
  info.sample_type = plan.samples.kind.type;
  info.void_values = plan.samples.kind.void_values;
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
