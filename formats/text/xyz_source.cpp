#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/bytes.h"
#include "isohf/base/file.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr std::size_t kMostFields = 32;
constexpr std::int32_t kNoWhole = std::numeric_limits<std::int32_t>::min();
/// Coordinates nearer than this are one: a tenth of a micrometre, or a hundredth of a metre in degrees.
constexpr double kSame = 1e-7;
/// Columns and rows are told apart by so many coordinates each.
constexpr std::size_t kMostCoordinates = std::size_t{1} << 20U;
/// Off the grid by more than this is no rounding, in spacings.
constexpr double kOffSpacing = 0.1;
constexpr double kMostCellsToAPoint = 16.0;

/// The fields of a line between blanks and one separator; where that is a semicolon, numbers may have decimal commas.
struct Fields {
  std::array<std::string_view, kMostFields> text;
  std::size_t count = 0;

  explicit Fields(std::string_view line) {
    const char separator = line.find(';') != std::string_view::npos ? ';' : ',';
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
    const char* at = line.data();
    const char* const end = at + line.size();
    while (count < kMostFields) {
      while (at != end && blank(*at)) ++at;
      if (at == end) return;
      const char* const begin = at;
      while (at != end && !blank(*at) && *at != separator) ++at;
      text[count++] = {begin, static_cast<std::size_t>(at - begin)};
      while (at != end && blank(*at)) ++at;
      if (at != end && *at == separator) ++at;
    }
  }
};

bool is_number(std::string_view text) {
  double value = 0.0;
  return read_decimal(text, value);
}

bool is_comment(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == std::string_view::npos || line[first] == '#' || line.substr(first, 2) == "//";
}

/// Which fields are x, y and z.
struct Columns {
  std::array<std::size_t, 3> at = {0, 1, 2};
  bool is_header = false;  ///< names them
  bool in_degrees = false;

  /// What a first line says of those that follow; nullopt where it is none of a grid's.
  static std::optional<Columns> of(std::string_view line) {
    static constexpr std::array<std::array<std::string_view, 6>, 3> kNames = {
        {{"x", "lon", "long", "longitude", "easting", "e"},
         {"y", "lat", "latitude", "northing", "n", ""},
         {"z", "elevation", "height", "altitude", "elev", "h"}}};
    const Fields fields(line);
    Columns columns;
    if (fields.count >= 3 && std::all_of(fields.text.begin(), fields.text.begin() + 3, is_number)) return columns;
    columns.is_header = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bool found = false;
      for (std::size_t i = 0; i < fields.count && !found; ++i) {
        const std::string name = lower_case(fields.text[i]);
        found = std::ranges::find(kNames[axis], name) != kNames[axis].end();
        if (found) columns.at[axis] = i;
        if (found && axis == 0) columns.in_degrees = name.starts_with("lon");
      }
      if (!found) return std::nullopt;
    }
    return columns;
  }
};

/// The lines of a text that hold something, one after the other.
class Lines {
 public:
  explicit Lines(const RawFile& file) : file_(file), buffer_(std::size_t{1} << 18U) {}

  bool next(std::string_view& line) {
    for (;;) {
      const auto* end = static_cast<const char*>(std::memchr(buffer_.data() + at_, '\n', filled_ - at_));
      if (end == nullptr && fill()) continue;
      const std::size_t stop = end == nullptr ? filled_ : static_cast<std::size_t>(end - buffer_.data());
      if (end == nullptr && stop == at_) return false;
      ++number_;
      line = {buffer_.data() + at_, stop - at_};
      at_ = std::min(stop + 1, filled_);
      if (line.size() > kLongestLine) {
        throw Error(ErrorCode::kCorrupt,
                    fmt::format("{}: line {} is longer than {} bytes", file_.path(), number_, kLongestLine));
      }
      if (!is_comment(line)) return true;
    }
  }
  [[nodiscard]] std::uint64_t number() const { return number_; }

 private:
  bool fill() {
    if (at_ == 0 && filled_ == buffer_.size()) return false;  // one line, which is too long
    std::memmove(buffer_.data(), buffer_.data() + at_, filled_ - at_);
    filled_ -= at_;
    at_ = 0;
    const std::size_t got = file_.read_some(read_, std::as_writable_bytes(std::span(buffer_).subspan(filled_)));
    read_ += got;
    filled_ += got;
    return got > 0;
  }

