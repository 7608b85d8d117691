#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The int32 sample of a place without a point.
constexpr std::int32_t kNoWhole = std::numeric_limits<std::int32_t>::min();
/// Coordinates nearer than this are one: a tenth of a micrometre, or a hundredth of a metre in degrees.
constexpr double kSame = 1e-7;
/// The most different x, and y.
constexpr std::size_t kMostCoordinates = std::size_t{1} << 20U;
/// Coordinates farther off the grid than this are not rounded ones, in spacings.
constexpr double kOffSpacing = 0.1;
constexpr double kMostCellsToAPoint = 16.0;
constexpr double kFarthestCoordinate = 1e11;

bool is_number(std::string_view text) {
  double value = 0.0;
  return read_decimal(text, value);
}

/// Elevation of a point, NaN for a word that means nodata; false for anything else.
bool read_elevation(std::string_view text, double& value) {
  constexpr std::array<std::string_view, 7> kNodata = {"", "na", "n/a", "null", "none", "nodata", "--"};
  if (read_decimal(text, value)) return true;
  value = std::numeric_limits<double>::quiet_NaN();
  return std::ranges::find(kNodata, lower_case(text.substr(0, 8))) != kNodata.end();
}

bool is_comment(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == line.npos || std::string_view("#!%").find(line[first]) != std::string_view::npos ||
         line.substr(first, 2) == "//";
}

/// The fields of a line, one after the other, without the blanks and quotes around them.
class Fields {
 public:
  /// separator  ';', ',' or '\t'; ' ' for any blanks
  Fields(std::string_view line, char separator)
      : at_(line.data()), end_(at_ + line.size()), separator_(separator), is_due_(separator != ' ') {}

  bool next(std::string_view& field) {
    skip_blanks();
    if (at_ == end_ && !is_due_) return false;
    const char* const begin = at_;
    while (at_ != end_ && (separator_ == ' ' ? !is_blank(*at_) : *at_ != separator_)) ++at_;
    const char* stop = at_;
    while (stop != begin && is_blank(stop[-1])) --stop;
    field = {begin, static_cast<std::size_t>(stop - begin)};
    skip_blanks();
    is_due_ = separator_ != ' ' && at_ != end_ && *at_ == separator_;
    if (is_due_) ++at_;
    return true;
  }

  static std::vector<std::string_view> all(std::string_view line, char separator) {
    std::vector<std::string_view> list;
    Fields fields(line, separator);
    for (std::string_view field; fields.next(field);) list.push_back(field);
    return list;
  }

 private:
  [[nodiscard]] bool is_blank(char c) const {
    return c == ' ' || c == '\r' || c == '"' || (c == '\t' && separator_ != '\t');
  }
  void skip_blanks() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
  }

  const char* at_;
  const char* end_;
  char separator_;
  bool is_due_;  ///< a field follows, though it may be empty
};

struct Point {
  double x = 0.0;
  double y = 0.0;
  std::string_view z;
};

/// Which fields of a line are x, y and z, and what keeps fields apart.
struct Columns {
  std::array<std::size_t, 3> at = {0, 1, 2};
  char separator = ' ';
  bool is_named = false;    ///< by a line before the first point
  bool is_guessed = false;  ///< that line names neither x nor y
  bool has_commas = false;  ///< between blanks, as decimal signs
  bool in_degrees = false;
  std::string note;  ///< how names were understood, if not all are known

  enum class Line { kPassed, kPoint, kForeign };
  /// Takes the lines of a text up to its first point: comments and a line of names may be before it.
  Line begin(std::string_view line) {
    if (is_comment(line)) return Line::kPassed;
    if (find_separator(line)) return Line::kPoint;
    is_named = !is_named && name(line);
    return is_named ? Line::kPassed : Line::kForeign;
  }

