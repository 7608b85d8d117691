#include "formats/readers.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/grid_header.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kLongestHeader = 65536;

/// The header words that say something of the samples; others are passed over.
constexpr std::array<std::string_view, 25> kWords = {
    "nrows",     "nrow",      "ncols",        "ncol",         "nbands",      "nbits",  "pixeltype",
    "byteorder", "layout",    "skipbytes",    "nodata",       "nodatavalue", "ulxmap", "ulymap",
    "xdim",      "ydim",      "bandrowbytes", "cellsize",     "dx",          "dy",     "xllcorner",
    "yllcorner", "xllcenter", "yllcenter",    "totalrowbytes"};

std::string extension_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

/// The first two words of a line, empty where it has fewer.
std::array<std::string_view, 2> two_words(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\f\v";
  std::array<std::string_view, 2> words;
  for (std::string_view& word : words) {
    line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
    word = line.substr(0, line.find_first_of(kBlanks));
    line.remove_prefix(word.size());
  }
  return words;
}

struct Pair {
  std::string data;
  std::string header;
};

std::string data_beside(const std::string& header) {
  std::vector<std::string> found;
  for (const char* extension : {".flt", ".bil", ".bip", ".bsq", ".dem", ".FLT", ".BIL", ".BIP", ".BSQ", ".DEM"}) {
    const auto candidate = std::filesystem::path(header).replace_extension(extension);
    if (is_file(candidate)) found.push_back(candidate.string());
  }
  if (found.size() == 1) return found.front();
  // x.bil.hdr belongs to x.bil.
  if (found.empty() && is_file(std::filesystem::path(header).replace_extension())) {
    return std::filesystem::path(header).replace_extension().string();
  }
  if (found.empty()) {
    throw Error(ErrorCode::kIo,
                header +
                    ": is the header of a grid whose data is not beside it; a .flt, .bil, .bip or .bsq of the same "
                    "name must be there");
  }
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: is a header beside {} and {}; name the one to be read", header, found[0], found[1]));
}

Pair pair_of(const std::string& path) {
  if (extension_of(path) == ".hdr") return {data_beside(path), path};
  for (const char* extension : {".hdr", ".HDR"}) {
    const auto replaced = std::filesystem::path(path).replace_extension(extension);
    if (is_file(replaced)) return {path, replaced.string()};
    if (is_file(path + extension)) return {path, path + extension};
  }
  throw Error(ErrorCode::kIo, fmt::format("{}: its header {} is not there; it must be beside it, or `raw` WxH:TYPE say "
                                          "what the samples are",
                                          path, std::filesystem::path(path).replace_extension(".hdr").string()));
}

GridHeader read_header(const std::string& path) {
  const RawFile file(path);
  std::string text(std::min<std::uint64_t>(file.size_bytes(), kLongestHeader + 1), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  if (text.size() > kLongestHeader) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: is longer than {} bytes, which no grid's header is", path, kLongestHeader));
  }
  GridHeader header(path);
  std::string_view rest = text;
  for (std::uint64_t line = 1; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const auto [name, value] = two_words(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::string plain = GridHeader::plain_name(name);
    if (std::find(kWords.begin(), kWords.end(), plain) == kWords.end() || plain.empty()) continue;
    if (value.empty()) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} has no value", path, line, printable(name)));
    }
    header.add(name, value, line);
  }
  return header;
}

class HeaderGridSource final : public PlainSource {
 public:
  HeaderGridSource(const Pair& files, const OpenOptions& options)
      : PlainSource(files.data, extension_of(files.data) == ".flt" ? "GridFloat" : "EHdr", options),
        header_path_(files.header) {
    (void)choose_band(info_, options, 1);
    const bool grid_float = info_.format == "GridFloat";
    const GridHeader header = read_header(files.header);
    header.read_size(info_);
    require_one_band(header);
    read_type(header, grid_float);
    read_byte_order(header);
    read_layout(header);
    header.read_place(info_);
    read_world_file();
    header.read_void(info_);
    read_files_beside(info_, 1);
    if (is_floating(info_.sample_type) && info_.void_values.empty()) {
      info_.valid_min = -kBeyondAnyHeight;
      info_.valid_max = kBeyondAnyHeight;
    }
    info_.block_width = info_.width;
    apply_open_options(info_, options);
  }

 private:
  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const {
    throw Error(code, header_path_ + ": " + what);
  }

  /// A world file beside the samples (.blw, .bqw, .flw) places them where the header does not.
  void read_world_file() {
    const std::optional<WorldFile> world = world_file_beside(info_.path);
    if (!world) return;
    if (world->rows_from_south()) {
      throw Error(ErrorCode::kUnsupported, world->path + ": dy is positive; rows must run from North to South");
    }
    Georeference& place = info_.georeference;
    if (!place.has_origin) return place_by(*world, info_.height, place);
    const double off = std::max({std::abs(world->x0 - place.origin_x), std::abs(world->dx - place.spacing_x),
                                 std::abs(world->y0 - place.origin_y), std::abs(-world->dy - place.spacing_y)});
    if (off > 1e-3 * std::min(place.spacing_x, place.spacing_y)) {
      info_.warnings.push_back(fmt::format("{} places the samples elsewhere than the header, which is followed",
                                           std::filesystem::path(world->path).filename().string()));
    }
  }

