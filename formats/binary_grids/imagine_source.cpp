/// ERDAS Imagine (HFA): a tree of named, typed nodes, and tiles of samples that its Edms_State nodes find. All of it is
/// little-endian. What the fields of a node are stands in a dictionary in the file as well; those below are the same in
/// every file of Imagine 8.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/bands.h"
#include "formats/files/block_cache.h"
#include "formats/files/file_source.h"
#include "formats/files/text.h"
#include "formats/georeference/files_beside.h"
#include "formats/georeference/map_wkt.h"
#include "formats/georeference/reference_system.h"
#include "formats/georeference/units.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::string_view kImagineMagic("EHFA_HEADER_TAG\0", 16);
constexpr std::string_view kSpillMagic("ERDAS_IMG_EXTERNAL_RASTER\0", 26);
constexpr std::uint64_t kMostTileBytes = std::uint64_t{1} << 26U;
constexpr std::uint64_t kMostKeptBytes = std::uint64_t{64} << 20U;
/// Layers and what describes them.
constexpr std::size_t kMostNodes = 10000;
constexpr std::uint64_t kMostNodeBytes = std::uint64_t{1} << 20U;

struct Node {
  std::uint32_t next = 0;
  std::uint32_t child = 0;
  std::uint32_t data = 0;
  std::uint32_t data_bytes = 0;
  std::string name;
  std::string type;
};

/// Fields of a node one after the other.
class Fields {
 public:
  Fields(const std::string& path, const Node& node, std::vector<std::byte> bytes)
      : path_(path), name_(node.name), bytes_(std::move(bytes)) {}

  template <typename T>
  T number() {
    if (bytes_.size() - at_ < sizeof(T)) fail();
    const T value = load_little<T>(bytes_.data() + at_);
    at_ += sizeof value;
    return value;
  }
  void skip(std::size_t bytes) {
    if (bytes_.size() - at_ < bytes) fail();
    at_ += bytes;
  }
  /// How many things lie behind a pointer: right behind it, wherever it points.
  std::uint32_t count() {
    const auto found = number<std::uint32_t>();
    skip(sizeof(std::uint32_t));
    return found;
  }
  std::string text() {
    const std::uint32_t length = count();
    const std::size_t begin = at_;
    skip(length);
    const std::string_view all = text_of(bytes_).substr(begin, length);
    return one_line(std::string(all.substr(0, all.find('\0'))));
  }
  /// Two numbers behind a pointer.
  std::array<double, 2> pair() {
    if (count() == 0) return {0.0, 0.0};
    const auto first = number<double>();
    return {first, number<double>()};
  }
  [[nodiscard]] std::string_view all() const { return text_of(bytes_); }

 private:
  [[noreturn]] void fail() const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: the node {} ends early", path_, printable(name_)));
  }
  const std::string& path_;
  std::string name_;
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
};

/// A stored type: its name, bits of a sample, and what it is read as.
struct PixelType {
  const char* name;
  unsigned bits;
  std::optional<SampleType> read_as;
};
constexpr std::array<PixelType, 13> kPixelTypes = {{{"u1", 1, SampleType::kUint8},
                                                    {"u2", 2, SampleType::kUint8},
                                                    {"u4", 4, SampleType::kUint8},
                                                    {"u8", 8, SampleType::kUint8},
                                                    {"s8", 8, SampleType::kInt8},
                                                    {"u16", 16, SampleType::kUint16},
                                                    {"s16", 16, SampleType::kInt16},
                                                    {"u32", 32, SampleType::kUint32},
                                                    {"s32", 32, SampleType::kInt32},
                                                    {"f32", 32, SampleType::kFloat32},
                                                    {"f64", 64, SampleType::kFloat64},
                                                    {"c64", 64, std::nullopt},
                                                    {"c128", 128, std::nullopt}}};

/// Samples of 1, 2 or 4 bits, the first in the lowest bits, to bytes.
void unpack_bits(std::span<const std::byte> stored, unsigned bits, std::span<std::byte> samples) {
  const unsigned per_byte = 8 / bits;
  const auto mask = static_cast<std::byte>((1U << bits) - 1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = (stored[i / per_byte] >> static_cast<int>(i % per_byte * bits)) & mask;
  }
}

