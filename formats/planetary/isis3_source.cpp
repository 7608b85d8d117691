#include "formats/readers.h"
#include "isohf/projection/body.h"
#include "isohf/projection/length_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/georeference/map_wkt.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/open_options.h"
#include "formats/planetary/label_text.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::int64_t kPieceBytes = std::int64_t{1} << 20;

struct PixelType {
  const char* name;
  SampleType type;
  double null;       ///< what lies outside of the next two is special as well
  double valid_min;  ///< ISIS, SpecialPixel.h
  double valid_max;
};

const std::array<PixelType, 5>& pixel_types() {
  static const std::array<PixelType, 5> types = {{
      {"UNSIGNEDBYTE", SampleType::kUint8, 0.0, 1.0, 254.0},
      {"SIGNEDWORD", SampleType::kInt16, -32768.0, -32752.0, 32767.0},
      {"UNSIGNEDWORD", SampleType::kUint16, 0.0, 3.0, 65522.0},
      {"UNSIGNEDINTEGER", SampleType::kUint32, 0.0, 3.0, 4294967282.0},
      {"REAL", SampleType::kFloat32, static_cast<double>(std::bit_cast<float>(0xFF7FFFFBU)),
       static_cast<double>(std::bit_cast<float>(0xFF7FFFFAU)), static_cast<double>(std::bit_cast<float>(0x7F7FFFFFU))},
  }};
  return types;
}

/// A positive length in metres, which are meant where no unit stands there; "meters/pixel" counts as metres.
std::optional<double> metres_by_default(const LabelFields& fields, const char* key) {
  const std::optional<double> number = fields.number(key);
  const std::string unit = fields.unit(key);
  const std::optional<LinearUnit> length = linear_unit(unit.empty() ? "m" : unit.substr(0, unit.find('/')));
  return number && length ? std::optional(*number * length->metres) : std::nullopt;
}

class Isis3Source final : public FileSource {
 public:
  Isis3Source(const std::string& path, const OpenOptions& options) : FileSource(path, "ISIS3 cube") {
    const LabelText label = read_label(path, options.unpacked_bytes);
    const LabelBlock& cube = inner(label.root, "ISISCUBE");
    read_core(inner(cube, "CORE"), label.end_bytes, options.unpacked_bytes);
    read_mapping(cube);
    first_bytes_ += static_cast<std::uint64_t>(choose_band(info_, options, bands_)) * band_bytes_;
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    for (std::int64_t row = window.row; row < window.row + window.rows;) {
      const std::int64_t rows = std::min(window.row + window.rows, (row / tile_rows_ + 1) * tile_rows_) - row;
      for (std::int64_t column = window.column; column < window.column + window.columns;) {
        const std::int64_t columns =
            std::min(window.column + window.columns, (column / tile_columns_ + 1) * tile_columns_) - column;
        read_part({column, row, columns, rows}, window, samples);
        column += columns;
      }
      row += rows;
    }
    if (big_endian_) swap_byte_order(samples, static_cast<std::size_t>(size_));
  }