  void require_one_band(const GridHeader& header) const {
    const std::int64_t bands = header.count({"nbands"}, 1).value_or(1);
    if (bands != 1) refuse(ErrorCode::kUnsupported, fmt::format("nbands is {}; isohf reads grids of one band", bands));
    const std::string layout = lower_case(header.text({"layout"}).value_or("bil"));
    if (layout != "bil" && layout != "bip" && layout != "bsq") {
      refuse(ErrorCode::kUnsupported, fmt::format("layout is \"{}\", must be BIL, BIP or BSQ", printable(layout)));
    }
  }

  void read_type(const GridHeader& header, bool grid_float) {
    const std::int64_t bits = header.count({"nbits"}, 1).value_or(grid_float ? 32 : 8);
    const std::string given = lower_case(header.text({"pixeltype"}).value_or(""));
    std::string type = given;
    if (type.empty()) type = grid_float ? "float" : bits == 8 ? "unsignedint" : "signedint";
    struct Row {
      std::string_view type;
      std::int64_t bits;
      SampleType sample;
    };
    constexpr std::array<Row, 8> kTypes = {{{"unsignedint", 8, SampleType::kUint8},
                                            {"unsignedint", 16, SampleType::kUint16},
                                            {"unsignedint", 32, SampleType::kUint32},
                                            {"signedint", 8, SampleType::kInt8},
                                            {"signedint", 16, SampleType::kInt16},
                                            {"signedint", 32, SampleType::kInt32},
                                            {"float", 32, SampleType::kFloat32},
                                            {"float", 64, SampleType::kFloat64}}};
    const auto* row =
        std::find_if(kTypes.begin(), kTypes.end(), [&](const Row& r) { return r.type == type && r.bits == bits; });
    if (row == kTypes.end()) {
      refuse(
          ErrorCode::kUnsupported,
          fmt::format("pixeltype {} of {} bits; isohf reads signedint and unsignedint of 8, 16 and 32 bits and float "
                      "of 32 and 64",
                      printable(type), bits));
    }
    info_.sample_type = row->sample;
    if (given.empty() && type == "signedint") {
      info_.warnings.push_back(
          fmt::format("the header has no pixeltype: samples of {} bits are read as signed integers", bits));
    }
  }

  void read_byte_order(const GridHeader& header) {
    const auto given = header.text({"byteorder"});
    const std::string order = lower_case(given.value_or("i"));
    if (order == "m" || order == "msbfirst" || order == "msb") {
      layout_.big_endian = true;
    } else if (order != "i" && order != "lsbfirst" && order != "lsb") {
      refuse(ErrorCode::kUnsupported,
             fmt::format("byteorder is \"{}\", must be I or LSBFIRST, or M or MSBFIRST", printable(order)));
    }
    if (!given && size_bytes(info_.sample_type) > 1) {
      info_.warnings.emplace_back("the header has no byteorder: samples are read as little-endian");
    }
  }

  /// The file must have the bytes that the header says, the last row's padding perhaps left out.
  void read_layout(const GridHeader& header) {
    const std::uint64_t bytes = file_->size_bytes();
    const std::uint64_t size = size_bytes(info_.sample_type);
    const auto width = static_cast<std::uint64_t>(info_.width);
    const auto height = static_cast<std::uint64_t>(info_.height);
    layout_.offset_bytes = static_cast<std::uint64_t>(header.count({"skipbytes"}, 0).value_or(0));
    if (width > bytes / size) refuse_length(bytes, "more for one row alone");
    const std::uint64_t samples_bytes = width * size;
    const auto row = header.count({"totalrowbytes", "bandrowbytes"}, 1);
    layout_.row_bytes = row ? static_cast<std::uint64_t>(*row) : samples_bytes;
    if (layout_.row_bytes < samples_bytes) {
      refuse(ErrorCode::kCorrupt, fmt::format("rows have {} bytes, {} samples of {} bytes take {}", layout_.row_bytes,
                                              width, size, samples_bytes));
    }
    if (layout_.row_bytes > bytes || layout_.offset_bytes > bytes || height > bytes / layout_.row_bytes + 1) {
      refuse_length(bytes, "more");
    }
    const std::uint64_t all = layout_.offset_bytes + height * layout_.row_bytes;
    const std::uint64_t least = all - (layout_.row_bytes - samples_bytes);
    if (bytes < least || bytes > all) refuse_length(bytes, std::to_string(least));
  }

  [[noreturn]] void refuse_length(std::uint64_t bytes, const std::string& wanted) const {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the file has {} bytes, {} x {} samples of {} bytes as {} says take {}", info_.path,
                            bytes, info_.width, info_.height, size_bytes(info_.sample_type), header_path_, wanted),
                {info_.path, fmt::format("{} bytes", bytes), wanted + " bytes", ""});
  }

  std::string header_path_;
};

}  // namespace

bool looks_like_grid_header(std::span<const std::byte> head) {
  std::string_view text = text_of(head);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const std::string_view line = text.substr(0, text.find('\n'));
  const std::string name = GridHeader::plain_name(two_words(line)[0]);
  constexpr std::array<std::string_view, 13> kFirst = {
      "nbands", "nbits", "pixeltype", "byteorder",    "layout",        "skipbytes",   "ulxmap",
      "ulymap", "xdim",  "ydim",      "bandrowbytes", "totalrowbytes", "bandgapbytes"};
  return line.size() < text.size() && !name.empty() && std::find(kFirst.begin(), kFirst.end(), name) != kFirst.end();
}

std::unique_ptr<HeightSource> open_header_grid(const std::string& path, const OpenOptions& options) {
  if (has_envi_header(path)) return open_envi(path, options);
  return std::make_unique<HeaderGridSource>(pair_of(path), options);
}

}  // namespace isohf