/// A tile that is run-length-coded, or of few bits above its least sample ("ESRI GRID compression"): the least sample,
/// how many runs (-1: none, samples follow), where their samples begin, bits of each, lengths, samples.
class CodedTile {
 public:
  explicit CodedTile(std::span<const std::byte> stored) : stored_(stored) {}

  /// False where it is damaged. Samples have 1, 2 or 4 bytes, and go on from the least one in 32 bits, floats' as well.
  bool decode(std::span<std::byte> samples, std::size_t size) {
    constexpr std::size_t kHeadBytes = 13;
    if (stored_.size() < kHeadBytes) return false;
    const auto head = [&](std::size_t i) { return load_little<std::uint32_t>(stored_.data() + 4 * i); };
    const auto runs = static_cast<std::int32_t>(head(1));
    bits_ = std::to_integer<unsigned>(stored_[12]);
    if (bits_ > 32 || (bits_ & (bits_ - 1)) != 0) return false;
    std::size_t lengths = kHeadBytes;
    first_ = runs == -1 ? kHeadBytes : head(2);
    const std::size_t count = samples.size() / size;
    std::size_t done = 0;
    for (std::int64_t run = 0; runs == -1 ? done < count : run < runs; ++run) {
      std::size_t length = 1;
      std::uint32_t value = 0;
      if ((runs != -1 && !read_length(lengths, length)) || length > count - done || !read_value(value)) return false;
      value += head(0);
      for (std::size_t i = 0; i < length; ++i, ++done) store_little(samples.data() + done * size, value, size);
    }
    return done == count;
  }

 private:
  /// The two highest bits of the first byte say how many more there are.
  bool read_length(std::size_t& at, std::size_t& length) const {
    if (at >= stored_.size()) return false;
    const auto first = std::to_integer<unsigned>(stored_[at++]);
    length = first & 0x3FU;
    for (unsigned more = first >> 6U; more > 0; --more) {
      if (at >= stored_.size()) return false;
      length = length << 8U | std::to_integer<unsigned>(stored_[at++]);
    }
    return true;
  }
  /// Whole bytes are big-endian; parts of one are taken from the lowest bits on.
  bool read_value(std::uint32_t& value) {
    value = 0;
    if (bits_ == 0) return true;
    const std::size_t at = first_ + static_cast<std::size_t>(bit_ / 8);
    const std::size_t bytes = (bits_ + 7) / 8;
    if (at >= stored_.size() || bytes > stored_.size() - at) return false;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | std::to_integer<unsigned>(stored_[at + i]);
    if (bits_ < 8) value = value >> (bit_ % 8) & ((1U << bits_) - 1);
    bit_ += bits_;
    return true;
  }

  std::span<const std::byte> stored_;
  unsigned bits_ = 0;
  std::size_t first_ = 0;
  std::uint64_t bit_ = 0;
};

class ImagineSource final : public FileSource {
 public:
  ImagineSource(const std::string& path, const OpenOptions& options) : FileSource(path, "ERDAS Imagine", options) {
    std::array<std::byte, 4> pointer{};
    file_->read(kImagineMagic.size(), pointer);
    std::array<std::byte, 18> head{};
    file_->read(number_at<std::uint32_t>(pointer, 0), head);
    std::vector<Node> layers;
    for (Node& node : children(node_at(number_at<std::uint32_t>(head, 8)))) {
      if (node.type == "Eimg_Layer") layers.push_back(std::move(node));
    }
    if (layers.empty()) fail(ErrorCode::kUnsupported, "has no layer of samples (Eimg_Layer)");
    std::vector<std::string> names;
    for (const Node& layer : layers) names.push_back(layer.name);
    const auto band = choose_band(info_, options, static_cast<std::int64_t>(layers.size()), names);
    read_layer(layers[static_cast<std::size_t>(band)], options);
    read_files_beside(info_, static_cast<int>(band) + 1);
    bound_undeclared_voids(info_);
    apply_open_options(info_, options);
    limit_buffers(kMostKeptBytes);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const std::size_t size = size_bytes(info_.sample_type);
    for (std::int64_t row = window.row; row < window.row + window.rows;) {
      const std::int64_t rows = std::min(window.row + window.rows, (row / tile_height_ + 1) * tile_height_) - row;
      for (std::int64_t column = window.column; column < window.column + window.columns;) {
        const std::int64_t columns =
            std::min(window.column + window.columns, (column / tile_width_ + 1) * tile_width_) - column;
        const std::byte* const tile = tile_of(row / tile_height_, column / tile_width_);
        for (std::int64_t r = row; r < row + rows; ++r) {
          const auto from = static_cast<std::size_t>(r % tile_height_ * tile_width_ + column % tile_width_);
          const auto to = static_cast<std::size_t>((r - window.row) * window.columns + column - window.column);
          std::memcpy(samples.data() + to * size, tile + from * size, static_cast<std::size_t>(columns) * size);
        }
        column += columns;
      }
      row += rows;
    }
  }

