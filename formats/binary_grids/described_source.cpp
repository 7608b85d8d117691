/// Plain samples that something else describes: ENVI's header, SAGA's, and the header of netCDF in its classic formats.
/// Each is read into one Description; what reads the samples is the same for all.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "formats/binary_grids/plain_samples.h"
#include "formats/files/text.h"
#include "formats/files/text_tokens.h"
#include "formats/georeference/files_beside.h"
#include "formats/georeference/units.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr double kMostSide = 2147483647.0;
constexpr std::uint64_t kLongestHeader = std::uint64_t{1} << 20U;

/// "key = value" by its lower case key; a value in braces goes on over lines.
using Words = std::map<std::string, std::string, std::less<>>;

Words words_of(const std::string& path) {
  const RawFile file(path);
  if (file.size_bytes() > kLongestHeader) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: is longer than {} bytes, which no header is", path, kLongestHeader));
  }
  std::string text(static_cast<std::size_t>(file.size_bytes()), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  Words words;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t equals = text.find('=', at);
    if (equals < end) {
      const std::size_t open = text.find_first_not_of(" \t", equals + 1);
      if (open < text.size() && text[open] == '{') end = std::min(text.find('}', open), text.size());
      words.emplace(
          lower_case(trimmed(text.substr(at, equals - at))),
          trimmed(text.substr(equals + 1, end - equals - 1 + (end < text.size() && text[end] == '}' ? 1 : 0))));
    }
    at = end + 1;
  }
  return words;
}

/// A reader's common part: numbers that must be some, and a file that must be long enough.
class DescribedSource : public PlainSource {
 public:
  /// Rows are turned where the first one in the file is the southernmost.
  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = from_south_ ? turned(window, info_.height) : window;
    read_samples(stored, samples);
    if (from_south_) turn_rows(samples, static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type));
  }

 protected:
  DescribedSource(const std::string& data, const char* format, std::string header, const OpenOptions& options)
      : PlainSource(data, format, options), header_(std::move(header)) {}

  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const { throw Error(code, header_ + ": " + what); }

  double number(const std::string& text, const std::string& what) const {
    double value = 0.0;
    if (!read_decimal(text, value))
      refuse(ErrorCode::kCorrupt, fmt::format("{} is \"{}\", must be a number", what, printable(text)));
    return value;
  }
  double number(const Words& words, const char* key, std::optional<double> otherwise = {}) const {
    const auto found = words.find(key);
    if (found != words.end()) return number(found->second, key);
    if (!otherwise) refuse(ErrorCode::kCorrupt, fmt::format("has no \"{}\"", key));
    return *otherwise;
  }
  std::int64_t count(double value, const std::string& what, double least = 1.0) const {
    if (!(value >= least && value <= kMostSide * 65536.0) || value != std::floor(value)) {
      refuse(ErrorCode::kCorrupt, fmt::format("{} is {}, must be a whole number from {} on", what, value, least));
    }
    return static_cast<std::int64_t>(value);
  }
  void set_size(double width, double height) {
    if (!(std::max(width, height) <= kMostSide))
      refuse(ErrorCode::kCorrupt, "gives more than 2147483647 samples a side");
    info_.width = count(width, "the number of columns");
    info_.height = count(height, "the number of rows");
  }

  /// Samples lie stride_ bytes apart, rows layout_.row_bytes; the file must have all of them.
  void require_length() {
    if (stride_ == 0) stride_ = size_bytes(info_.sample_type);
    const auto width = static_cast<double>(info_.width);
    if (layout_.row_bytes == 0) layout_.row_bytes = static_cast<std::uint64_t>(info_.width) * stride_;
    const double wanted = static_cast<double>(layout_.offset_bytes) +
                          static_cast<double>(info_.height - 1) * static_cast<double>(layout_.row_bytes) +
                          (width - 1.0) * static_cast<double>(stride_) +
                          static_cast<double>(size_bytes(info_.sample_type));
    if (wanted <= static_cast<double>(file_->size_bytes())) return;
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the file has {} bytes, {} x {} samples as {} says end at {:.0f}", info_.path,
                            file_->size_bytes(), info_.width, info_.height, header_, wanted));
  }

  void set_void(double value) {
    if (const auto stored = void_value_as_stored(info_.sample_type, value)) info_.void_values.push_back(*stored);
  }

  void finish(const OpenOptions& options) {
    require_length();
    bound_undeclared_voids(info_);
    if (!has_reference_system(info_.georeference)) read_prj_beside(info_);
    info_.block_width = info_.width;
    apply_open_options(info_, options);
  }

  std::string header_;        ///< for messages
  std::uint64_t stride_ = 0;  ///< between samples of a row; 0: they lie together
  bool from_south_ = false;

 private:
  void read_samples(const Window& window, std::span<std::byte> samples) {
    const std::size_t size = size_bytes(info_.sample_type);
    if (stride_ == size) return read_plain_samples(*file_, info_, layout_, window, samples);
    row_.resize(static_cast<std::size_t>(window.columns - 1) * stride_ + size);
    for (std::int64_t row = 0; row < window.rows; ++row) {
      file_->read(layout_.offset_bytes + static_cast<std::uint64_t>(window.row + row) * layout_.row_bytes +
                      static_cast<std::uint64_t>(window.column) * stride_,
                  row_);
      std::byte* const out = samples.data() + static_cast<std::size_t>(row * window.columns) * size;
      for (std::size_t column = 0; column < static_cast<std::size_t>(window.columns); ++column) {
        std::memcpy(out + column * size, row_.data() + column * stride_, size);
      }
    }
    if (layout_.big_endian != (std::endian::native == std::endian::big)) swap_byte_order(samples, size);
  }

  std::vector<std::byte> row_;
};

