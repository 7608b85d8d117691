#include "formats/oiio/oiio_module.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "formats/module_inside.h"
#include "isohf/error.h"
#include "isohf/raster.h"

// The module is a library of its own: it shares headers with isohf, no code.
struct IsohfOiioRaster {
  std::unique_ptr<OIIO::ImageInput> input;
  OIIO::ImageSpec spec;
  OIIO::TypeDesc type;
  int channel = 0;
  int channels = 1;  ///< that are delivered, from `channel` on
  std::int64_t band_bytes = 0;
  std::vector<unsigned char> band;  ///< rows read around a window that does not end where the file's blocks do
};

namespace {

using isohf::Error;
using isohf::ErrorCode;
using isohf::put_text;
using isohf::SampleType;

/// `action` on the far side of the C boundary.
template <typename Action>
int guarded(IsohfOiioMessage* message, Action action) {
  return isohf::guarded(message, "OpenImageIO", ErrorCode::kCorrupt, action);
}

/// A header ends within it, or the file is none that isohf judges.
constexpr std::size_t kHeaderBytes = std::size_t{1} << 20U;

std::vector<unsigned char> head_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<unsigned char> head(kHeaderBytes);
  in.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

/// The largest value of a portable any-map (P1 to P6), which stands behind width and height; 0 where there is none.
long largest_value(const std::vector<unsigned char>& head) {
  std::array<long, 3> numbers{};
  std::size_t at = 2;
  for (long& number : numbers) {
    while (at < head.size() && (std::isspace(head[at]) != 0 || head[at] == '#')) {
      if (head[at] == '#') {
        while (at < head.size() && head[at] != '\n') ++at;
      } else {
        ++at;
      }
    }
    for (; at < head.size() && std::isdigit(head[at]) != 0 && number < 1000000; ++at) {
      number = 10 * number + (head[at] - '0');
    }
  }
  return numbers[2];
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::kUnsupported, what + "; store the raster as TIFF or PNG (gdal_translate does)");
}

/// OpenImageIO hands out pictures: where it would deliver other numbers than the file holds, the file is refused.
/// `bits` are those of a sample as delivered, `stored_bits` those in the file. A photo's may be spread and rounded.
void require_stored_numbers(const std::string& format, int bits, int stored_bits, bool is_floating, bool is_photo,
                            const std::string& path) {
  if (format == "fits") refuse("OpenImageIO displaces the rows of FITS images");
  if (!is_photo && format != "pnm" && stored_bits != bits) {
    refuse("the samples have " + std::to_string(stored_bits) + " bits, and OpenImageIO spreads them over " +
           std::to_string(bits));
  }
  if (is_photo || format != "pnm") return;
  if (bits == 16) refuse("OpenImageIO rounds the samples of any-maps of 16 bits");
  if (!is_floating) {
    const long largest = largest_value(head_of(path));
    if (largest != 255) {
      refuse("the largest value is stated as " + std::to_string(largest) +
             ", and OpenImageIO spreads the samples over 0 to 255");
    }
  }
}

/// Windows narrower than the raster, or in tiles, are cut out of bands of about this size.
constexpr std::int64_t kBandBytes = std::int64_t{8} << 20U;
/// One row of blocks may not be larger.
constexpr std::int64_t kMaxBlockRowBytes = std::int64_t{1} << 30U;

SampleType sample_type_of(const OIIO::TypeDesc& type) {
  switch (type.basetype) {
    case OIIO::TypeDesc::UINT8:
      return SampleType::kUint8;
    case OIIO::TypeDesc::INT8:
      return SampleType::kInt8;
    case OIIO::TypeDesc::UINT16:
      return SampleType::kUint16;
    case OIIO::TypeDesc::INT16:
      return SampleType::kInt16;
    case OIIO::TypeDesc::UINT32:
      return SampleType::kUint32;
    case OIIO::TypeDesc::INT32:
      return SampleType::kInt32;
    case OIIO::TypeDesc::HALF:
      return SampleType::kFloat16;
    case OIIO::TypeDesc::FLOAT:
      return SampleType::kFloat32;
    case OIIO::TypeDesc::DOUBLE:
      return SampleType::kFloat64;
    default:
      throw Error(ErrorCode::kUnsupported, "OpenImageIO: samples of type " + std::string(type.c_str()));
  }
}

int channel_index(const OIIO::ImageSpec& spec, const std::string& wanted) {
  if (wanted.empty()) return 0;
  std::string names;
  for (int at = 0; at < spec.nchannels; ++at) {
    const std::string name = spec.channel_name(at);
    if (wanted == name || wanted == std::to_string(at)) return at;
    names += (names.empty() ? "" : ", ") + name;
  }
  throw Error(ErrorCode::kInvalidArgument, "has no channel \"" + wanted + "\"; it has " + names + " (or 0..." +
                                               std::to_string(spec.nchannels - 1) + ")");
}