  void limit_buffers(std::uint64_t bytes) override {
    FileSource::limit_buffers(bytes);
    cache_.emplace(tile_bytes_, tiles_kept(bytes));
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return FileSource::buffer_bytes(limit) + tiles_kept(limit) * tile_bytes_;
  }

 private:
  template <typename T>
  static T number_at(std::span<const std::byte> bytes, std::size_t at) {
    return load_little<T>(bytes.data() + at);
  }

  [[nodiscard]] Node node_at(std::uint32_t at) const {
    std::array<std::byte, 120> bytes{};
    file_->read(at, bytes);
    const auto word = [&](std::size_t from, std::size_t length) {
      const std::string_view text = text_of(bytes).substr(from, length);
      return std::string(text.substr(0, text.find('\0')));
    };
    return {number_at<std::uint32_t>(bytes, 0),
            number_at<std::uint32_t>(bytes, 12),
            number_at<std::uint32_t>(bytes, 16),
            number_at<std::uint32_t>(bytes, 20),
            word(24, 64),
            word(88, 32)};
  }

  [[nodiscard]] std::vector<Node> children(const Node& node) const {
    std::vector<Node> found;
    for (std::uint32_t at = node.child; at != 0; at = found.back().next) {
      if (found.size() == kMostNodes) fail(ErrorCode::kCorrupt, "has nodes without end");
      found.push_back(node_at(at));
    }
    return found;
  }

  [[nodiscard]] Fields fields_of(const Node& node) const {
    if (node.data_bytes > kMostNodeBytes) {
      fail(ErrorCode::kCorrupt, fmt::format("the node {} has {} bytes", printable(node.name), node.data_bytes));
    }
    std::vector<std::byte> bytes(node.data_bytes);
    file_->read(node.data, bytes);
    return {info_.path, node, std::move(bytes)};
  }

  void read_layer(const Node& layer, const OpenOptions& options) {
    Fields fields = fields_of(layer);
    info_.width = fields.number<std::int32_t>();
    info_.height = fields.number<std::int32_t>();
    fields.skip(2);  // thematic or not
    const auto type = fields.number<std::uint16_t>();
    tile_width_ = fields.number<std::int32_t>();
    tile_height_ = fields.number<std::int32_t>();
    if (type >= kPixelTypes.size()) fail(ErrorCode::kCorrupt, fmt::format("has samples of an unknown type, {}", type));
    stored_ = kPixelTypes[type];
    if (!stored_.read_as) fail(ErrorCode::kUnsupported, fmt::format("has complex samples ({})", stored_.name));
    info_.sample_type = *stored_.read_as;
    const double tile_bytes = static_cast<double>(tile_width_) * static_cast<double>(tile_height_) *
                              static_cast<double>(size_bytes(info_.sample_type));
    if (info_.width < 1 || info_.height < 1 || tile_width_ < 1 || tile_height_ < 1 ||
        !(tile_bytes <= static_cast<double>(kMostTileBytes))) {
      fail(ErrorCode::kCorrupt, fmt::format("has {} x {} samples in tiles of {} x {}", info_.width, info_.height,
                                            tile_width_, tile_height_));
    }
    tile_bytes_ = static_cast<std::size_t>(tile_bytes);
    tiles_across_ = (info_.width + tile_width_ - 1) / tile_width_;
    tiles_down_ = (info_.height + tile_height_ - 1) / tile_height_;
    info_.block_width = std::min(tile_width_, info_.width);
    info_.block_height = std::min(tile_height_, info_.height);
    bool has_samples = false;
    std::optional<Node> projection;
    std::string system;
    for (const Node& node : children(layer)) {
      if (node.name == "RasterDMS" || node.type == "Edms_State") {
        read_tiles(node);
        has_samples = true;
      } else if (node.type == "ImgExternalRaster") {
        read_spill_file(node, options);
        has_samples = true;
      } else if (node.type == "Eimg_NonInitializedValue") {
        read_void(node);
      } else if (node.type == "Eprj_MapInfo") {
        read_place(node);
      } else if (node.type == "Eprj_ProParameters") {
        projection = node;
      } else if (node.type.starts_with("Eprj_MapProjection")) {
        system = system_in(node);
      }
    }
    if (!has_samples) fail(ErrorCode::kUnsupported, "has a layer without samples of its own (RasterDMS)");
    if (!system.empty()) {
      read_system_text(system, info_.path, info_);
    } else if (projection) {
      read_projection(*projection);
    }
  }