std::vector<std::string> list_of(std::string_view text) {
  if (!text.empty() && text.front() == '{') text.remove_prefix(1);
  if (!text.empty() && text.back() == '}') text.remove_suffix(1);
  std::vector<std::string> list;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    list.push_back(trimmed(text.substr(at, comma - at)));
    at = comma + 1;
  }
  return list;
}

class EnviSource final : public DescribedSource {
 public:
  EnviSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "ENVI", header, options) {
    const Words words = words_of(header);
    set_size(number(words, "samples"), number(words, "lines"));
    const std::int64_t bands = count(number(words, "bands", 1.0), "bands");
    const std::int64_t band = choose_band(info_, options, bands);
    read_type(words);
    if (number(words, "file compression", 0.0) != 0.0) refuse(ErrorCode::kUnsupported, "its samples are compressed");
    const std::uint64_t size = size_bytes(info_.sample_type);
    const auto width = static_cast<std::uint64_t>(info_.width);
    const auto height = static_cast<std::uint64_t>(info_.height);
    const auto other = static_cast<std::uint64_t>(band);
    const auto all = static_cast<std::uint64_t>(bands);
    if (all > (std::uint64_t{1} << 60U) / (width * height * size))
      refuse(ErrorCode::kCorrupt, "has more samples than any file");
    layout_.offset_bytes = static_cast<std::uint64_t>(count(number(words, "header offset", 0.0), "header offset", 0.0));
    const auto found = words.find("interleave");
    const std::string interleave = found == words.end() ? "bsq" : lower_case(found->second);
    if (interleave == "bsq") {
      layout_.offset_bytes += other * width * height * size;
    } else if (interleave == "bil") {
      layout_.row_bytes = all * width * size;
      layout_.offset_bytes += other * width * size;
    } else if (interleave == "bip") {
      stride_ = all * size;
      layout_.offset_bytes += other * size;
    } else {
      refuse(ErrorCode::kCorrupt, fmt::format("interleave is \"{}\", must be bsq, bil or bip", printable(interleave)));
    }
    read_place(words);
    if (const auto value = words.find("data ignore value"); value != words.end())
      set_void(number(value->second, "data ignore value"));
    finish(options);
  }

 private:
  void read_type(const Words& words) {
    static constexpr std::array<std::pair<int, SampleType>, 7> kTypes = {{{1, SampleType::kUint8},
                                                                          {2, SampleType::kInt16},
                                                                          {3, SampleType::kInt32},
                                                                          {4, SampleType::kFloat32},
                                                                          {5, SampleType::kFloat64},
                                                                          {12, SampleType::kUint16},
                                                                          {13, SampleType::kUint32}}};
    const double code = number(words, "data type");
    const auto* const found = std::ranges::find(kTypes, code, &std::pair<int, SampleType>::first);
    if (found == kTypes.end()) {
      refuse(ErrorCode::kUnsupported, fmt::format("data type is {}; isohf reads 1, 2, 3, 4, 5, 12 and 13", code));
    }
    info_.sample_type = found->second;
    layout_.big_endian = number(words, "byte order", 0.0) != 0.0;
  }

  /// "map info = {UTM, 1, 1, 500000, 4000000, 30, 30, 33, North, WGS-84}": a pixel's corner, counted from 1, its place,
  /// the spacing; the system is in "coordinate system string".
  void read_place(const Words& words) {
    Georeference& place = info_.georeference;
    place.registration = Registration::kArea;
    const auto map = words.find("map info");
    if (map != words.end()) {
      const std::vector<std::string> parts = list_of(map->second);
      if (parts.size() < 7) refuse(ErrorCode::kCorrupt, "map info has fewer than seven parts");
      const auto part = [&](std::size_t i) { return number(parts[i], "map info"); };
      for (const std::string& each : parts) {
        if (lower_case(each).starts_with("rotation") &&
            number(trimmed(each.substr(each.find('=') + 1)), "rotation") != 0.0) {
          refuse(ErrorCode::kUnsupported, "the map is rotated (gdalwarp turns it)");
        }
      }
      place.spacing_x = part(5);
      place.spacing_y = part(6);
      if (!(place.spacing_x > 0.0 && place.spacing_y > 0.0))
        refuse(ErrorCode::kCorrupt, "map info has no positive spacing");
      place.origin_x = part(3) + (1.5 - part(1)) * place.spacing_x;
      place.origin_y = part(4) - (1.5 - part(2)) * place.spacing_y;
      place.has_origin = true;
      read_named_system(parts);
    }
    const auto system = words.find("coordinate system string");
    if (system == words.end()) return;
    std::string wkt = system->second;
    if (wkt.starts_with("{")) wkt = trimmed(wkt.substr(1, wkt.size() - (wkt.ends_with("}") ? 2 : 1)));
    if (!wkt.empty()) read_system_text(wkt, header_, info_);
  }

  void read_named_system(const std::vector<std::string>& parts) {
    Georeference& place = info_.georeference;
    const auto names_wgs84 = [](const std::string& part) { return part == "WGS-84" || part == "WGS84"; };
    const bool is_wgs84 = std::ranges::any_of(parts, names_wgs84);
    if (lower_case(parts[0]).starts_with("geographic")) {
      place.unit = HorizontalUnit::kDegree;
      if (is_wgs84) place.system = wgs84_system();
    } else if (lower_case(parts[0]) == "utm" && parts.size() > 8) {
      place.unit = HorizontalUnit::kMetre;
      const double zone = number(parts[7], "map info");
      if (is_wgs84 && zone >= 1.0 && zone <= 60.0) {
        place.system = wgs84_system();
        place.system.epsg = (lower_case(parts[8]) == "south" ? 32700 : 32600) + static_cast<int>(zone);
        place.system.name = fmt::format("WGS 84 / UTM zone {}{}", zone, lower_case(parts[8]) == "south" ? 'S' : 'N');
      }
    }
  }
};