  /// False if the line is not a point.
  bool read(std::string_view line, Point& point) const {
    std::array<std::string_view, 3> found;
    const std::size_t last = std::ranges::max(at);
    Fields fields(line, separator);
    std::string_view field;
    for (std::size_t i = 0; i <= last; ++i) {
      if (!fields.next(field)) return false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (at[axis] == i) found[axis] = field;
      }
    }
    point.z = found[2];
    return read_decimal(found[0], point.x) && read_decimal(found[1], point.y) &&
           std::abs(point.x) < kFarthestCoordinate && std::abs(point.y) < kFarthestCoordinate;
  }

 private:
  /// Whether a line is a point with some separator. Commas between blanks are decimal signs if that makes numbers of all
  /// three fields.
  bool find_separator(std::string_view line) {
    Point point;
    double z = 0.0;
    return std::ranges::any_of(std::string_view("; ,"), [&](char candidate) {
      separator = candidate;
      const bool is_possible = candidate == ' ' ? line.find(" ,") == line.npos : line.find(candidate) != line.npos;
      has_commas = candidate == ' ' && line.find(',') != line.npos;
      return is_possible && read(line, point) && read_elevation(point.z, z);
    });
  }

  /// Takes the columns from a line of names. x and y alone: z is behind both, or the third of three. Without them the
  /// first three columns are x, y and z, as GDAL has it. False if it is no such line, or if names contradict that.
  bool name(std::string_view line) {
    static constexpr std::array<std::array<std::string_view, 8>, 3> kNames = {
        {{"x", "lon", "long", "longitude", "easting", "east", "e", "rechtswert"},
         {"y", "lat", "latitude", "northing", "north", "n", "hochwert", "y"},
         {"z", "elevation", "height", "altitude", "elev", "alt", "hoehe", "h"}}};
    char between = ' ';
    for (const char candidate : {'\t', ',', ';'}) between = line.find(candidate) == line.npos ? between : candidate;
    std::vector<std::string_view> fields = Fields::all(line, between);
    std::erase_if(fields, [](std::string_view unit) { return unit.starts_with('[') || unit.starts_with('('); });
    if (fields.size() < 3 || std::ranges::any_of(fields, is_number)) return false;
    std::array<std::optional<std::size_t>, 3> found;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const std::string_view wanted : kNames[axis]) {
        for (std::size_t i = 0; i < fields.size() && !found[axis]; ++i) {
          std::string known = lower_case(fields[i]);  // without what follows: "z [m]", "elevation_m"
          if (known.starts_with("point_")) known.erase(0, 6);
          known.resize(std::min(known.find_first_of(" _-.([0123456789"), known.size()));
          if (known == wanted) found[axis] = i;
        }
      }
    }
    auto& [x, y, z] = found;
    is_guessed = !x || !y;
    const bool are_all_known = x && y && z;
    const std::size_t behind = is_guessed ? 2 : std::max(*x, *y) + 1;
    if (is_guessed && x.value_or(0) == 0 && y.value_or(1) == 1 && z.value_or(2) == 2) found = {0, 1, 2};
    if (x && y && !z && (behind < fields.size() || fields.size() == 3))
      z = behind < fields.size() ? behind : 3 - *x - *y;
    if (!x || !y || !z) return false;
    at = {*x, *y, *z};
    in_degrees = lower_case(fields[*x]).starts_with("lon");
    if (!are_all_known) {
      note = fmt::format("the columns \"{}\", \"{}\" and \"{}\" are read as x, y and z", printable(fields[*x]),
                         printable(fields[*y]), printable(fields[*z]));
    }
    return true;
  }
};

/// The coordinates of one axis, each with the line that has it first; evenly spaced ones once they are all there.
class Axis {
 public:
  Axis(std::string path, char name) : path_(std::move(path)), name_(name) {}

  void see(double value, std::uint64_t line) {
    const std::int64_t key = std::llround(value / kSame);
    if (!seen_.empty() && key == seen_[last_].key) return;
    const std::size_t next = last_ + 1 < seen_.size() ? last_ + 1 : 0;  // as on the row before
    if (!seen_.empty() && key == seen_[next].key) {
      last_ = next;
      return;
    }
    const auto [found, is_new] = index_.try_emplace(key, seen_.size());
    last_ = found->second;
    if (!is_new) return;
    if (seen_.size() == kMostCoordinates) {
      refuse(line, fmt::format("has the {}th different {}", kMostCoordinates + 1, name_));
    }
    seen_.push_back({key, value, line});
  }