  /// A table of where tiles are, which stays in the file.
  void read_tiles(const Node& node) {
    constexpr std::uint32_t kHeadBytes = 22;
    const double wanted = static_cast<double>(tiles_across_) * static_cast<double>(tiles_down_);
    std::array<std::byte, 4> count{};
    file_->read(node.data, count);
    if (node.data_bytes < kHeadBytes || wanted * kEntryBytes > static_cast<double>(node.data_bytes - kHeadBytes) ||
        wanted > static_cast<double>(number_at<std::uint32_t>(count, 0))) {
      fail(ErrorCode::kCorrupt,
           fmt::format("needs a table of {:.0f} tiles, has {} bytes of it", wanted, node.data_bytes));
    }
    table_bytes_ = std::uint64_t{node.data} + kHeadBytes;
  }

  void read_spill_file(const Node& node, const OpenOptions& options) {
    Fields fields = fields_of(node);
    const std::string name = std::filesystem::path(fields.text()).filename().string();
    const auto offset = [&] {
      const auto low = fields.number<std::uint32_t>();
      return std::uint64_t{fields.number<std::uint32_t>()} << 32U | low;
    };
    const std::uint64_t flags = offset();
    const std::uint64_t samples = offset();
    const std::int64_t layers = fields.number<std::int32_t>();
    const std::int64_t layer = fields.number<std::int32_t>();
    std::string path = file_beside(info_.path, name);
    // It may have been renamed with the file.
    const std::string own = std::filesystem::path(info_.path).stem().string() + ".ige";
    if (path.empty()) path = file_beside(info_.path, own);
    if (path.empty()) {
      throw Error(ErrorCode::kIo,
                  fmt::format("{}: its samples are in {}, which must be beside it", info_.path, printable(name)));
    }
    spill_.emplace(path, options.unpacked_bytes);
    std::array<std::byte, kSpillMagic.size()> magic{};
    if (spill_->read_some(0, magic) != magic.size() || text_of(magic) != kSpillMagic) {
      fail(ErrorCode::kCorrupt, "its samples' file is no spill file of Imagine (.ige)");
    }
    constexpr std::int64_t kMostLayers = 65536;
    if (layers < 1 || layers > kMostLayers || layer < 0 || layer >= layers) {
      fail(ErrorCode::kCorrupt, fmt::format("is layer {} of {} in its spill file", layer, layers));
    }
    const double end =
        static_cast<double>(samples) + static_cast<double>(tiles_across_) * static_cast<double>(tiles_down_) *
                                           static_cast<double>(layers) * static_cast<double>(stored_tile_bytes());
    constexpr double kMostBytes = 0x1p60;
    if (!(end < kMostBytes) || !(static_cast<double>(flags) < kMostBytes)) {
      fail(ErrorCode::kCorrupt, "says more samples than are in any spill file");
    }
    constexpr std::uint64_t kFlagsHeadBytes = 20;
    spill_flags_ = flags + kFlagsHeadBytes;
    spill_first_ = samples + static_cast<std::uint64_t>(layer) * stored_tile_bytes();
    spill_step_ = static_cast<std::uint64_t>(layers) * stored_tile_bytes();
  }