class SagaSource final : public DescribedSource {
 public:
  SagaSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "SAGA grid", header, options) {
    (void)choose_band(info_, options, 1);
    const Words words = words_of(header);
    set_size(number(words, "cellcount_x"), number(words, "cellcount_y"));
    static const std::map<std::string, SampleType, std::less<>> kTypes = {{"byte_unsigned", SampleType::kUint8},
                                                                          {"byte", SampleType::kInt8},
                                                                          {"shortint_unsigned", SampleType::kUint16},
                                                                          {"shortint", SampleType::kInt16},
                                                                          {"integer_unsigned", SampleType::kUint32},
                                                                          {"integer", SampleType::kInt32},
                                                                          {"float", SampleType::kFloat32},
                                                                          {"double", SampleType::kFloat64}};
    const auto text = [&](const char* key) {
      const auto found = words.find(key);
      return found == words.end() ? std::string() : lower_case(found->second);
    };
    const auto type = kTypes.find(text("dataformat"));
    if (type == kTypes.end())
      refuse(ErrorCode::kUnsupported,
             fmt::format("DATAFORMAT is \"{}\", which isohf does not read", printable(text("dataformat"))));
    info_.sample_type = type->second;
    layout_.offset_bytes =
        static_cast<std::uint64_t>(count(number(words, "datafile_offset", 0.0), "DATAFILE_OFFSET", 0.0));
    layout_.big_endian = text("byteorder_big") == "true";
    from_south_ = text("toptobottom") != "true";
    info_.z_scale = number(words, "z_factor", 1.0);
    if (info_.z_scale == 0.0) refuse(ErrorCode::kCorrupt, "Z_FACTOR is 0");
    Georeference& place = info_.georeference;
    place.registration = Registration::kArea;
    place.spacing_x = place.spacing_y = number(words, "cellsize");
    if (!(place.spacing_x > 0.0)) refuse(ErrorCode::kCorrupt, "CELLSIZE is not positive");
    place.has_origin = true;
    place.origin_x = number(words, "position_xmin");
    place.origin_y = number(words, "position_ymin") + static_cast<double>(info_.height - 1) * place.spacing_y;
    if (const auto value = text("nodata_value"); !value.empty())
      set_void(number(value.substr(0, value.find(';')), "NODATA_VALUE"));
    finish(options);
  }
};