  void settle() {
    std::ranges::sort(seen_, {}, &Seen::value);
    double least = INFINITY;
    for (std::size_t i = 1; i < seen_.size(); ++i) {
      const double step = seen_[i].value - seen_[i - 1].value;
      if (step > 2.0 * kSame) least = std::min(least, step);
    }
    if (!std::isfinite(least)) refuse(seen_[0].line, fmt::format("has the {} of all points", name_));
    double steps = 0.0;
    for (std::size_t i = 1; i < seen_.size(); ++i) steps += std::round((seen_[i].value - seen_[i - 1].value) / least);
    first_ = seen_.front().value;
    step_ = (seen_.back().value - first_) / steps;
    if (!(steps < 0x1p31)) refuse(seen_[1].line, fmt::format("has {} {}, on no regular grid", name_, seen_[1].value));
    count_ = static_cast<std::int64_t>(steps) + 1;
    // A coordinate off the grid of the nearest two is at fault, if there is one: it has bent the other grid.
    if (off_grid(step_) != nullptr) {
      const double spacing = off_grid(least) != nullptr ? least : step_;
      const Seen& each = *off_grid(spacing);
      refuse(each.line, fmt::format("has {} {}, {:.2f} spacings of {} off the grid", name_, each.value,
                                    std::abs(std::remainder((each.value - first_) / spacing, 1.0)), spacing));
    }
    index_.clear();
    seen_ = {};
  }

  [[nodiscard]] std::int64_t cell(double value) const { return std::llround((value - first_) / step_); }
  [[nodiscard]] double first() const { return first_; }
  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  struct Seen {
    std::int64_t key;
    double value;
    std::uint64_t line;
  };

  /// The first coordinate that is between those of a spacing; nullptr if none is.
  [[nodiscard]] const Seen* off_grid(double spacing) const {
    const auto found = std::ranges::find_if(seen_, [&](const Seen& each) {
      return std::abs(std::remainder((each.value - first_) / spacing, 1.0)) > kOffSpacing;
    });
    return found == seen_.end() ? nullptr : &*found;
  }

  [[noreturn]] void refuse(std::uint64_t line, const std::string& what) const {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("{}: line {} {}; isohf reads points of a regular grid (gdal_grid makes one)", path_, line, what));
  }

  std::string path_;
  char name_;
  std::vector<Seen> seen_;
  std::unordered_map<std::int64_t, std::size_t> index_;
  std::size_t last_ = 0;
  double first_ = 0.0;
  double step_ = 1.0;
  std::int64_t count_ = 0;
};

class XyzSource final : public PlainSource {
 public:
  XyzSource(const std::string& path, const OpenOptions& options) : PlainSource(path, "XYZ text") {
    (void)choose_band(info_, options, 1);
    const RawFile text(path);
    Axis x(path, 'x');
    Axis y(path, 'y');
    survey(text, x, y);
    info_.width = x.count();
    info_.height = y.count();
    const double cells = static_cast<double>(info_.width) * static_cast<double>(info_.height);
    if (cells > kMostCellsToAPoint * static_cast<double>(points_)) {
      fail(ErrorCode::kUnsupported,
           fmt::format("its {} points are few of {} x {}; isohf reads points of a regular grid (gdal_grid makes one)",
                       points_, info_.width, info_.height));
    }
    info_.sample_type = is_whole_ ? SampleType::kInt32 : SampleType::kFloat64;
    const auto size = static_cast<std::uint64_t>(size_bytes(info_.sample_type));
    if (by_columns_) {
      layout_.row_bytes = size;
      layout_.column_bytes = size * static_cast<std::uint64_t>(info_.height);
    }
    const std::uint64_t again = is_whole_ ? scatter<std::int32_t>(text, x, y, kNoWhole)
                                          : scatter<double>(text, x, y, std::numeric_limits<double>::quiet_NaN());
    if (again > 0) {
      info_.warnings.push_back(
          loss(fmt::format("{} points come again with other elevations; the last one of each place is read", again)));
    }
    std::string last(1, '\0');
    (void)text.read_some(text.size_bytes() - 1, std::as_writable_bytes(std::span(last)));
    if (last != "\n" && static_cast<double>(points_) < cells) {
      info_.warnings.push_back(
          loss(fmt::format("the text ends within a line, and {} x {} places have {} points: it may be cut off",
                           info_.width, info_.height, points_)));
    }
    Georeference& place = info_.georeference;
    place.registration = Registration::kPoint;
    place.spacing_x = x.step();
    place.spacing_y = y.step();
    place.has_origin = true;
    place.origin_x = x.first();
    place.origin_y = y.first() + static_cast<double>(info_.height - 1) * y.step();
    read_sidecars(info_, 1);
    if (is_whole_) {
      info_.void_values.insert(info_.void_values.begin(), static_cast<double>(kNoWhole));
      info_.valid_min = static_cast<double>(kNoWhole) + 1.0;  // nodata whatever `void_values` say
    }
    info_.block_width = info_.width;
    info_.block_height = by_columns_ ? std::min<std::int64_t>(info_.height, 64) : 1;
    apply_open_options(info_, options);
  }