 private:
  [[nodiscard]] const LabelBlock& inner(const LabelBlock& block, const char* name) const {
    for (const LabelBlock& each : block.blocks) {
      if (each.name == name) return each;
    }
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: there is no {} in {}", info_.path, block.line,
                                                 name, block.name.empty() ? "the label" : block.name));
  }

  void read_core(const LabelBlock& core, std::uint64_t label_bytes, std::uint64_t unpacked_bytes) {
    const LabelFields fields(info_.path, core);
    std::uint64_t first_free = label_bytes;
    std::string data_path = info_.path;
    if (core.entry("^CORE") != nullptr) {
      data_path = core_file(fields, core.entry("^CORE")->line);
      first_free = 0;
    }
    file_.emplace(data_path, unpacked_bytes);
    const LabelFields dimensions(info_.path, inner(core, "DIMENSIONS"));
    info_.width = dimensions.count("SAMPLES", 1, kMostSamples);
    info_.height = dimensions.count("LINES", 1, kMostSamples);
    bands_ = dimensions.count("BANDS", 1, kMostBands, 1);
    read_pixels(LabelFields(info_.path, inner(core, "PIXELS")));
    const std::string format = fields.word("FORMAT").value_or("");
    if (format == "TILE") {
      tile_columns_ = fields.count("TILESAMPLES", 1, kMostSamples);
      tile_rows_ = fields.count("TILELINES", 1, kMostSamples);
    } else if (format == "BANDSEQUENTIAL") {
      tile_columns_ = info_.width;
      tile_rows_ = info_.height;
    } else {
      fields.refuse("FORMAT", "Tile or BandSequential");
    }
    tiles_across_ = (info_.width + tile_columns_ - 1) / tile_columns_;
    const std::int64_t tiles_down = (info_.height + tile_rows_ - 1) / tile_rows_;
    const double total = static_cast<double>(tiles_across_ * tile_columns_) *
                         static_cast<double>(tiles_down * tile_rows_) * static_cast<double>(size_ * bands_);
    first_bytes_ = static_cast<std::uint64_t>(fields.count("STARTBYTE", 1, std::int64_t{1} << 50)) - 1;
    if (first_bytes_ < first_free) {
      fields.refuse("STARTBYTE", fmt::format("behind the label, which has {} bytes", first_free));
    }
    const auto wanted = static_cast<double>(first_bytes_) + total;
    if (!(wanted < kMostBytes) || static_cast<double>(file_->size_bytes()) < wanted) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: ends early: {} bytes, {} x {} samples in {} bands need {:.0f}", data_path,
                              file_->size_bytes(), info_.width, info_.height, bands_, wanted));
    }
    band_bytes_ = static_cast<std::uint64_t>(tiles_across_ * tiles_down * tile_columns_ * tile_rows_ * size_);
    info_.block_width = tile_columns_;
    info_.block_height = format == "TILE" ? std::min(tile_rows_, info_.height) : 1;
    if (tile_columns_ >= info_.width) {
      info_.block_width = info_.width;
      info_.block_height = 1;  // rows follow each other
    }
  }

  /// The file beside the label that holds the samples.
  [[nodiscard]] std::string core_file(const LabelFields& core, int line) const {
    const std::string name = core.text("^CORE").value_or("");
    const std::string found = name.find('/') == std::string::npos ? file_beside(info_.path, name) : std::string();
    if (!found.empty()) return found;
    throw Error(ErrorCode::kIo, fmt::format("{}: label line {}: ^Core names {}, which must be a file beside the label",
                                            info_.path, line, name));
  }

  void read_pixels(const LabelFields& pixels) {
    const std::string name = pixels.word("TYPE").value_or("");
    const auto& types = pixel_types();
    const auto* const type =
        std::find_if(types.begin(), types.end(), [&](const PixelType& t) { return name == t.name; });
    if (type == types.end()) {
      pixels.refuse("TYPE", "UnsignedByte, SignedWord, UnsignedWord, UnsignedInteger or Real");
    }
    info_.sample_type = type->type;
    info_.void_values = {type->null};
    info_.valid_min = type->valid_min;
    info_.valid_max = type->valid_max;
    size_ = static_cast<std::int64_t>(size_bytes(type->type));
    const std::string order = pixels.word("BYTEORDER").value_or("LSB");
    if (order != "LSB" && order != "MSB") pixels.refuse("BYTEORDER", "Lsb or Msb");
    big_endian_ = order == "MSB";
    info_.z_scale = pixels.number("MULTIPLIER").value_or(1.0);
    info_.z_offset = pixels.number("BASE").value_or(0.0);
    if (info_.z_scale == 0.0) pixels.refuse("MULTIPLIER", "other than 0");
  }

  void read_mapping(const LabelBlock& cube) {
    const auto groups = cube.all("MAPPING");
    if (groups.empty()) return;
    const LabelFields map(info_.path, *groups.front());
    Georeference& geo = info_.georeference;
    const std::string target = map.text("TARGETNAME").value_or("");
    geo.system.semi_major_axis_m = metres_by_default(map, "EQUATORIALRADIUS");
    const std::optional<double> polar = metres_by_default(map, "POLARRADIUS");
    if (const std::optional<double> a = geo.system.semi_major_axis_m) {
      geo.system.inverse_flattening = polar && *polar != *a ? *a / (*a - *polar) : 0.0;
    }
    geo.system.body = body_of(target, std::nullopt);
    if (geo.system.body.empty()) geo.system.body = target;
    geo.system.name = fmt::format("{} {}", map.text("PROJECTIONNAME").value_or("unknown projection"), target);
    PlanetaryMap planet{map.text("PROJECTIONNAME").value_or("unknown projection"),
                        target,
                        geo.system.semi_major_axis_m.value_or(0.0),
                        polar.value_or(0.0),
                        map.word("LATITUDETYPE").value_or("") == "PLANETOGRAPHIC",
                        {}};
    const bool to_west = map.word("LONGITUDEDIRECTION").value_or("") == "POSITIVEWEST";
    planet.parameters.longitude = map.number("CENTERLONGITUDE").value_or(0.0) * (to_west ? -1.0 : 1.0);
    planet.parameters.latitude = map.number("CENTERLATITUDE").value_or(0.0);
    planet.parameters.scale = map.number("SCALEFACTOR").value_or(1.0);
    planet.parameters.parallel_1 = map.number("FIRSTSTANDARDPARALLEL").value_or(0.0);
    planet.parameters.parallel_2 = map.number("SECONDSTANDARDPARALLEL").value_or(0.0);
    planet.pole.latitude = map.number("POLELATITUDE").value_or(90.0);
    planet.pole.longitude = map.number("POLELONGITUDE").value_or(0.0) * (to_west ? -1.0 : 1.0);
    planet.pole_rotation = map.number("POLEROTATION").value_or(0.0);
    planet.distance_m = map.number("DISTANCE").value_or(0.0) * 1000.0;
    geo.system.wkt = planetary_wkt(planet, info_.warnings);
    if (map.number("ROTATION").value_or(0.0) != 0.0) {
      info_.warnings.push_back(loss("the map is rotated; its place is left out"));
      return;
    }
    const std::optional<double> resolution = metres_by_default(map, "PIXELRESOLUTION");
    if (!resolution || !(*resolution > 0.0)) {
      info_.warnings.push_back(loss("the group Mapping gives no PixelResolution in metres; the place is left out"));
      return;
    }
    geo.unit = HorizontalUnit::kMetre;
    geo.registration = Registration::kArea;
    geo.spacing_x = geo.spacing_y = *resolution;
    const std::optional<double> x = metres_by_default(map, "UPPERLEFTCORNERX");
    const std::optional<double> y = metres_by_default(map, "UPPERLEFTCORNERY");
    if (!x || !y) {
      info_.warnings.push_back(
          loss("the group Mapping gives no UpperLeftCornerX and Y in metres; the origin is unknown"));
      return;
    }
    geo.has_origin = true;
    geo.origin_x = *x + *resolution / 2.0;
    geo.origin_y = *y - *resolution / 2.0;
  }

  /// Reads `part`, which lies in one tile, into its place in `window`.
  void read_part(const Window& part, const Window& window, std::span<std::byte> samples) {
    const std::int64_t tile = part.row / tile_rows_ * tiles_across_ + part.column / tile_columns_;
    const std::uint64_t tile_bytes =
        static_cast<std::uint64_t>(tile_columns_ * size_) * static_cast<std::uint64_t>(tile_rows_);
    const std::uint64_t at = first_bytes_ + static_cast<std::uint64_t>(tile) * tile_bytes;
    const std::int64_t row_bytes = tile_columns_ * size_;
    const std::int64_t column = part.column % tile_columns_;
    // Most of a row wanted: several rows at once cost less than a call for each.
    const std::int64_t most =
        part.columns * 2 >= tile_columns_ ? std::max<std::int64_t>(1, kPieceBytes / row_bytes) : 1;
    for (std::int64_t r = 0; r < part.rows;) {
      const std::int64_t rows = std::min(most, part.rows - r);
      const std::int64_t row = part.row % tile_rows_ + r;
      std::byte* out =
          samples.data() + ((part.row + r - window.row) * window.columns + (part.column - window.column)) * size_;
      const auto run = static_cast<std::size_t>(part.columns * size_);
      const std::uint64_t begin = at + static_cast<std::uint64_t>(row * row_bytes + column * size_);
      if (rows == 1) {
        file_->read(begin, {out, run});
      } else {
        piece_.resize(static_cast<std::size_t>((rows - 1) * row_bytes) + run);
        file_->read(begin, piece_);
        for (std::int64_t i = 0; i < rows; ++i) {
          std::memcpy(out + i * window.columns * size_, piece_.data() + i * row_bytes, run);
        }
      }
      r += rows;
    }
  }

  std::uint64_t first_bytes_ = 0;  // of the band's first sample
  std::uint64_t band_bytes_ = 0;
  std::int64_t bands_ = 1;
  std::int64_t size_ = 2;  // bytes of a sample
  bool big_endian_ = false;
  std::int64_t tile_columns_ = 0;
  std::int64_t tile_rows_ = 0;
  std::int64_t tiles_across_ = 0;
  std::vector<std::byte> piece_;
};

}  // namespace

bool looks_like_isis3(std::span<const std::byte> head) {
  std::string text;
  for (const std::byte b : head) {
    const auto c = std::to_integer<unsigned char>(b);
    if (std::isspace(c) == 0) text += static_cast<char>(std::tolower(c));
  }
  return text.rfind("object=isiscube", 0) == 0;
}

std::unique_ptr<HeightSource> open_isis3(const std::string& path, const OpenOptions& options) {
  return std::make_unique<Isis3Source>(path, options);
}

}  // namespace isohf