/// The header of netCDF's classic formats (CDF-1, 2 and 5; "The NetCDF Classic Format Specification"), big-endian.
class ClassicHeader {
 public:
  using Value = std::variant<std::string, std::vector<double>>;
  using Attributes = std::map<std::string, Value, std::less<>>;
  struct Variable {
    std::string name;
    std::vector<std::size_t> dimensions;
    Attributes attributes;
    int type = 0;
    std::uint64_t begin = 0;
  };
  struct Dimension {
    std::string name;
    std::uint64_t size = 0;  ///< 0: the one that grows
  };

  explicit ClassicHeader(const RawFile& file) : file_(file) {
    std::array<std::byte, 4> magic{};
    read(magic);
    version_ = static_cast<int>(magic[3]);
    if (version_ != 1 && version_ != 2 && version_ != 5) corrupt("is of an unknown version of netCDF");
    (void)size();  // of records
    list(10, [&] { dimensions.push_back({name(), size()}); });
    attributes = read_attributes();
    list(11, [&] {
      Variable variable;
      variable.name = name();
      const std::uint64_t count = items();
      for (std::uint64_t i = 0; i < count; ++i) {
        variable.dimensions.push_back(static_cast<std::size_t>(size()));
        if (variable.dimensions.back() >= dimensions.size()) corrupt("has a variable of a dimension that is not there");
      }
      variable.attributes = read_attributes();
      variable.type = static_cast<int>(word());
      (void)size();
      variable.begin = version_ == 1 ? word() : long_word();
      variables.push_back(std::move(variable));
    });
  }

  [[nodiscard]] const Variable* variable(std::string_view name) const {
    const auto found = std::ranges::find(variables, name, &Variable::name);
    return found == variables.end() ? nullptr : &*found;
  }
  [[nodiscard]] std::uint64_t size_of(const Variable& variable, std::size_t axis) const {
    return dimensions[variable.dimensions[axis]].size;
  }
  /// Its bytes for one sample, and how they are read; nullopt for characters and integers of 64 bits.
  [[nodiscard]] static std::optional<SampleType> sample_type(int type) {
    static constexpr std::array<std::optional<SampleType>, 10> kTypes = {
        std::nullopt,         SampleType::kInt8,    std::nullopt,       SampleType::kInt16,  SampleType::kInt32,
        SampleType::kFloat32, SampleType::kFloat64, SampleType::kUint8, SampleType::kUint16, SampleType::kUint32};
    return type >= 0 && type < static_cast<int>(kTypes.size()) ? kTypes[static_cast<std::size_t>(type)] : std::nullopt;
  }
  /// `count` numbers of a variable from the `first` on.
  [[nodiscard]] std::vector<double> numbers(const Variable& variable, std::uint64_t first, std::uint64_t count) {
    at_ = variable.begin + first * bytes_of(variable.type);
    return values(variable.type, count);
  }

  std::vector<Dimension> dimensions;
  Attributes attributes;
  std::vector<Variable> variables;

