#include "formats/readers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/files/bands.h"
#include "formats/files/file_source.h"
#include "formats/files/text.h"
#include "formats/files/text_tokens.h"
#include "formats/georeference/files_beside.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Numbers in records of fixed columns, as Fortran programs write them: blanks around them mean nothing.
/// The field without the blanks around it.
std::string_view trimmed(std::string_view field) {
  field.remove_prefix(std::min(field.find_first_not_of(' '), field.size()));
  return field.substr(0, field.find_last_not_of(' ') + 1);
}

/// A finite number, whose exponent is a D as often as an E; nullopt where the field holds none.
std::optional<double> fortran_number(std::string_view field) {
  std::string text(trimmed(field));
  for (char& c : text) c = c == 'D' || c == 'd' ? 'E' : c;
  double value = 0.0;
  if (text.empty() || !read_decimal(text, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// A whole number; nullopt where the field holds none.
std::optional<std::int64_t> whole_number(std::string_view field) {
  const std::string_view text = trimmed(field);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// The type A record, with which a USGS DEM begins (USGS, Standards for Digital Elevation Models, part 2, 1998): fields
/// of fixed columns, which the standard counts from 1.
class UsgsDemHeader {
 public:
  /// Of the ground coordinates, by their numbers in the record.
  enum class Unit { kRadian, kFoot, kMetre, kSecond };

  static constexpr std::int64_t kMostPosts = 999999;  ///< a field of six digits
  static constexpr std::int64_t kVoid = -32767;

  /// `path` is for messages. Throws Error{kCorrupt} for a record that is too short.
  UsgsDemHeader(std::string path, std::string text);

  /// Columns, sample type, scale, voids and vertical unit into info.
  /// Throws Error: kCorrupt; kUnsupported for grids that are turned or in radians.
  void read_grid(SourceInfo& info);
  /// The reference system into info, behind read_grid. Throws Error{kCorrupt}.
  void read_system(SourceInfo& info) const;

  // Of the ground coordinates, behind read_grid.
  [[nodiscard]] Unit unit() const { return unit_; }
  [[nodiscard]] double spacing_x() const { return spacing_x_; }
  [[nodiscard]] double spacing_y() const { return spacing_y_; }

 private:
  [[noreturn]] void refuse(const std::string& what) const;
  [[nodiscard]] std::string_view field(std::size_t first, std::size_t size) const;
  [[nodiscard]] std::int64_t whole(std::size_t first, std::size_t size, const char* name, std::int64_t lowest,
                                   std::int64_t highest) const;

  std::string path_;
  std::string text_;
  Unit unit_ = Unit::kMetre;
  double spacing_x_ = 1.0;
  double spacing_y_ = 1.0;
};

constexpr std::size_t kLeastBytes = 864;
constexpr std::size_t kRecordBytes = 1024;

UsgsDemHeader::UsgsDemHeader(std::string path, std::string text) : path_(std::move(path)), text_(std::move(text)) {
  if (text_.size() < kLeastBytes) refuse(fmt::format("has {} bytes, must have {}", text_.size(), kLeastBytes));
  text_.resize(kRecordBytes, ' ');
}

void UsgsDemHeader::refuse(const std::string& what) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: the type A record: {}", path_, what));
}

std::string_view UsgsDemHeader::field(std::size_t first, std::size_t size) const {
  return std::string_view(text_).substr(first - 1, size);  // the standard counts from 1
}

std::int64_t UsgsDemHeader::whole(std::size_t first, std::size_t size, const char* name, std::int64_t lowest,
                                  std::int64_t highest) const {
  const std::optional<std::int64_t> value = whole_number(field(first, size));
  if (!value || *value < lowest || *value > highest) {
    refuse(fmt::format("the {} at byte {} is \"{}\", must be a whole number from {} to {}", name, first - 1,
                       printable(trimmed(field(first, size))), lowest, highest));
  }
  return *value;
}

void UsgsDemHeader::read_grid(SourceInfo& info) {
  // The oldest say none; 4 is what SDTS2DEM writes for a regular one.
  if (!trimmed(field(151, 6)).empty()) {
    const std::int64_t pattern = whole(151, 6, "elevation pattern", 1, 4);
    if (pattern != 1 && pattern != 4) {
      throw Error(ErrorCode::kUnsupported, path_ + ": the elevation pattern is not regular (1 or 4), which is read");
    }
  }
  unit_ = static_cast<Unit>(whole(529, 6, "unit of the ground coordinates", 0, 3));
  if (unit_ == Unit::kRadian)
    throw Error(ErrorCode::kUnsupported,
                path_ + ": the ground coordinates are radians; feet, metres and seconds are read");
  if (const auto angle = fortran_number(field(787, 24)); angle && *angle != 0.0) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the grid is turned by {} radians; only grids along the axes are read", path_, *angle));
  }
  const std::array<const char*, 3> names = {"x", "y", "vertical"};
  std::array<double, 3> resolution = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = fortran_number(field(817 + 12 * i, 12));
    if (!value || !(*value > 0.0)) {
      refuse(fmt::format("the {} resolution at byte {} is not a positive number", names[i], 816 + 12 * i));
    }
    resolution[i] = *value;
  }
  spacing_x_ = resolution[0];
  spacing_y_ = resolution[1];
  info.z_scale = resolution[2];
  info.width = whole(859, 6, "number of profiles", 1, kMostPosts);
  const std::int64_t unit = whole(535, 6, "unit of the elevations", 1, 2);
  info.vertical_unit = unit == 1 ? "foot" : "metre";
  info.metres_per_vertical_unit = unit == 1 ? 0.3048 : 1.0;
  // A range that the header does not say is taken for one that fits.
  const double low = fortran_number(field(739, 24)).value_or(0.0) / info.z_scale;
  const double high = fortran_number(field(763, 24)).value_or(0.0) / info.z_scale;
  const bool small = low >= -32767.0 && high <= 32767.0;
  info.sample_type = small ? SampleType::kInt16 : SampleType::kInt32;
  info.void_values = {static_cast<double>(kVoid)};
}

void UsgsDemHeader::read_system(SourceInfo& info) const {
  struct Datum {
    const char* name;
    int geographic;
    int utm_north;
    int utm_south;
    double semi_major_axis_m;
    double inverse_flattening;
  };
  constexpr std::array<Datum, 4> kDatums = {{{"NAD27", 4267, 26700, 0, 6378206.4, 294.9786982},
                                             {"WGS 72", 4322, 32200, 32300, 6378135.0, 298.26},
                                             {"WGS 84", 4326, 32600, 32700, 6378137.0, 298.257223563},
                                             {"NAD83", 4269, 26900, 0, 6378137.0, 298.257222101}}};
  ReferenceSystem& system = info.georeference.system;
  system.body = "Earth";
  const std::int64_t kind = whole(157, 6, "ground reference system", -9999, 99);
  const auto datum = whole_number(field(891, 2));
  const Datum* known = datum && *datum >= 1 && *datum <= 4 ? &kDatums[static_cast<std::size_t>(*datum - 1)] : nullptr;
  if (known != nullptr) {
    system.semi_major_axis_m = known->semi_major_axis_m;
    system.inverse_flattening = known->inverse_flattening;
  } else {
    info.warnings.push_back(loss("the header names no horizontal datum that isohf knows (old files mean NAD27)"));
  }
  const std::string name = known != nullptr ? known->name : "unknown datum";
  system.name = name;
  if (kind == 0) {
    if (known != nullptr) system.epsg = known->geographic;
  } else if (kind == 1) {
    const std::int64_t zone = whole(163, 6, "UTM zone", -60, 60);
    system.name = fmt::format("{} / UTM zone {}{}", name, std::abs(zone), zone < 0 ? 'S' : 'N');
    const int base = known == nullptr ? 0 : zone < 0 ? known->utm_south : known->utm_north;
    if (base != 0 && zone != 0) system.epsg = base + static_cast<int>(std::abs(zone));
  } else {
    system.name =
        fmt::format("{} / {} zone {}", name, kind == 2 ? "State Plane" : "unknown projection", trimmed(field(163, 6)));
  }
  const std::int64_t vertical = whole_number(field(889, 2)).value_or(0);
  system.vertical_datum = vertical == 1 ? "mean sea level" : vertical == 2 ? "NGVD29" : vertical == 3 ? "NAVD88" : "";
}

constexpr std::size_t kProfileHeadBytes = 144;
constexpr std::int64_t kPostsInFirst = 146;  // record of a profile, behind its head
constexpr std::int64_t kPostsInNext = 170;
constexpr std::size_t kPostBytes = 6;
constexpr std::int64_t kMostPosts = UsgsDemHeader::kMostPosts;
constexpr std::int64_t kRowsAtOnce = 256;
/// Of a spacing; the coordinates have fifteen digits.
constexpr double kOffGrid = 0.01;

/// The record of a profile that holds a post.
std::int64_t record_of(std::int64_t post) {
  return post < kPostsInFirst ? 0 : 1 + (post - kPostsInFirst) / kPostsInNext;
}

std::size_t byte_of(std::int64_t post) {
  if (post < kPostsInFirst) return kProfileHeadBytes + static_cast<std::size_t>(post) * kPostBytes;
  return static_cast<std::size_t>((post - kPostsInFirst) % kPostsInNext) * kPostBytes;
}

/// An elevation in six characters; false where they are none. The hot path.
bool read_post(const char* field, std::int64_t& value) {
  std::size_t i = 0;
  while (i < kPostBytes && field[i] == ' ') ++i;
  const bool negative = i < kPostBytes && field[i] == '-';
  if (negative) ++i;
  if (i == kPostBytes) return false;
  value = 0;
  for (; i < kPostBytes; ++i) {
    const auto digit = static_cast<unsigned>(field[i] - '0');
    if (digit > 9) return false;
    value = value * 10 + digit;
  }
  if (negative) value = -value;
  return true;
}

struct Profile {
  std::uint64_t offset_bytes = 0;
  std::uint64_t end_bytes = 0;
  std::int64_t first = 0;  // row of its first post, counted from the South
  std::int64_t posts = 0;
  double x = 0.0;
  double y = 0.0;
};

class UsgsDemSource final : public FileSource {
 public:
  UsgsDemSource(const std::string& path, const OpenOptions& options) : FileSource(path, "USGS DEM", options) {
    (void)choose_band(info_, options, 1);
    find_record_ends();
    std::uint64_t at = 0;
    UsgsDemHeader header(path, record(at));
    header.read_grid(info_);
    read_profiles(lines_ ? at : first_profile());
    place_profiles(header);
    header.read_system(info_);
    info_.block_width = info_.width;
    info_.block_height = std::min(info_.height, kRowsAtOnce);
    const double own_scale = std::exchange(info_.z_scale, 1.0);  // which GDAL's samples have been multiplied by
    read_auxiliary_metadata(info_, 1);
    info_.z_scale *= own_scale;
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (info_.sample_type == SampleType::kInt16) {
      read_columns<std::int16_t>(window, samples);
    } else {
      read_columns<std::int32_t>(window, samples);
    }
  }

 private:
  [[noreturn]] void corrupt(const std::string& where, const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}: {}", info_.path, where, what));
  }

  /// Records are 1024 bytes, or lines of at most so many.
  void find_record_ends() {
    std::array<char, 2 * kRecordBytes + 8> start{};
    const std::size_t got = file_->read_some(0, std::as_writable_bytes(std::span(start)));
    const std::string_view text(start.data(), got);
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos || end > kRecordBytes + 1) return;
    lines_ = true;
  }

  /// Where the profiles begin: behind 1024 bytes, or fewer of the oldest header, of a Canadian one, and of one more.
  [[nodiscard]] std::uint64_t first_profile() const {
    for (const std::uint64_t at :
         {std::uint64_t{kRecordBytes}, std::uint64_t{kLeastBytes}, std::uint64_t{1021}, std::uint64_t{893}}) {
      std::string numbers(12, '\0');
      numbers.resize(file_->read_some(at, std::as_writable_bytes(std::span(numbers))));
      if (numbers == "     1     1") return at;  // row and column
    }
    return kRecordBytes;
  }

  /// The record at `at`, without its line end; moves `at` to the next. Empty at the end of the file.
  [[nodiscard]] std::string record(std::uint64_t& at) const {
    std::string text(kRecordBytes + (lines_ ? 2 : 0), '\0');
    text.resize(file_->read_some(at, std::as_writable_bytes(std::span(text))));
    if (!lines_) {
      at += text.size();
      return text;
    }
    const std::size_t end = text.find('\n');
    if (end == std::string::npos && text.size() > kRecordBytes) {
      corrupt(fmt::format("the line at byte {}", at), "is longer than a record, which has 1024 bytes");
    }
    at += end == std::string::npos ? text.size() : end + 1;
    text.resize(std::min(end, text.size()));
    if (!text.empty() && text.back() == '\r') text.pop_back();
    return text;
  }

  void read_profiles(std::uint64_t at) {
    // A profile has one record at least; a line has its end at least.
    const std::uint64_t room = file_->size_bytes() / (lines_ ? kProfileHeadBytes : kRecordBytes);
    if (static_cast<std::uint64_t>(info_.width) > room) {
      corrupt("the type A record",
              fmt::format("says {} profiles, for which {} bytes have no room", info_.width, file_->size_bytes()));
    }
    profiles_.reserve(static_cast<std::size_t>(info_.width));
    std::optional<double> datum;
    for (std::int64_t column = 0; column < info_.width; ++column) {
      Profile profile;
      profile.offset_bytes = at;
      const std::string where = fmt::format("profile {} at byte {}", column + 1, at);
      const std::string head = record(at);
      if (head.size() < kProfileHeadBytes) corrupt(where, "the file ends early");
      const auto text = [&](std::size_t first, std::size_t size) { return std::string_view(head).substr(first, size); };
      const auto row_number = whole_number(text(0, 6));
      const auto number = whole_number(text(6, 6));
      const auto posts = whole_number(text(12, 6));
      const auto across = whole_number(text(18, 6));
      if (row_number != 1 || number != column + 1)
        corrupt(where, "does not begin with its numbers, row 1 and column " + std::to_string(column + 1));
      if (!posts || *posts < 1 || *posts > kMostPosts || across != 1)
        corrupt(where, "does not say how many elevations it has, in one column");
      const auto x = fortran_number(text(24, 24));
      const auto y = fortran_number(text(48, 24));
      const auto z = fortran_number(text(72, 24));
      if (!x || !y || !z) corrupt(where, "does not say the place and datum of its first elevation");
      if (datum && *datum != *z) {
        throw Error(ErrorCode::kUnsupported,
                    fmt::format("{}: {}: its datum is {}, of those before it {}; they must be the same", info_.path,
                                where, *z, *datum));
      }
      datum = z;
      profile.x = *x;
      profile.y = *y;
      profile.posts = *posts;
      if (lines_) {
        for (std::int64_t i = record_of(*posts - 1); i > 0; --i) (void)record(at);
      } else {
        at = profile.offset_bytes + kRecordBytes * static_cast<std::uint64_t>(record_of(*posts - 1) + 1);
      }
      profile.end_bytes = at;
      profiles_.push_back(profile);
    }
    info_.z_offset = datum.value_or(0.0);
    // The last record may lack its blanks.
    const Profile& last = profiles_.back();
    const std::uint64_t least = last.end_bytes - kRecordBytes + byte_of(last.posts - 1) + kPostBytes;
    if (!lines_ && file_->size_bytes() < least) {
      corrupt(fmt::format("profile {}", info_.width),
              fmt::format("the file ends early: it has {} bytes, must have {}", file_->size_bytes(), least));
    }
  }

  void place_profiles(const UsgsDemHeader& header) {
    const double dx = header.spacing_x();
    const double dy = header.spacing_y();
    double south = profiles_.front().y;
    for (const Profile& profile : profiles_) south = std::min(south, profile.y);
    double rows = 0.0;
    for (std::size_t i = 0; i < profiles_.size(); ++i) {
      Profile& profile = profiles_[i];
      const double x = (profile.x - profiles_.front().x) / dx;
      const double y = (profile.y - south) / dy;
      if (!(std::abs(x - static_cast<double>(i)) < kOffGrid) || !(std::abs(y - std::nearbyint(y)) < kOffGrid) ||
          !(y < static_cast<double>(kMostPosts))) {
        throw Error(
            ErrorCode::kUnsupported,
            fmt::format("{}: profile {} begins at ({}, {}), which is no post of the grid of {} x {} from ({}, {})",
                        info_.path, i + 1, profile.x, profile.y, dx, dy, profiles_.front().x, south));
      }
      profile.first = static_cast<std::int64_t>(std::nearbyint(y));
      rows = std::max(rows, static_cast<double>(profile.first + profile.posts));
    }
    info_.height = static_cast<std::int64_t>(rows);
    Georeference& place = info_.georeference;
    const bool degrees = header.unit() == UsgsDemHeader::Unit::kSecond;
    const double unit = degrees ? 3600.0 : 1.0;
    place.registration = Registration::kPoint;
    place.unit = degrees ? HorizontalUnit::kDegree : HorizontalUnit::kMetre;
    if (header.unit() == UsgsDemHeader::Unit::kFoot) place.metres_per_unit = 0.3048;
    place.spacing_x = dx / unit;
    place.spacing_y = dy / unit;
    place.has_origin = true;
    place.origin_x = profiles_.front().x / unit;
    place.origin_y = (south + (rows - 1.0) * dy) / unit;
  }

  template <typename Sample>
  void read_columns(const Window& window, std::span<std::byte> samples) {
    const std::int64_t south = info_.height - window.row - window.rows;  // of the window, from the grid's
    for (std::int64_t c = 0; c < window.columns; ++c) {
      const std::int64_t column = window.column + c;
      const Profile& profile = profiles_[static_cast<std::size_t>(column)];
      const std::int64_t begin = std::clamp<std::int64_t>(south - profile.first, 0, profile.posts);
      const std::int64_t end = std::clamp<std::int64_t>(south + window.rows - profile.first, begin, profile.posts);
      if (begin < end) load(profile, begin, end);
      // From South to North; rows run from North to South.
      std::byte* out =
          samples.data() + static_cast<std::size_t>(c + (window.rows - 1) * window.columns) * sizeof(Sample);
      const auto up = static_cast<std::ptrdiff_t>(static_cast<std::size_t>(window.columns) * sizeof(Sample));
      for (std::int64_t i = 0; i < window.rows; ++i, out -= up) {
        const std::int64_t post = south + i - profile.first;
        auto value = static_cast<std::int64_t>(info_.void_values.front());  // where the profile has no post
        if (post >= begin && post < end) value = post_value(column, profile, post);
        const auto sample = static_cast<Sample>(value);
        if (sample != value) refuse_range(column, post, value);
        std::memcpy(out, &sample, sizeof(sample));
      }
    }
  }

  [[noreturn]] void refuse_range(std::int64_t column, std::int64_t post, std::int64_t value) const {
    corrupt(fmt::format("profile {}", column + 1),
            fmt::format("elevation {} is {}, outside of the range that the type A record says", post + 1, value));
  }

  [[nodiscard]] std::int64_t post_value(std::int64_t column, const Profile& profile, std::int64_t post) const {
    const std::string_view text = records_[static_cast<std::size_t>(record_of(post) - first_record_)];
    const std::size_t at = byte_of(post);
    std::int64_t value = 0;
    if (at + kPostBytes > text.size() || !read_post(text.data() + at, value)) {
      corrupt(fmt::format("profile {} at byte {}", column + 1, profile.offset_bytes),
              fmt::format("elevation {} of {} is not a whole number of six characters", post + 1, profile.posts));
    }
    return value;
  }

  /// The records that hold the posts `begin` to `end - 1`.
  void load(const Profile& profile, std::int64_t begin, std::int64_t end) {
    first_record_ = lines_ ? 0 : record_of(begin);
    const std::uint64_t at = profile.offset_bytes + static_cast<std::uint64_t>(first_record_) * kRecordBytes;
    const std::uint64_t most = lines_
                                   ? profile.end_bytes - at
                                   : static_cast<std::uint64_t>(record_of(end - 1) - first_record_ + 1) * kRecordBytes;
    text_.resize(static_cast<std::size_t>(most));
    text_.resize(file_->read_some(at, std::as_writable_bytes(std::span(text_))));
    records_.clear();
    const std::string_view all = text_;
    for (std::size_t i = 0; i < all.size();) {
      const std::size_t line_end =
          lines_ ? std::min(all.find('\n', i), all.size()) : std::min(i + kRecordBytes, all.size());
      records_.push_back(all.substr(i, line_end - i));
      i = line_end + (lines_ ? 1 : 0);
    }
    records_.resize(std::max(records_.size(), static_cast<std::size_t>(record_of(end - 1) - first_record_ + 1)));
  }

  bool lines_ = false;
  std::vector<Profile> profiles_;
  std::string text_;  // of the records below
  std::vector<std::string_view> records_;
  std::int64_t first_record_ = 0;
};

}  // namespace

bool looks_like_usgs_dem(std::span<const std::byte> head) {
  const std::string_view text = text_of(head);
  if (text.size() < 168) return false;
  const auto code = [&](std::size_t at, std::int64_t low, std::int64_t high) {
    const auto value = whole_number(text.substr(at, 6));
    return value && *value >= low && *value <= high;
  };
  const auto is_text = [](char c) { return c >= ' ' && c <= '~'; };
  return std::all_of(text.begin(), text.begin() + 168, is_text) && code(144, 0, 9) &&
         (code(150, 1, 4) || text.substr(150, 6) == "      ") && code(156, -9999, 99) && code(162, -9999, 9999);
}

std::unique_ptr<HeightSource> open_usgs_dem(const std::string& path, const OpenOptions& options) {
  return std::make_unique<UsgsDemSource>(path, options);
}

}  // namespace isohf