void check(const OIIO::ImageSpec& spec) {
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
    throw Error(ErrorCode::kCorrupt, "OpenImageIO: raster of " + std::to_string(spec.width) + " x " +
                                         std::to_string(spec.height) + " samples");
  }
  if (spec.deep) throw Error(ErrorCode::kUnsupported, "OpenImageIO: deep picture");
  if (spec.depth > 1) throw Error(ErrorCode::kUnsupported, "OpenImageIO: volume, not a raster");
  if (spec.get_int_attribute("oiio:Movie") != 0)
    throw Error(ErrorCode::kUnsupported, "OpenImageIO: film, not a raster");
  const std::int64_t rows = spec.tile_width > 0 ? spec.tile_height : 1;
  const auto pixel_bytes = static_cast<std::int64_t>(spec.pixel_bytes(true));
  if (std::int64_t{spec.width} * rows > kMaxBlockRowBytes / std::max<std::int64_t>(pixel_bytes, 1)) {
    throw Error(ErrorCode::kUnsupported, "OpenImageIO: one row of blocks is larger than 1 GiB");
  }
}

/// False where the file is of no format that OpenImageIO knows.
bool open_raster(IsohfOiioRaster& raster, const char* path, const std::string& channel, IsohfOiioInfo& info) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // numbers as stored, not multiplied by alpha
  config.attribute("oiio:RawColor", 1);
  {
    // Of a name that says nothing OpenImageIO tries every format, DICOM among them, which reads through zeros for minutes.
    constexpr std::uintmax_t kMostToTry = std::uintmax_t{16} << 20U;
    static std::mutex one_at_a_time;  // the attribute is the library's
    const std::lock_guard lock(one_at_a_time);
    std::error_code unknown;
    OIIO::attribute("try_all_readers", std::filesystem::file_size(path, unknown) <= kMostToTry ? 1 : 0);
    raster.input = OIIO::ImageInput::open(path, &config);
  }
  if (!raster.input) {
    const std::string why = OIIO::geterror();
    if (why.find("could not find a format reader") != std::string::npos) return false;
    throw Error(ErrorCode::kCorrupt, "OpenImageIO: " + why);
  }
  raster.spec = raster.input->spec();
  const OIIO::ImageSpec& spec = raster.spec;
  check(spec);
  const auto bits = static_cast<int>(8 * spec.format.size());
  const bool is_photo = channel == ISOHF_OIIO_PHOTO;
  require_stored_numbers(raster.input->format_name(), bits, spec.get_int_attribute("oiio:BitsPerSample", bits),
                         spec.format.is_floating_point(), is_photo, path);
  raster.band_bytes = kBandBytes;
  const bool all = is_photo || channel == ISOHF_OIIO_ALL_CHANNELS;
  raster.channel = all ? 0 : channel_index(spec, channel);
  raster.channels = all ? spec.nchannels : 1;
  raster.type = all ? spec.format : spec.channelformat(raster.channel);
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  info.channels = raster.channels;
  info.alpha = spec.alpha_channel;
  info.is_linear = !space.empty() && (space[0] == 'l' || space[0] == 'L') ? 1 : 0;
  info.width = spec.width;
  info.height = spec.height;
  info.block_width = spec.tile_width > 0 ? std::min(spec.tile_width, spec.width) : spec.width;
  info.block_height = spec.tile_width > 0 ? std::min(spec.tile_height, spec.height) : 1;
  info.sample_type = static_cast<int32_t>(sample_type_of(raster.type));
  put_text(info.format, raster.input->format_name());
  std::string warning;
  if (spec.nchannels > 1 && !all) put_text(info.channel, spec.channel_name(raster.channel));
  if (spec.nchannels > 1 && channel.empty()) {
    warning = "channel " + std::string(spec.channel_name(0)) + " is read, of " + std::to_string(spec.nchannels);
  }
  put_text(info.warning, warning);
  return true;
}

/// Reads whole rows [begin, end) of the channel into `out`; in a tiled file begin and end lie between tiles.
void read_rows(IsohfOiioRaster& raster, int begin, int end, void* out) {
  const OIIO::ImageSpec& spec = raster.spec;
  const int from = spec.y + begin;
  const int to = spec.y + end;
  const bool done = spec.tile_width > 0
                        ? raster.input->read_tiles(0, 0, spec.x, spec.x + spec.width, from, to, spec.z, spec.z + 1,
                                                   raster.channel, raster.channel + raster.channels, raster.type, out)
                        : raster.input->read_scanlines(0, 0, from, to, spec.z, raster.channel,
                                                       raster.channel + raster.channels, raster.type, out);
  if (done) return;
  throw Error(ErrorCode::kCorrupt,
              "rows " + std::to_string(begin) + " to " + std::to_string(end - 1) + ": " + raster.input->geterror());
}

/// Of all channels that are delivered.
std::size_t pixel_bytes(const IsohfOiioRaster& raster) {
  return raster.type.size() * static_cast<std::size_t>(raster.channels);
}