 private:
  [[noreturn]] void corrupt(const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} (byte {})", file_.path(), what, at_));
  }
  void read(std::span<std::byte> bytes) {
    if (at_ > file_.size_bytes() || bytes.size() > file_.size_bytes() - at_) corrupt("its header ends early");
    file_.read(at_, bytes);
    at_ += bytes.size();
  }
  std::uint64_t integer(std::size_t bytes) {
    std::array<std::byte, 8> stored{};
    read(std::span(stored).first(bytes));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | static_cast<std::uint64_t>(stored[i]);
    return value;
  }
  std::uint64_t word() { return integer(4); }
  std::uint64_t long_word() { return integer(8); }
  std::uint64_t size() { return version_ == 5 ? long_word() : word(); }
  /// How many items follow, each of four bytes at least. No raster's header has so many: reading them would take minutes.
  std::uint64_t items() {
    static constexpr std::uint64_t kMost = 65536;
    const std::uint64_t count = size();
    if (count > std::min(kMost, file_.size_bytes() / 4)) corrupt(fmt::format("says that {} items follow", count));
    return count;
  }
  std::string name() {
    const std::uint64_t length = items();
    std::string text(static_cast<std::size_t>(length), '\0');
    read(std::as_writable_bytes(std::span(text)));
    at_ += (4 - length % 4) % 4;
    return text;
  }
  template <typename Item>
  void list(std::uint64_t tag, Item item) {
    const std::uint64_t found = word();
    const std::uint64_t count = items();
    if (found == 0 && count == 0) return;
    if (found != tag) corrupt(fmt::format("has a list of the kind {}, must be {}", found, tag));
    for (std::uint64_t i = 0; i < count; ++i) item();
  }
  [[nodiscard]] static std::uint64_t bytes_of(int type) {
    static constexpr std::array<std::uint64_t, 12> kBytes = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    return type >= 1 && type < static_cast<int>(kBytes.size()) ? kBytes[static_cast<std::size_t>(type)] : 0;
  }
  std::vector<double> values(int type, std::uint64_t count) {
    std::vector<double> numbers;
    const auto size = static_cast<std::size_t>(bytes_of(type));
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t bits = integer(size);
      const auto as_signed = static_cast<std::int64_t>(bits << (64 - 8 * size)) >> (64 - 8 * size);
      if (type == 5) {
        numbers.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
      } else if (type == 6) {
        numbers.push_back(std::bit_cast<double>(bits));
      } else {
        numbers.push_back(type >= 7 && type != 10 ? static_cast<double>(bits) : static_cast<double>(as_signed));
      }
    }
    return numbers;
  }
  Attributes read_attributes() {
    Attributes found;
    list(12, [&] {
      const std::string key = name();
      const auto type = static_cast<int>(word());
      if (bytes_of(type) == 0) corrupt(fmt::format("has values of the type {}", type));
      const std::uint64_t count = size();
      const std::uint64_t bytes = count * bytes_of(type);
      static constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20U;
      if (count > kMostBytes || bytes > std::min(kMostBytes, file_.size_bytes()))
        corrupt(fmt::format("has an attribute of {} values", count));
      const std::uint64_t end = at_ + bytes + (4 - bytes % 4) % 4;
      if (type == 2) {
        std::string text(static_cast<std::size_t>(count), '\0');
        read(std::as_writable_bytes(std::span(text)));
        found.emplace(key, trimmed(text));
      } else {
        found.emplace(key, values(type, count));
      }
      at_ = end;
    });
    return found;
  }

  const RawFile& file_;
  std::uint64_t at_ = 0;
  int version_ = 1;
};

class NetcdfSource final : public DescribedSource {
 public:
  using Variable = ClassicHeader::Variable;

  NetcdfSource(const std::string& path, const OpenOptions& options) : DescribedSource(path, "netCDF", path, options) {
    ClassicHeader header(*file_);
    layout_.big_endian = true;
    if (const Variable* z = header.variable("z");
        z != nullptr && header.variable("x_range") && header.variable("dimension")) {
      read_gmt(header, *z);
    } else {
      const Variable& variable = choose(header, options);
      set_type(variable);
      const std::size_t rows = variable.dimensions.size() - 2;
      set_size(static_cast<double>(header.size_of(variable, rows)), 0.0, header.size_of(variable, rows + 1));
      layout_.offset_bytes = variable.begin;
      read_axes(header, variable);
      read_attributes(header, variable);
    }
    finish(options);
  }