 private:
  /// Calls use(point, number of its line) for each point; notes what the first lines say.
  template <typename Use>
  void for_each_point(const RawFile& text, const Use& use) {
    TextTokens lines(text);
    columns_ = {};
    auto kind = Columns::Line::kPassed;
    std::string_view line;
    std::uint64_t number = 0;
    Point point;
    while (lines.next_line(line)) {
      if (++number == 1) line = without_byte_order_mark(line);
      if (kind != Columns::Line::kPoint) {
        kind = columns_.begin(line);
        if (kind == Columns::Line::kPassed) continue;
      } else if (is_comment(line)) {
        continue;
      }
      const bool is_foreign = kind == Columns::Line::kForeign;
      if (is_foreign || !columns_.read(line, point) || !use(point, number)) {
        fail(ErrorCode::kCorrupt, fmt::format("line {} is \"{}\", must be x, y and z{}", number, printable(line),
                                              is_foreign ? ", or their names" : ""));
      }
    }
  }

  /// Goes through all points once: where they are, and whether their elevations are whole.
  void survey(const RawFile& text, Axis& x, Axis& y) {
    Point first;
    std::int32_t whole = 0;
    for_each_point(text, [&](const Point& point, std::uint64_t line) {
      x.see(point.x, line);
      y.see(point.y, line);
      is_whole_ = is_whole_ && read_whole(point.z, whole) && whole != kNoWhole;
      if (points_ == 0) first = point;
      if (points_ == 1) by_columns_ = std::abs(point.x - first.x) < kSame;
      layout_.from_south = point.y > first.y;  // of the last one
      ++points_;
      return true;
    });
    if (points_ < 4) fail(ErrorCode::kCorrupt, fmt::format("has {} points, a grid has four at least", points_));
    if (!columns_.note.empty()) info_.warnings.emplace_back(columns_.note);
    if (columns_.has_commas) info_.warnings.emplace_back("commas between blanks are decimal signs: 1,5 is read as 1.5");
    if (columns_.in_degrees) info_.georeference.unit = HorizontalUnit::kDegree;
    x.settle();
    y.settle();
  }