/// Rows of blocks that a band has room for, at least one.
std::int64_t band_rows(const IsohfOiioRaster& raster, std::int64_t bytes) {
  const std::int64_t step = raster.spec.tile_width > 0 ? raster.spec.tile_height : 1;
  const std::int64_t row_bytes = std::int64_t{raster.spec.width} * static_cast<std::int64_t>(pixel_bytes(raster));
  return std::max(bytes / row_bytes / step * step, step);
}

void read_window(IsohfOiioRaster& raster, int column, int row, int columns, int rows, unsigned char* out) {
  const OIIO::ImageSpec& spec = raster.spec;
  const bool tiled = spec.tile_width > 0;
  if (!tiled && columns == spec.width) return read_rows(raster, row, row + rows, out);
  const std::size_t size = pixel_bytes(raster);
  const std::size_t row_bytes = static_cast<std::size_t>(spec.width) * size;
  const std::size_t out_bytes = static_cast<std::size_t>(columns) * size;
  const std::int64_t step = tiled ? spec.tile_height : 1;
  const std::int64_t most_rows = band_rows(raster, raster.band_bytes);
  const int end = row + rows;
  while (row < end) {
    const auto begin = static_cast<int>(row / step * step);
    const std::int64_t wanted = (end - begin + step - 1) / step * step;
    const auto stop = static_cast<int>(std::min<std::int64_t>(begin + std::min(wanted, most_rows), spec.height));
    raster.band.resize(static_cast<std::size_t>(stop - begin) * row_bytes);
    read_rows(raster, begin, stop, raster.band.data());
    for (; row < std::min(stop, end); ++row, out += out_bytes) {
      std::memcpy(out,
                  raster.band.data() + static_cast<std::size_t>(row - begin) * row_bytes +
                      static_cast<std::size_t>(column) * size,
                  out_bytes);
    }
  }
}

int module_open(const char* path, const char* channel, IsohfOiioRaster** raster, IsohfOiioInfo* info,
                IsohfOiioMessage* message) {
  bool known = true;
  const int result = guarded(message, [&] {
    auto opened = std::make_unique<IsohfOiioRaster>();
    *info = {};
    known = open_raster(*opened, path, channel, *info);
    if (known) *raster = opened.release();
  });
  return known ? result : ISOHF_OIIO_UNKNOWN;
}

int module_read(IsohfOiioRaster* raster, int64_t column, int64_t row, int64_t columns, int64_t rows, void* samples,
                size_t bytes, IsohfOiioMessage* message) {
  return guarded(message, [&] {
    if (static_cast<size_t>(columns * rows) * pixel_bytes(*raster) != bytes) {
      throw Error(ErrorCode::kInvalidArgument, "the window and its buffer differ in size");
    }
    read_window(*raster, static_cast<int>(column), static_cast<int>(row), static_cast<int>(columns),
                static_cast<int>(rows), static_cast<unsigned char*>(samples));
  });
}

void module_bound(IsohfOiioRaster* raster, int64_t bytes) {
  raster->band_bytes = std::min(kBandBytes, bytes);
  raster->band = {};
}

int64_t module_buffer_bytes(const IsohfOiioRaster* raster, int64_t bytes) {
  const OIIO::ImageSpec& spec = raster->spec;
  return std::min<std::int64_t>(band_rows(*raster, std::min(kBandBytes, bytes)), spec.height) * spec.width *
         static_cast<std::int64_t>(pixel_bytes(*raster));
}

void module_close(IsohfOiioRaster* raster) {
  delete raster;
}

const char* module_library() {
  static const std::string text = "OpenImageIO " + std::to_string(OIIO::openimageio_version() / 10000) + "." +
                                  std::to_string(OIIO::openimageio_version() / 100 % 100) + "." +
                                  std::to_string(OIIO::openimageio_version() % 100);
  return text.c_str();
}

/// OpenImageIO has them as "bmp:bmp,dib;cineon:cin;...", formats that it only writes as well.
const char* module_extensions() {
  static const std::string text = [] {
    std::string readable(1, ',');
    readable += std::string(OIIO::get_string_attribute("input_format_list"));
    readable += ',';
    const std::string all{OIIO::get_string_attribute("extension_list")};
    std::string list;
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t end = std::min(all.find(';', at), all.size());
      const std::size_t colon = std::min(all.find(':', at), end);
      std::string name(1, ',');
      name.append(all, at, colon - at);
      name += ',';
      if (readable.find(name) != std::string::npos && colon < end) {
        std::string extensions = all.substr(colon + 1, end - colon - 1);
        std::replace(extensions.begin(), extensions.end(), ',', ' ');
        if (!list.empty()) list += ' ';
        list += extensions;
      }
      at = end + 1;
    }
    return list;
  }();
  return text.c_str();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const IsohfOiioModule* isohf_oiio_module() {
  static const IsohfOiioModule module = {ISOHF_OIIO_ABI,      module_open,  module_read,    module_bound,
                                         module_buffer_bytes, module_close, module_library, module_extensions};
  return &module;
}