  /// A number of a type of its own behind a pointer: rows, columns, type, kind, the number.
  void read_void(const Node& node) {
    Fields fields = fields_of(node);
    if (fields.count() == 0) return;
    fields.skip(8);
    const auto type = fields.number<std::uint16_t>();
    fields.skip(2);
    double value = std::numeric_limits<double>::quiet_NaN();
    switch (type) {
      case 3:
        value = fields.number<std::uint8_t>();
        break;
      case 4:
        value = fields.number<std::int8_t>();
        break;
      case 5:
        value = fields.number<std::uint16_t>();
        break;
      case 6:
        value = fields.number<std::int16_t>();
        break;
      case 7:
        value = fields.number<std::uint32_t>();
        break;
      case 8:
        value = fields.number<std::int32_t>();
        break;
      case 9:
        value = static_cast<double>(fields.number<float>());
        break;
      case 10:
        value = fields.number<double>();
        break;
      default:
        return;
    }
    if (const auto stored = void_value_as_stored(info_.sample_type, value)) info_.void_values = {*stored};
  }

  void read_place(const Node& node) {
    Fields fields = fields_of(node);
    (void)fields.text();  // the map's name
    const auto [west, north] = fields.pair();
    const auto [east, south] = fields.pair();
    const auto [width, height] = fields.pair();
    const std::string units = lower_case(fields.text());
    // The corners' samples say it to more digits.
    const double dx = info_.width > 1 && east > west ? (east - west) / static_cast<double>(info_.width - 1) : width;
    const double dy =
        info_.height > 1 && north > south ? (north - south) / static_cast<double>(info_.height - 1) : height;
    if (!std::isfinite(west) || !std::isfinite(north) || !(dx > 0.0) || !(dy > 0.0) || !std::isfinite(dx + dy)) {
      fail(ErrorCode::kCorrupt, fmt::format("gives a spacing of {} x {}, must be positive", dx, dy));
    }
    if (south > north) {
      fail(ErrorCode::kUnsupported, "has its southernmost row first; gdalwarp turns it");
    }
    Georeference& place = info_.georeference;
    place.registration = Registration::kArea;
    place.has_origin = true;
    const double degrees = units == "ds" ? 1.0 / 3600.0 : 1.0;
    place.spacing_x = dx * degrees;
    place.spacing_y = dy * degrees;
    place.origin_x = west * degrees;
    place.origin_y = north * degrees;
    if (units == "dd" || units == "ds" || units == "degrees") {
      place.unit = HorizontalUnit::kDegree;
    } else if (const auto unit = linear_unit(units == "feet" ? "ftUS" : units)) {
      place.unit = HorizontalUnit::kMetre;
      place.metres_per_unit = unit->metres;
    }
  }

  /// The WKT that ArcGIS and GDAL put into Eprj_MapProjection842; empty where it has none.
  [[nodiscard]] std::string system_in(const Node& node) const {
    const Fields fields = fields_of(node);
    constexpr std::string_view kBefore = "PE_COORDSYS,.";
    const std::size_t begin = fields.all().find(kBefore);
    if (begin == std::string_view::npos) return {};
    const std::string_view rest = fields.all().substr(begin);
    const std::size_t at = std::min(rest.find("PROJCS["), rest.find("GEOGCS["));
    return at == std::string_view::npos ? std::string() : std::string(rest.substr(at, rest.find('\0', at) - at));
  }

