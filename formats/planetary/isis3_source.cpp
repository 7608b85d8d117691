#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/planetary/label_text.h"
#include "formats/planetary/planetary_system.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

struct PixelType {
  std::string_view name;
  SampleType type;
  double null;       ///< what lies outside of the next two is special as well
  double valid_min;  ///< ISIS, SpecialPixel.h
  double valid_max;
};

constexpr double real(std::uint32_t bits) {
  return std::bit_cast<float>(bits);
}

constexpr std::array<PixelType, 5> kPixelTypes = {{
    {"UNSIGNEDBYTE", SampleType::kUint8, 0.0, 1.0, 254.0},
    {"SIGNEDWORD", SampleType::kInt16, -32768.0, -32752.0, 32767.0},
    {"UNSIGNEDWORD", SampleType::kUint16, 0.0, 3.0, 65522.0},
    {"UNSIGNEDINTEGER", SampleType::kUint32, 0.0, 3.0, 4294967282.0},
    {"REAL", SampleType::kFloat32, real(0xFF7FFFFBU), real(0xFF7FFFFAU), real(0x7F7FFFFFU)},
}};

/// The file that holds the samples: that of the label, or one beside it.
std::string core_file(const std::string& path, const LabelBlock& core) {
  if (core.entry("^CORE") == nullptr) return path;
  const std::string name = core.text("^CORE").value_or("");
  const std::string found = name.find('/') == std::string::npos ? file_beside(path, name) : std::string();
  if (!found.empty()) return found;
  throw Error(ErrorCode::kIo, fmt::format("{}: label line {}: ^Core names {}, which must be a file beside the label",
                                          path, core.entry("^CORE")->line, name));
}

class Isis3Source final : public DescribedSource {
 public:
  Isis3Source(const std::string& path, const LabelText& label, const OpenOptions& options)
      : DescribedSource(core_file(path, label.root.inner("ISISCUBE").inner("CORE")), "ISIS3 cube", path) {
    const LabelBlock& cube = label.root.inner("ISISCUBE");
    const LabelBlock& core = cube.inner("CORE");
    read_pixels(core.inner("PIXELS"));
    read_tiles(core, core.entry("^CORE") == nullptr ? label.end_bytes : 0, options);
    const auto groups = cube.all("MAPPING");
    if (!groups.empty()) read_mapping(*groups.front());
    finish(options, 0);
    const bool has_whole_rows = tile_.width >= info_.width;
    info_.block_width = has_whole_rows ? info_.width : tile_.width;
    info_.block_height = has_whole_rows ? 1 : std::min(tile_.height, info_.height);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const auto size = static_cast<std::int64_t>(size_bytes(info_.sample_type));
    const std::int64_t row_bytes = window.columns * size;
    const auto tile_bytes = static_cast<std::uint64_t>(tile_.width * tile_.height * size);
    Window part;  // in the raster, and in its tile
    for (std::int64_t row = window.row; row < window.row + window.rows; row += part.rows) {
      for (std::int64_t column = window.column; column < window.column + window.columns; column += part.columns) {
        const std::int64_t tile = row / tile_.height * tiles_across_ + column / tile_.width;
        part = {column % tile_.width, row % tile_.height, 0, 0};
        part.columns = std::min(window.column + window.columns - column, tile_.width - part.column);
        part.rows = std::min(window.row + window.rows - row, tile_.height - part.row);
        PlainLayout layout = layout_;
        layout.offset_bytes += static_cast<std::uint64_t>(tile) * tile_bytes;
        std::byte* const to = samples.data() + (row - window.row) * row_bytes + (column - window.column) * size;
        const auto bytes = static_cast<std::size_t>(part.columns * part.rows * size);
        if (part.columns == window.columns) {  // its rows follow each other
          read_plain_samples(*file_, tile_, layout, part, {to, bytes});
          continue;
        }
        piece_.resize(bytes);
        read_plain_samples(*file_, tile_, layout, part, piece_);
        const auto run = static_cast<std::size_t>(part.columns * size);
        for (std::int64_t i = 0; i < part.rows; ++i)
          std::memcpy(to + i * row_bytes, piece_.data() + static_cast<std::size_t>(i) * run, run);
      }
    }
  }

 private:
  void read_pixels(const LabelBlock& pixels) {
    const std::string name = pixels.word("TYPE");
    const auto* const type = std::ranges::find(kPixelTypes, name, &PixelType::name);
    if (type == kPixelTypes.end()) {
      pixels.refuse("TYPE", "UnsignedByte, SignedWord, UnsignedWord, UnsignedInteger or Real");
    }
    info_.sample_type = type->type;
    info_.void_values = {type->null};
    info_.valid_min = type->valid_min;
    info_.valid_max = type->valid_max;
    const std::string order = pixels.word("BYTEORDER", "LSB");
    if (order != "LSB" && order != "MSB") pixels.refuse("BYTEORDER", "Lsb or Msb");
    layout_.big_endian = order == "MSB";
    set_scale(pixels.number("MULTIPLIER").value_or(1.0), pixels.number("BASE").value_or(0.0), "Multiplier");
  }