  /// Goes through them again and puts each elevation in its cell of a file without a name; `nothing` where no point is.
  /// Returns the number of points at a place that had another elevation already.
  template <typename T>
  std::uint64_t scatter(const RawFile& text, const Axis& x, const Axis& y, T nothing) {
    constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 17U;
    const auto width = static_cast<std::uint64_t>(info_.width);
    const auto height = static_cast<std::uint64_t>(info_.height);
    const std::uint64_t cells = width * height;
    std::error_code error;
    const std::string folder = std::filesystem::temp_directory_path(error).string();
    if (error) fail(ErrorCode::kIo, "needs a folder for temporary files, and TMPDIR names none: " + error.message());
    File file = File::scratch(folder, cells * sizeof(T));
    std::vector<T> run(std::min(cells, kAtOnce), nothing);
    for (std::uint64_t at = 0; at < cells; at += run.size()) {
      file.write_at(at * sizeof(T),
                    std::as_bytes(std::span(run).first(std::min<std::uint64_t>(run.size(), cells - at))));
    }
    using Elevation = std::pair<std::uint64_t, T>;  // with its cell
    std::vector<Elevation> batch;
    std::uint64_t again = 0;
    const auto store = [&] {
      constexpr std::uint64_t kGap = 512;  // cells that are rather read than left out
      if (!std::ranges::is_sorted(batch, {}, &Elevation::first)) {
        std::ranges::stable_sort(batch, {}, &Elevation::first);
      }
      for (std::size_t i = 0, end = 0; i < batch.size();) {
        const std::uint64_t begin = batch[i].first;
        for (end = i + 1; end < batch.size(); ++end) {
          if (batch[end].first > batch[end - 1].first + kGap || batch[end].first >= begin + run.size()) break;
        }
        const auto there = std::span(run).first(batch[end - 1].first + 1 - begin);
        (void)file.read_at(begin * sizeof(T), std::as_writable_bytes(there));
        for (; i < end; ++i) {
          T& cell = there[batch[i].first - begin];
          const T value = batch[i].second;
          if (value == nothing || value != value) continue;
          again += cell == nothing || cell != cell || cell == value ? 0 : 1;
          cell = value;
        }
        file.write_at(begin * sizeof(T), std::as_bytes(there));
      }
      batch.clear();
    };
    std::uint64_t count = 0;
    for_each_point(text, [&](const Point& point, std::uint64_t) {
      double value = 0.0;
      if (!read_elevation(point.z, value)) return false;
      const auto column = static_cast<std::uint64_t>(x.cell(point.x));
      const auto from_south = static_cast<std::uint64_t>(y.cell(point.y));
      if (column >= width || from_south >= height || ++count > points_) {
        fail(ErrorCode::kCorrupt, "has changed while it was read");
      }
      const std::uint64_t row = layout_.from_south ? from_south : height - 1 - from_south;
      batch.emplace_back(by_columns_ ? column * height + row : row * width + column, static_cast<T>(value));
      if (batch.size() == kAtOnce) store();
      return true;
    });
    store();
    file_.emplace(fmt::format("/proc/self/fd/{}", file.descriptor()));
    return again;
  }

  Columns columns_;
  bool is_whole_ = true;
  bool by_columns_ = false;
  std::uint64_t points_ = 0;
};

bool looks_like_xyz(std::span<const std::byte> head) {
  std::string_view text = without_byte_order_mark(text_of(head));
  Columns columns;
  Point point;
  int points = 0;
  for (std::size_t end = 0; (end = text.find('\n')) != text.npos && points < 2; text.remove_prefix(end + 1)) {
    const std::string_view line = text.substr(0, end);
    const auto kind = points == 0                 ? columns.begin(line)
                      : is_comment(line)          ? Columns::Line::kPassed
                      : columns.read(line, point) ? Columns::Line::kPoint
                                                  : Columns::Line::kForeign;
    if (kind == Columns::Line::kForeign || columns.is_guessed) return false;
    if (kind == Columns::Line::kPassed) continue;
    // Without names, text in more columns is anything.
    const auto fields = Fields::all(line, columns.separator);
    if (!columns.is_named && fields.size() > 3 && !fields[3].empty()) return false;
    ++points;
  }
  return points == 2;
}

bool is_xyz(const std::string& path) {
  if (!lower_case(path).ends_with(".xyz")) return false;
  const std::string text = first_bytes(RawFile(path), 512);
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 && (c < '\t' || c > '\r'); };
  return std::ranges::none_of(text, is_control);
}

std::unique_ptr<HeightSource> open_xyz(const std::string& path, const OpenOptions& options) {
  return std::make_unique<XyzSource>(path, options);
}

}  // namespace

const Format kXyzFormat = {
    .name = "XYZ text", .extensions = {".xyz"}, .open = open_xyz, .recognises = looks_like_xyz, .described = is_xyz};

}  // namespace isohf
