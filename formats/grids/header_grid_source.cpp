#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/grids/grid_header.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The plain names of header words that say something of the samples; others are ignored.
constexpr std::array<std::string_view, 21> kKnown = {
    "nrows",         "ncols",        "nbands",   "nbits",     "pixeltype", "byteorder", "layout",
    "skipbytes",     "nodata",       "ulxmap",   "ulymap",    "dx",        "dy",        "bandrowbytes",
    "totalrowbytes", "bandgapbytes", "cellsize", "xllcorner", "yllcorner", "xllcenter", "yllcenter"};

bool is_known(std::string_view name) {
  return std::ranges::find(kKnown, GridHeader::plain_name(name)) != kKnown.end();
}

/// The first two words of a line, empty if it has fewer.
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

std::string samples_of(const std::string& header) {
  const std::string stem = std::filesystem::path(header).stem().string();
  std::vector<std::string> found;
  for (const char* extension : {".flt", ".bil", ".bip", ".bsq", ".dem"}) {
    if (std::string samples = file_beside(header, stem + extension); !samples.empty()) found.push_back(samples);
  }
  if (found.empty()) found.push_back(file_beside(header, stem));  // x.bil.hdr belongs to x.bil
  if (found.size() > 1) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: is a header beside {} and {}; name the one to be read", header, found[0], found[1]));
  }
  if (!found[0].empty()) return found[0];
  throw Error(ErrorCode::kIo, header +
                                  ": is the header of a grid whose data is not beside it; a .flt, .bil, .bip or "
                                  ".bsq of the same name must be there");
}

std::string header_of(const std::string& samples) {
  const std::filesystem::path path(samples);
  for (const std::string& name : {path.stem().string(), path.filename().string()}) {
    if (std::string header = file_beside(samples, name + ".hdr"); !header.empty()) return header;
  }
  throw Error(ErrorCode::kIo, fmt::format("{}: its header {} is not there; it must be beside it, or `raw` WxH:TYPE say "
                                          "what the samples are",
                                          samples, std::filesystem::path(path).replace_extension(".hdr").string()));
}

GridHeader read_header(const std::string& path) {
  const std::string text = read_header_text(path);
  GridHeader header(path);
  std::string_view rest = text;
  for (std::uint64_t line = 1; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const auto [name, value] = two_words(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (!is_known(name)) continue;
    if (value.empty()) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} has no value", path, line, printable(name)));
    }
    header.add(name, value, line);
  }
  return header;
}

class HeaderGridSource final : public DescribedSource {
 public:
  HeaderGridSource(const std::string& samples, const std::string& header_path, const OpenOptions& options)
      : DescribedSource(samples, extension_of(samples) == ".flt" ? "GridFloat" : "EHdr", header_path) {
    (void)choose_band(info_, options, 1);
    const GridHeader header = read_header(header_path);
    header.read_size(info_);
    set_size(static_cast<double>(info_.width), static_cast<double>(info_.height));
    require_one_band(header);
    read_type(header);
    read_byte_order(header);
    read_layout(header);
    header.read_place(info_);
    read_world_file();
    header.read_nodata(info_);
    finish(options);
  }

 private:
  void require_one_band(const GridHeader& header) const {
    const std::int64_t bands = header.count("nbands", 1).value_or(1);
    if (bands != 1) refuse(ErrorCode::kUnsupported, fmt::format("nbands is {}; isohf reads grids of one band", bands));
    const std::string layout = header.text("layout").value_or("bil");
    if (layout == "bil" || layout == "bip" || layout == "bsq") return;
    refuse(ErrorCode::kUnsupported, fmt::format("layout is \"{}\", must be BIL, BIP or BSQ", printable(layout)));
  }