 private:
  void set_size(double rows, double, std::uint64_t columns) {
    DescribedSource::set_size(static_cast<double>(columns), rows);
  }

  static std::string text_in(const ClassicHeader::Attributes& attributes, std::string_view key) {
    const auto found = attributes.find(key);
    const auto* const text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
    return text == nullptr ? std::string() : *text;
  }
  static std::optional<double> number_in(const ClassicHeader::Attributes& attributes, std::string_view key) {
    const auto found = attributes.find(key);
    const auto* const list = found == attributes.end() ? nullptr : std::get_if<std::vector<double>>(&found->second);
    return list == nullptr || list->empty() ? std::nullopt : std::optional(list->front());
  }

  void set_type(const Variable& variable) {
    const auto type = ClassicHeader::sample_type(variable.type);
    if (!type)
      refuse(ErrorCode::kUnsupported,
             fmt::format("{} has samples of the type {}", printable(variable.name), variable.type));
    info_.sample_type = *type;
  }

  /// Whether the last two dimensions make a raster, and those before are of one.
  static bool is_raster(const ClassicHeader& header, const Variable& variable) {
    const std::size_t count = variable.dimensions.size();
    if (count < 2 || !ClassicHeader::sample_type(variable.type)) return false;
    for (std::size_t axis = 0; axis < count; ++axis) {
      const std::uint64_t size = header.size_of(variable, axis);
      if (axis + 2 < count ? size != 1 : size < 2) return false;
    }
    return true;
  }