  /// A map by its number in the USGS's GCTP package, on a datum by its name.
  void read_projection(const Node& node) {
    Fields fields = fields_of(node);
    fields.skip(2);
    const auto number = fields.number<std::int32_t>();
    (void)fields.text();
    const std::string name = fields.text();
    const int zone = fields.number<std::int32_t>();
    std::array<double, 15> given{};
    const std::uint32_t count = fields.count();
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto value = fields.number<double>();
      if (i < given.size()) given[i] = value;
    }
    std::string spheroid = "unknown";
    Ellipsoid ellipsoid;
    if (fields.count() > 0) {
      spheroid = fields.text();
      const auto a = fields.number<double>();
      const auto b = fields.number<double>();
      if (!(a > 0.0 && b > 0.0 && b <= a)) fail(ErrorCode::kCorrupt, fmt::format("gives radii of {} and {} m", a, b));
      ellipsoid = {a, a == b ? 0.0 : a / (a - b)};
    }
    std::string datum = "unknown";
    for (const Node& child : children(node)) {
      if (child.type == "Eprj_Datum") datum = fields_of(child).text();
    }
    const std::string geographic = geographic_on(datum, spheroid, ellipsoid);
    if (number == 0) {
      read_system_text(geographic, info_.path, info_);
      return;
    }
    if (number == 1 && datum == "WGS 84" && zone >= 1 && zone <= 60) {
      info_.georeference.system = wgs84_utm_zone(zone, given[3] < 0.0);
      info_.georeference.unit = HorizontalUnit::kMetre;
      return;
    }
    const double degree = 180.0 / std::numbers::pi;
    MapParameters map;
    map.parallel_1 = given[2] * degree;
    map.parallel_2 = given[3] * degree;
    map.longitude = given[4] * degree;
    map.latitude = given[5] * degree;
    map.easting = given[6];
    map.northing = given[7];
    // GCTP's numbers, and GeoTIFF's for the same methods.
    constexpr std::array<std::pair<int, int>, 12> kMethods = {
        {{1, 1}, {3, 11}, {4, 8}, {6, 15}, {7, 22}, {8, 13}, {9, 1}, {10, 14}, {11, 10}, {12, 12}, {13, 19}, {16, 24}}};
    const auto method = std::ranges::find(kMethods, number, &std::pair<int, int>::first);
    if (method == kMethods.end() || (number == 1 && (zone < 1 || zone > 60))) {
      info_.warnings.push_back(loss(
          fmt::format("its map, \"{}\", is not known: where it lies on the ground is not kept; its coordinates are",
                      printable(name))));
      return;
    }
    if (number == 1) {
      const double south = given[3] < 0.0 ? 1e7 : 0.0;
      map = {0.0, 6.0 * zone - 183.0, 0.0, 0.0, 0.9996, 0.0, 0.0, 5e5, south};
    } else if (number == 9) {
      map.scale = given[2];
    }
    const double metres = info_.georeference.unit == HorizontalUnit::kMetre ? info_.georeference.metres_per_unit : 1.0;
    read_system_text(map_wkt(name.empty() ? "unknown" : name, geographic, method_of_code(method->second), map, metres),
                     info_.path, info_);
  }

  [[nodiscard]] static std::string geographic_on(const std::string& datum, const std::string& spheroid,
                                                 const Ellipsoid& ellipsoid) {
    constexpr std::array<std::pair<std::string_view, int>, 6> kCodes = {{{"WGS 84", 4326},
                                                                         {"NAD83", 4269},
                                                                         {"NAD27", 4267},
                                                                         {"WGS 72", 4322},
                                                                         {"ETRS 89", 4258},
                                                                         {"European 1950", 4230}}};
    for (const auto& [name, code] : kCodes) {
      ReferenceSystem system;
      system.epsg = code;
      if (name != datum) continue;
      if (std::string wkt = wkt_of(system, WktDialect::kGdal); !wkt.empty()) return wkt;
    }
    return geographic_wkt(datum, datum, spheroid, ellipsoid.semi_major_axis_m, ellipsoid.inverse_flattening);
  }

  [[nodiscard]] std::uint64_t stored_tile_bytes() const {
    return (static_cast<std::uint64_t>(tile_width_) * static_cast<std::uint64_t>(tile_height_) * stored_.bits + 7) / 8;
  }
  [[nodiscard]] std::size_t tiles_kept(std::uint64_t bytes) const {
    const std::uint64_t most = std::max<std::uint64_t>(1, std::min(bytes, kMostKeptBytes) / tile_bytes_);
    return static_cast<std::size_t>(std::min<std::uint64_t>(most, static_cast<std::uint64_t>(tiles_across_) + 1));
  }

  /// The samples of a tile, until other tiles were asked for.
  const std::byte* tile_of(std::int64_t row, std::int64_t column) {
    const auto index = static_cast<std::uint64_t>(row * tiles_across_ + column);
    if (const std::byte* const held = cache_->find(index)) return held;
    std::byte* const tile = cache_->claim(index);
    try {
      read_tile(index, row, column, {tile, tile_bytes_});
    } catch (...) {
      cache_->clear();
      throw;
    }
    return tile;
  }

  void read_tile(std::uint64_t index, std::int64_t row, std::int64_t column, std::span<std::byte> tile) {
    std::uint64_t offset = 0;
    std::uint64_t bytes = stored_tile_bytes();
    bool is_there = true;
    bool is_coded = false;
    if (spill_) {
      const auto row_bytes = static_cast<std::uint64_t>((tiles_across_ + 7) / 8);
      std::array<std::byte, 1> flags{};
      spill_->read(spill_flags_ + static_cast<std::uint64_t>(row) * row_bytes + static_cast<std::uint64_t>(column / 8),
                   flags);
      is_there = (std::to_integer<unsigned>(flags[0]) >> (column % 8) & 1U) != 0;
      offset = spill_first_ + index * spill_step_;
    } else {
      std::array<std::byte, kEntryBytes> entry{};
      file_->read(table_bytes_ + index * kEntryBytes, entry);
      offset = number_at<std::uint32_t>(entry, 2);
      is_there = number_at<std::uint16_t>(entry, 10) != 0;
      is_coded = number_at<std::uint16_t>(entry, 12) != 0;
      if (is_coded) bytes = number_at<std::uint32_t>(entry, 6);
    }
    if (!is_there) return fill(tile, row, column);
    const std::string where = fmt::format("tile ({}, {})", column, row);
    if (is_coded && (stored_.bits > 32 || bytes > std::min(2 * kMostTileBytes, file_->size_bytes()))) {
      fail(ErrorCode::kUnsupported, fmt::format("{} is compressed, {} bytes of {}", where, bytes, stored_.name));
    }
    const bool is_plain = !is_coded && stored_.bits >= 8;
    packed_.resize(is_plain ? 0 : static_cast<std::size_t>(bytes));
    (spill_ ? *spill_ : *file_).read(offset, is_plain ? tile : std::span(packed_));
    const std::size_t size = size_bytes(info_.sample_type);
    if (is_coded) {
      if (!CodedTile(packed_).decode(tile, size)) fail(ErrorCode::kCorrupt, where + " is damaged");
    } else if (!is_plain) {
      unpack_bits(packed_, stored_.bits, tile);
    }
    swap_to_little(tile, size);
  }

  /// Of a tile that was never written.
  void fill(std::span<std::byte> tile, std::int64_t row, std::int64_t column) const {
    if (info_.void_values.empty() && !is_floating(info_.sample_type)) {
      fail(ErrorCode::kUnsupported, fmt::format("tile ({}, {}) was never written, and no value is void; `void_values` "
                                                "names one to fill it with",
                                                column, row));
    }
    const auto value = info_.void_values.empty() ? std::numeric_limits<double>::quiet_NaN() : info_.void_values.front();
    const std::vector<std::byte> sample = stored_sample(info_.sample_type, value);
    for (std::size_t at = 0; at < tile.size(); at += sample.size())
      std::ranges::copy(sample, tile.begin() + static_cast<std::ptrdiff_t>(at));
  }

  static constexpr std::size_t kEntryBytes = 14;

  PixelType stored_ = kPixelTypes[3];
  std::int64_t tile_width_ = 64;
  std::int64_t tile_height_ = 64;
  std::int64_t tiles_across_ = 1;
  std::int64_t tiles_down_ = 1;
  std::size_t tile_bytes_ = 1;
  std::uint64_t table_bytes_ = 0;  ///< where the table of tiles begins
  std::optional<RawFile> spill_;
  std::uint64_t spill_flags_ = 0;  ///< a bit for each tile that was written
  std::uint64_t spill_first_ = 0;
  std::uint64_t spill_step_ = 0;
  std::optional<BlockCache> cache_;
  std::vector<std::byte> packed_;
};

}  // namespace

bool looks_like_imagine(std::span<const std::byte> head) {
  return text_of(head).starts_with(kImagineMagic);
}

std::unique_ptr<HeightSource> open_imagine(const std::string& path, const OpenOptions& options) {
  return std::make_unique<ImagineSource>(path, options);
}

}  // namespace isohf