  /// The samples lie in tiles, which are whole at the edges too; bands in sequence are tiles of the whole raster.
  void read_tiles(const LabelBlock& core, std::uint64_t label_bytes, const OpenOptions& options) {
    const LabelBlock& dimensions = core.inner("DIMENSIONS");
    info_.width = dimensions.count("SAMPLES", 1, kMostSamples);
    info_.height = dimensions.count("LINES", 1, kMostSamples);
    const std::int64_t bands = dimensions.count("BANDS", 1, kMostBands, 1);
    const std::string format = core.word("FORMAT");
    if (format != "TILE" && format != "BANDSEQUENTIAL") core.refuse("FORMAT", "Tile or BandSequential");
    tile_.path = info_.path;
    tile_.sample_type = info_.sample_type;
    tile_.width = format == "TILE" ? core.count("TILESAMPLES", 1, kMostSamples) : info_.width;
    tile_.height = format == "TILE" ? core.count("TILELINES", 1, kMostSamples) : info_.height;
    tiles_across_ = (info_.width + tile_.width - 1) / tile_.width;
    const std::int64_t tiles_down = (info_.height + tile_.height - 1) / tile_.height;
    const auto begin = static_cast<std::uint64_t>(core.count("STARTBYTE", 1, std::int64_t{1} << 50)) - 1;
    if (begin < label_bytes) core.refuse("STARTBYTE", fmt::format("behind the label, which has {} bytes", label_bytes));
    const auto size = static_cast<double>(size_bytes(info_.sample_type));
    const double band_bytes =
        static_cast<double>(tiles_across_ * tile_.width) * static_cast<double>(tiles_down * tile_.height) * size;
    const double end = static_cast<double>(begin) + band_bytes * static_cast<double>(bands);
    if (static_cast<double>(file_->size_bytes()) < end) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: ends early: {} bytes, {} x {} samples in {} bands need {:.0f}", info_.path,
                              file_->size_bytes(), info_.width, info_.height, bands, end));
    }
    layout_.offset_bytes =
        begin + static_cast<std::uint64_t>(choose_band(info_, options, bands)) * static_cast<std::uint64_t>(band_bytes);
  }

  void read_mapping(const LabelBlock& mapping) {
    const double east = mapping.word("LONGITUDEDIRECTION") == "POSITIVEWEST" ? -1.0 : 1.0;
    const auto number = [&](const char* key, double otherwise = 0.0) {
      return mapping.number(key).value_or(otherwise);
    };
    PlanetaryMap map;
    map.projection = mapping.text("PROJECTIONNAME").value_or("unknown projection");
    map.target = mapping.text("TARGETNAME").value_or("");
    map.name = fmt::format("{} {}", map.projection, map.target);
    map.equatorial_radius_m = mapping.metres("EQUATORIALRADIUS", "m");
    map.polar_radius_m = mapping.metres("POLARRADIUS", "m");
    map.planetographic = mapping.word("LATITUDETYPE") == "PLANETOGRAPHIC";
    map.longitude = east * number("CENTERLONGITUDE");
    map.latitude = number("CENTERLATITUDE");
    map.scale = number("SCALEFACTOR", 1.0);
    map.parallel_1 = number("FIRSTSTANDARDPARALLEL");
    map.parallel_2 = number("SECONDSTANDARDPARALLEL");
    map.pole = {east * number("POLELONGITUDE"), number("POLELATITUDE", 90.0)};
    map.pole_rotation = number("POLEROTATION");
    map.distance_m = number("DISTANCE") * 1000.0;
    take_planetary_map(map, info_);
    const double resolution = mapping.metres("PIXELRESOLUTION", "m").value_or(0.0);
    if (number("ROTATION") != 0.0) return lose_place("the map is rotated");
    if (!(resolution > 0.0)) return lose_place("the group Mapping gives no PixelResolution in metres");
    const auto x = mapping.metres("UPPERLEFTCORNERX", "m");
    const auto y = mapping.metres("UPPERLEFTCORNERY", "m");
    place_by_corner(x.value_or(0.0), y.value_or(0.0), resolution, resolution);
    info_.georeference.has_origin = x && y;
    if (x && y) return;
    info_.warnings.push_back(
        loss("the group Mapping gives no UpperLeftCornerX and Y in metres; the origin is unknown"));
  }

  SourceInfo tile_;  ///< one tile as a raster
  std::int64_t tiles_across_ = 0;
  std::vector<std::byte> piece_;
};

bool looks_like_isis3(std::span<const std::byte> head) {
  std::string text;
  for (const std::byte b : head) {
    const auto c = std::to_integer<unsigned char>(b);
    if (std::isspace(c) == 0) text += static_cast<char>(std::tolower(c));
  }
  return text.starts_with("object=isiscube");
}

std::unique_ptr<HeightSource> open_isis3(const std::string& path, const OpenOptions& options) {
  return std::make_unique<Isis3Source>(path, read_label(path), options);
}

}  // namespace

const Format kIsis3Format = {.name = "ISIS3 cube",
                             .extensions = {".cub", ".lbl"},
                             .note = "takes `channel`",
                             .open = open_isis3,
                             .recognises = looks_like_isis3};

}  // namespace isohf