  const Variable& choose(const ClassicHeader& header, const OpenOptions& options) {
    const Variable* chosen = nullptr;
    std::string names;
    int rasters = 0;
    for (const Variable& variable : header.variables) {
      if (!is_raster(header, variable)) continue;
      // Bounds of cells and places of a curved grid are no elevations, unless they are asked for.
      const std::string unit = text_in(variable.attributes, "units");  // degrees_north, degree_E
      const bool is_place = variable.name.ends_with("_bnds") || variable.name.ends_with("_bounds") ||
                            unit.starts_with("degrees_") || unit.starts_with("degree_");
      if (is_place && variable.name != options.channel) continue;
      names += (names.empty() ? "" : ", ") + printable(variable.name);
      ++rasters;
      if (options.channel.empty() ? chosen == nullptr : variable.name == options.channel) chosen = &variable;
    }
    if (rasters == 0) {
      refuse(ErrorCode::kUnsupported, "has no variable of two dimensions that do not grow (nccopy -u makes them so)");
    }
    if (chosen == nullptr) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: there is no channel \"{}\"; there are {}", header_, options.channel, names));
    }
    if (rasters > 1) {
      info_.channel = chosen->name;
      if (options.channel.empty())
        info_.warnings.push_back(
            fmt::format("there are {} variables ({}); {} is read", rasters, names, printable(chosen->name)));
    }
    return *chosen;
  }

  /// The first coordinate and the step; nullopt where the steps differ by more than a hundredth.
  std::optional<std::pair<double, double>> axis(ClassicHeader& header, const Variable& of, std::uint64_t count) {
    if (of.dimensions.size() != 1 || !ClassicHeader::sample_type(of.type)) return std::nullopt;
    const double first = header.numbers(of, 0, 1)[0];
    const double last = header.numbers(of, count - 1, 1)[0];
    const double step = (last - first) / static_cast<double>(count - 1);
    for (const std::uint64_t i : {std::uint64_t{1}, count / 3, count / 2}) {
      const double there = header.numbers(of, i, 1)[0];
      if (!(std::abs(there - first - static_cast<double>(i) * step) <= 0.01 * std::abs(step))) return std::nullopt;
    }
    if (step == 0.0) return std::nullopt;
    return std::pair(first, step);
  }

  void read_axes(ClassicHeader& header, const Variable& variable) {
    const std::size_t count = variable.dimensions.size();
    const auto of_dimension = [&](std::size_t i) {
      return header.variable(header.dimensions[variable.dimensions[i]].name);
    };
    const Variable* const rows = of_dimension(count - 2);
    const Variable* const columns = of_dimension(count - 1);
    if (rows == nullptr || columns == nullptr) return;
    const auto y = axis(header, *rows, static_cast<std::uint64_t>(info_.height));
    const auto x = axis(header, *columns, static_cast<std::uint64_t>(info_.width));
    if (!x || !y) {
      info_.warnings.push_back(loss("its coordinates are not evenly spaced: where it lies is left out"));
      return;
    }
    if (x->second < 0.0) refuse(ErrorCode::kUnsupported, "its columns run from East to West (gdalwarp turns it)");
    const auto offset = number_in(header.attributes, "node_offset");  // GMT: 1 for pixels
    place(*x, *y, offset == 0.0 ? Registration::kPoint : Registration::kArea);
    const std::string unit = text_in(columns->attributes, "units");
    const std::string mapping = text_in(variable.attributes, "grid_mapping");
    const Variable* const system = mapping.empty() ? nullptr : header.variable(mapping);
    std::string wkt = system == nullptr ? "" : text_in(system->attributes, "crs_wkt");
    if (wkt.empty() && system != nullptr) wkt = text_in(system->attributes, "spatial_ref");
    if (!wkt.empty()) {
      read_system_text(wkt, header_, info_);
    } else if (unit.starts_with("degree")) {
      info_.georeference.unit = HorizontalUnit::kDegree;
      info_.georeference.system = wgs84_system();  // what CF means where nothing else stands
    } else if (const auto length = linear_unit(unit)) {
      info_.georeference.unit = HorizontalUnit::kMetre;
      info_.georeference.metres_per_unit = length->metres;
    }
  }

  void place(std::pair<double, double> x, std::pair<double, double> y, Registration registration) {
    Georeference& geo = info_.georeference;
    geo.registration = registration;
    geo.spacing_x = x.second;
    geo.spacing_y = std::abs(y.second);
    geo.has_origin = true;
    geo.origin_x = x.first;
    from_south_ = y.second > 0.0;
    geo.origin_y = from_south_ ? y.first + static_cast<double>(info_.height - 1) * y.second : y.first;
  }

  void read_attributes(const ClassicHeader& header, const Variable& variable) {
    const auto& attributes = variable.attributes;
    for (const char* key : {"_FillValue", "missing_value"}) {
      if (const auto value = number_in(attributes, key)) set_void(*value);
    }
    // What the format fills with where nothing is said, but for bytes.
    static const std::map<int, double> kFilled = {
        {3, -32767.0}, {4, -2147483647.0}, {5, 9.969209968386869e36}, {6, 9.969209968386869e36},
        {8, 65535.0},  {9, 4294967295.0}};
    if (const auto filled = kFilled.find(variable.type); filled != kFilled.end() && info_.void_values.empty()) {
      set_void(filled->second);
    }
    info_.z_scale = number_in(attributes, "scale_factor").value_or(1.0);
    info_.z_offset = number_in(attributes, "add_offset").value_or(0.0);
    if (info_.z_scale == 0.0 || !std::isfinite(info_.z_scale) || !std::isfinite(info_.z_offset)) {
      refuse(ErrorCode::kCorrupt, "scale_factor or add_offset is no scale");
    }
    set_vertical_unit(text_in(attributes, "units"));
    (void)header;
  }

  void set_vertical_unit(const std::string& text) {
    const auto unit = linear_unit(text);
    if (!unit) return;
    info_.vertical_unit = unit->name;
    info_.metres_per_vertical_unit = unit->metres;
  }

  /// GMT's format of before CF: x_range, y_range, spacing, dimension, and z in one dimension from the North-West on.
  void read_gmt(ClassicHeader& header, const Variable& z) {
    info_.format = "GMT grid";
    const auto pair = [&](const char* name) {
      const Variable* const found = header.variable(name);
      if (found == nullptr || found->dimensions.size() != 1 || header.size_of(*found, 0) != 2 ||
          !ClassicHeader::sample_type(found->type)) {
        refuse(ErrorCode::kCorrupt, fmt::format("has no {} of two numbers", name));
      }
      const std::vector<double> both = header.numbers(*found, 0, 2);
      return std::pair(both[0], both[1]);
    };
    const auto [columns, rows] = pair("dimension");
    DescribedSource::set_size(columns, rows);
    const auto [west, east] = pair("x_range");
    const auto [south, north] = pair("y_range");
    set_type(z);
    layout_.offset_bytes = z.begin;
    const bool is_area = number_in(z.attributes, "node_offset").value_or(0.0) != 0.0;
    const double less = is_area ? 0.0 : 1.0;
    const double dx = (east - west) / (columns - less);
    const double dy = (north - south) / (rows - less);
    if (!(dx > 0.0 && dy > 0.0)) refuse(ErrorCode::kCorrupt, "x_range or y_range is empty");
    const double half = is_area ? 0.5 : 0.0;
    place({west + half * dx, dx}, {north - half * dy, -dy}, is_area ? Registration::kArea : Registration::kPoint);
    info_.z_scale = number_in(z.attributes, "scale_factor").value_or(1.0);
    info_.z_offset = number_in(z.attributes, "add_offset").value_or(0.0);
    if (info_.z_scale == 0.0) refuse(ErrorCode::kCorrupt, "scale_factor is 0");
    if (const Variable* const range = header.variable("x_range")) {
      if (lower_case(text_in(range->attributes, "units")).find("degree") != std::string::npos) {
        info_.georeference.unit = HorizontalUnit::kDegree;
      }
    }
  }
};