  void read_type(const GridHeader& header) {
    using enum SampleType;
    constexpr std::pair<std::string_view, SampleType> kTypes[] = {
        {"unsignedint8", kUint8}, {"unsignedint16", kUint16}, {"unsignedint32", kUint32}, {"float32", kFloat32},
        {"signedint8", kInt8},    {"signedint16", kInt16},    {"signedint32", kInt32},    {"float64", kFloat64}};
    const bool is_float = info_.format == "GridFloat";
    const std::int64_t bits = header.count("nbits", 1).value_or(is_float ? 32 : 8);
    const std::string type = header.text("pixeltype")
                                 .value_or(is_float    ? "float"
                                           : bits == 8 ? "unsignedint"
                                                       : "signedint");
    const auto* const found =
        std::ranges::find(kTypes, fmt::format("{}{}", type, bits), &std::pair<std::string_view, SampleType>::first);
    if (found == std::end(kTypes)) {
      refuse(ErrorCode::kUnsupported,
             fmt::format("pixeltype {} of {} bits; isohf reads signedint and unsignedint of 8, 16 and 32 bits and "
                         "float of 32 and 64",
                         printable(type), bits));
    }
    info_.sample_type = found->second;
    if (!header.has("pixeltype") && type == "signedint") {
      info_.warnings.push_back(
          fmt::format("the header has no pixeltype: samples of {} bits are read as signed integers", bits));
    }
  }

  void read_byte_order(const GridHeader& header) {
    const std::string order = header.text("byteorder").value_or("i");
    layout_.big_endian = order == "m" || order == "msbfirst" || order == "msb";
    if (!layout_.big_endian && order != "i" && order != "lsbfirst" && order != "lsb") {
      refuse(ErrorCode::kUnsupported,
             fmt::format("byteorder is \"{}\", must be I or LSBFIRST, or M or MSBFIRST", printable(order)));
    }
    if (!header.has("byteorder") && size_bytes(info_.sample_type) > 1) {
      info_.warnings.emplace_back("the header has no byteorder: samples are read as little-endian");
    }
  }

  /// The file must have exactly the bytes that the header says; the last row's padding may be left out.
  void read_layout(const GridHeader& header) {
    const std::uint64_t samples_bytes = static_cast<std::uint64_t>(info_.width) * size_bytes(info_.sample_type);
    const auto row = header.has("totalrowbytes") ? header.count("totalrowbytes", 1) : header.count("bandrowbytes", 1);
    layout_.offset_bytes = static_cast<std::uint64_t>(header.count("skipbytes", 0).value_or(0));
    layout_.row_bytes = row ? static_cast<std::uint64_t>(*row) : samples_bytes;
    if (layout_.row_bytes < samples_bytes) {
      refuse(ErrorCode::kCorrupt, fmt::format("rows have {} bytes, {} {} samples take {}", layout_.row_bytes,
                                              info_.width, to_string(info_.sample_type), samples_bytes));
    }
    const double end = layout_.end_bytes(info_);
    const auto bytes = static_cast<double>(file_->size_bytes());
    if (bytes >= end && bytes <= end + static_cast<double>(layout_.row_bytes - samples_bytes)) return;
    const std::string wanted = std::isfinite(end) ? fmt::format("{:.0f}", end) : "more than any file has";
    throw Error(
        ErrorCode::kCorrupt,
        fmt::format("{}: the file has {} bytes, {} x {} {} samples as {} says take {}", info_.path, file_->size_bytes(),
                    info_.width, info_.height, to_string(info_.sample_type), header_, wanted),
        {info_.path, fmt::format("{} bytes", file_->size_bytes()), wanted + " bytes", ""});
  }

  /// A world file beside the samples (.blw, .bqw, .flw) places them if the header does not.
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
    if (off <= 1e-3 * std::min(place.spacing_x, place.spacing_y)) return;
    info_.warnings.push_back(world->path + " places the samples elsewhere than the header, which is followed");
  }
};

bool looks_like_grid_header(std::span<const std::byte> head) {
  std::string_view text = text_of(head);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.size() < text.size() && is_known(two_words(line)[0]);
}

std::unique_ptr<HeightSource> open_header_grid(const std::string& path, const OpenOptions& options) {
  if (kEnviFormat.described(path)) return kEnviFormat.open(path, options);
  const bool is_header = extension_of(path) == ".hdr";
  const std::string samples = is_header ? samples_of(path) : path;
  return std::make_unique<HeaderGridSource>(samples, is_header ? path : header_of(path), options);
}

}  // namespace

const Format kHeaderGridFormat = {.name = "GridFloat, EHdr, GTOPO30",
                                  .extensions = {".flt", ".bil", ".bip", ".bsq", ".dem", ".hdr"},
                                  .open = open_header_grid,
                                  .recognises = looks_like_grid_header,
                                  .goes_by_name = true};

}  // namespace isohf