  const RawFile& file_;
  std::vector<char> buffer_;
  std::size_t at_ = 0;
  std::size_t filled_ = 0;
  std::uint64_t read_ = 0;
  std::uint64_t number_ = 0;
};

/// The coordinates of one axis, each with the line that has it first; evenly spaced ones once they are all there.
class Axis {
 public:
  Axis(std::string path, char name) : path_(std::move(path)), name_(name) {}

  void see(double value, std::uint64_t line) {
    const std::int64_t key = std::llround(value / kSame);
    if (!seen_.empty()) {
      if (key == seen_[last_].key) return;
      const std::size_t next = last_ + 1 == seen_.size() ? 0 : last_ + 1;  // as on the row before
      if (key == seen_[next].key) {
        last_ = next;
        return;
      }
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
    // What lies off the grid of the nearest two is at fault, where one does: it has bent the other grid.
    if (off_grid(step_) != nullptr) {
      const Seen* const by_least = off_grid(least);
      const double spacing = by_least != nullptr ? least : step_;
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

  /// The first coordinate that lies between those of a spacing; nullptr where none does.
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
    const RawFile text(path, options.unpacked_bytes);
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
    info_.sample_type = whole_ ? SampleType::kInt32 : SampleType::kFloat64;
    const auto size = static_cast<std::uint64_t>(size_bytes(info_.sample_type));
    layout_.from_south = true;
    if (by_columns_) {
      layout_.row_bytes = size;
      layout_.column_bytes = size * static_cast<std::uint64_t>(info_.height);
    }
    if (whole_) {
      scatter<std::int32_t>(text, x, y, kNoWhole);
    } else {
      scatter<double>(text, x, y, std::numeric_limits<double>::quiet_NaN());
    }
    Georeference& place = info_.georeference;
    place.registration = Registration::kPoint;
    if (columns_.in_degrees) place.unit = HorizontalUnit::kDegree;
    place.spacing_x = x.step();
    place.spacing_y = y.step();
    place.has_origin = true;
    place.origin_x = x.first();
    place.origin_y = y.first() + static_cast<double>(info_.height - 1) * y.step();
    read_files_beside(info_, 1);
    if (whole_) {
      info_.void_values.insert(info_.void_values.begin(), static_cast<double>(kNoWhole));
      info_.valid_min = static_cast<double>(kNoWhole) + 1.0;  // void whatever `void_values` say
    }
    info_.block_width = info_.width;
    info_.block_height = by_columns_ ? std::min<std::int64_t>(info_.height, 64) : 1;
    apply_open_options(info_, options);
  }

 private:
  struct Point {
    double x = 0.0;
    double y = 0.0;
    std::string_view z;
  };

  Point point_of(std::string_view line, std::uint64_t number) const {
    const Fields fields(line);
    Point point;
    const std::size_t last = std::ranges::max(columns_.at);
    if (last >= fields.count || !read_decimal(fields.text[columns_.at[0]], point.x) ||
        !read_decimal(fields.text[columns_.at[1]], point.y) || !(std::abs(point.x) < 1e11) ||
        !(std::abs(point.y) < 1e11)) {
      fail(ErrorCode::kCorrupt, fmt::format("line {} is \"{}\", must be x, y and z", number, printable(line)));
    }
    point.z = fields.text[columns_.at[2]];
    return point;
  }

  /// Goes through all points once: where they lie, and whether their elevations are whole.
  void survey(const RawFile& text, Axis& x, Axis& y) {
    Lines lines(text);
    std::string_view line;
    double first_x = 0.0;
    bool is_first = true;
    while (lines.next(line)) {
      if (is_first) {
        const std::optional<Columns> columns = Columns::of(line);
        if (!columns)
          fail(ErrorCode::kCorrupt,
               fmt::format("line {} is \"{}\", must be x, y and z", lines.number(), printable(line)));
        columns_ = *columns;
        is_first = false;
        if (columns_.is_header) continue;
      }
      const Point point = point_of(line, lines.number());
      x.see(point.x, lines.number());
      y.see(point.y, lines.number());
      if (whole_) whole_ = is_whole(point.z);
      if (points_ == 0) first_x = point.x;
      if (points_ == 1) by_columns_ = std::abs(point.x - first_x) < kSame;
      ++points_;
    }
    if (points_ < 4) fail(ErrorCode::kCorrupt, fmt::format("has {} points, a grid has four at least", points_));
    x.settle();
    y.settle();
  }

  static bool is_whole(std::string_view z) {
    std::int32_t value = 0;
    if (!z.empty() && z.front() == '+') z.remove_prefix(1);
    const auto [end, error] = std::from_chars(z.data(), z.data() + z.size(), value);
    return error == std::errc{} && end == z.data() + z.size() && value != kNoWhole;
  }

  /// Goes through them again and puts each elevation in its cell of a file without a name.
  template <typename T>
  void scatter(const RawFile& text, const Axis& x, const Axis& y, T nothing) {
    const auto cells = static_cast<std::uint64_t>(info_.width) * static_cast<std::uint64_t>(info_.height);
    std::error_code error;
    const std::string folder = std::filesystem::temp_directory_path(error).string();
    if (error) fail(ErrorCode::kIo, "needs a folder for temporary files, and TMPDIR names none: " + error.message());
    File cells_file = File::scratch(folder, cells * sizeof(T));
    std::vector<T> run(std::min<std::uint64_t>(cells, std::uint64_t{1} << 17U), nothing);
    const auto write = [&](std::uint64_t cell, std::size_t count) {
      cells_file.write_at(cell * sizeof(T), std::as_bytes(std::span(run).first(count)));
    };
    for (std::uint64_t at = 0; at < cells; at += run.size()) {
      write(at, static_cast<std::size_t>(std::min<std::uint64_t>(run.size(), cells - at)));
    }
    Lines lines(text);
    std::string_view line;
    if (columns_.is_header) (void)lines.next(line);
    std::uint64_t begin = 0;  // of the run, which is written once a point lies elsewhere
    std::size_t count = 0;
    std::uint64_t there = 0;
    while (lines.next(line)) {
      const Point point = point_of(line, lines.number());
      double value = 0.0;
      if (!read_decimal(point.z, value)) {
        fail(ErrorCode::kCorrupt,
             fmt::format("line {} is \"{}\", must be x, y and z", lines.number(), printable(line)));
      }
      const auto column = static_cast<std::uint64_t>(x.cell(point.x));
      const auto row = static_cast<std::uint64_t>(y.cell(point.y));
      const std::uint64_t cell = by_columns_ ? column * static_cast<std::uint64_t>(info_.height) + row
                                             : row * static_cast<std::uint64_t>(info_.width) + column;
      if (cell >= cells || ++there > points_) fail(ErrorCode::kCorrupt, "has changed while it was read");
      if (count == run.size() || cell != begin + count) {
        write(begin, count);
        begin = cell;
        count = 0;
      }
      run[count++] = static_cast<T>(value);
    }
    write(begin, count);
    file_.emplace(fmt::format("/proc/self/fd/{}", cells_file.descriptor()));
  }

  Columns columns_;
  bool whole_ = true;
  bool by_columns_ = false;
  std::uint64_t points_ = 0;
};

/// Whether the lines that are all there are points of three numbers, or of more where a line names them. Of a file that
/// `is_named` so the first point tells, whatever else it has.
bool are_points(std::string_view text, bool is_named) {
  std::optional<Columns> columns;
  int points = 0;
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string_view::npos; at = end + 1) {
    const std::string_view line = text.substr(at, end - at);
    if (is_comment(line)) continue;
    if (!columns) {
      columns = Columns::of(line);
      if (!columns) return false;
      if (columns->is_header) continue;
    }
    const Fields fields(line);
    if (fields.count < 3 || (fields.count > 3 && !columns->is_header && !is_named)) return false;
    for (const std::size_t i : columns->at) {
      if (i >= fields.count || !is_number(fields.text[i])) return false;
    }
    if (++points >= (is_named ? 1 : 2)) return true;
  }
  return false;
}

}  // namespace

bool looks_like_xyz(std::span<const std::byte> head) {
  return are_points(text_of(head), false);
}

bool is_xyz(const std::string& path) {
  if (!lower_case(without_gzip(path)).ends_with(".xyz")) return false;
  std::string text(kLongestLine, '\0');
  text.resize(RawFile(path).read_some(0, std::as_writable_bytes(std::span(text))));
  return are_points(text, true);
}

std::unique_ptr<HeightSource> open_xyz(const std::string& path, const OpenOptions& options) {
  return std::make_unique<XyzSource>(path, options);
}

}  // namespace isohf