bool begins_with(const std::string& path, std::string_view wanted) {
  std::string head(wanted.size(), '\0');
  return is_file(path) && RawFile(path).read_some(0, std::as_writable_bytes(std::span(head))) == head.size() &&
         head == wanted;
}

constexpr std::string_view kEnviData[] = {"", ".dat", ".img", ".bin", ".raw", ".bsq", ".bil", ".bip", ".flt", ".envi"};

/// x.hdr, or x.dat.hdr where there is none: what else x.hdr says is said of the same samples.
std::string envi_header_of(const std::string& path) {
  // Another file may have the name of the samples but for its extension.
  const std::string own = lower_case(std::filesystem::path(path).extension().string());
  const bool is_data = std::ranges::find(kEnviData, own) != std::end(kEnviData);
  for (const bool is_replaced : {true, false}) {
    for (const char* extension : {".hdr", ".HDR"}) {
      const std::string header =
          is_replaced ? std::filesystem::path(path).replace_extension(extension).string() : path + extension;
      if (header == path || (is_replaced && !is_data) || !is_file(header)) continue;
      return begins_with(header, "ENVI") ? header : std::string();
    }
  }
  return {};
}

}  // namespace

bool looks_like_envi(std::span<const std::byte> head) {
  return text_of(head).starts_with("ENVI");
}

bool has_envi_header(const std::string& path) {
  return !envi_header_of(path).empty();
}

std::unique_ptr<HeightSource> open_envi(const std::string& path, const OpenOptions& options) {
  if (!begins_with(path, "ENVI")) {
    const std::string header = envi_header_of(path);
    if (header.empty()) throw Error(ErrorCode::kCorrupt, path + ": has no ENVI header beside it");
    return std::make_unique<EnviSource>(path, header, options);
  }
  // The header was named.
  for (const std::string_view extension : kEnviData) {
    const std::string data = std::filesystem::path(path).replace_extension(extension).string();
    if (data != path && is_file(data)) return std::make_unique<EnviSource>(data, path, options);
  }
  throw Error(ErrorCode::kIo,
              path + ": is an ENVI header whose samples are not beside it, under its name without .hdr");
}

std::unique_ptr<HeightSource> open_saga(const std::string& path, const OpenOptions& options) {
  const bool is_data = lower_case(path).ends_with(".sdat");
  const std::filesystem::path name = std::filesystem::path(path).replace_extension(is_data ? ".sgrd" : ".sdat");
  const std::string other = file_beside(path, name.filename().string());
  if (other.empty()) throw Error(ErrorCode::kIo, fmt::format("{}: {} must be beside it", path, name.string()));
  return std::make_unique<SagaSource>(is_data ? path : other, is_data ? other : path, options);
}

bool looks_like_netcdf(std::span<const std::byte> head) {
  const std::string_view text = text_of(head);
  return text.size() > 4 && text.starts_with("CDF") && (text[3] == 1 || text[3] == 2 || text[3] == 5);
}

std::unique_ptr<HeightSource> open_netcdf(const std::string& path, const OpenOptions& options) {
  return std::make_unique<NetcdfSource>(path, options);
}

}  // namespace isohf
