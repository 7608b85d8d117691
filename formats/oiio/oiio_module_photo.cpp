#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <limits>
#include <vector>

#include "formats/oiio/oiio_module_inside.h"

/// One image cache of its own for each photo.
struct IsohfOiioPhoto {
  OIIO::ImageCache* cache = nullptr;
  OIIO::ustring path;
  OIIO::ImageSpec spec;
  int channels = 3;
  bool is_linear = false;  ///< floats of light, to be coded as sRGB

  IsohfOiioPhoto() : cache(OIIO::ImageCache::create(false)) {}
  IsohfOiioPhoto(const IsohfOiioPhoto&) = delete;
  IsohfOiioPhoto& operator=(const IsohfOiioPhoto&) = delete;
  ~IsohfOiioPhoto() { OIIO::ImageCache::destroy(cache); }
};

namespace {

using isohf::Error;
using isohf::ErrorCode;
using isohf::guarded;
using isohf::put_text;

/// Rows that are cached together where the file has no tiles.
constexpr int kBandRows = 64;

int channels_of(const OIIO::ImageSpec& spec, std::string& warning) {
  if (spec.nchannels == 1 || spec.nchannels == 3) return spec.nchannels;
  if (spec.nchannels == 4 && spec.alpha_channel == 3) return 4;
  if (spec.nchannels == 4) {
    warning = "of the photo's 4 channels the first three are read as RGB";
    return 3;
  }
  throw Error(ErrorCode::kUnsupported,
              "has " + std::to_string(spec.nchannels) + " channels; photos are grey, RGB or RGBA");
}

bool is_random(const OIIO::ImageSpec& spec, const std::string& format) {
  return spec.tile_width > 0 || format == "tiff" || format == "openexr" || format == "bmp" || format == "dpx";
}

int bytes_in_cache(const OIIO::TypeDesc& type) {
  if (type == OIIO::TypeUInt8) return 1;
  return type == OIIO::TypeUInt16 || type == OIIO::TypeHalf ? 2 : 4;
}

void check(const OIIO::ImageSpec& spec) {
  if (spec.width < 1 || spec.height < 1) throw Error(ErrorCode::kCorrupt, "has no pixels");
  if (spec.deep || spec.depth > 1) throw Error(ErrorCode::kUnsupported, "is no flat picture");
  if (spec.get_int_attribute("oiio:Movie") != 0) throw Error(ErrorCode::kUnsupported, "is a film, not a photo");
}

void open_photo(IsohfOiioPhoto& photo, const char* path, IsohfOiioPhotoInfo& info) {
  photo.path = OIIO::ustring(path);
  photo.cache->attribute("autotile", kBandRows);
  photo.cache->attribute("autoscanline", 1);
  photo.cache->attribute("unassociatedalpha", 1);
  photo.cache->attribute("accept_untiled", 1);
  photo.cache->attribute("failure_retries", 0);
  // Opened without the cache first: its messages are clearer, and the format's name and tiles are the file's own.
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  const auto input = OIIO::ImageInput::open(path, &config);
  if (!input) throw Error(ErrorCode::kUnsupported, "OpenImageIO: " + OIIO::geterror());
  photo.spec = input->spec();
  const OIIO::ImageSpec& spec = photo.spec;
  check(spec);
  std::string warning;
  photo.channels = channels_of(spec, warning);
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  photo.is_linear = spec.format.is_floating_point() && !space.empty() && (space[0] == 'l' || space[0] == 'L');
  if (spec.get_int_attribute("Orientation", 1) != 1) {
    warning = "the photo's orientation tag is ignored: its first row is taken to be the northernmost";
  }
  info.width = spec.width;
  info.height = spec.height;
  info.block_height = spec.tile_width > 0 ? spec.tile_height : kBandRows;
  info.pixel_bytes = std::int64_t{photo.channels} * bytes_in_cache(spec.format);
  info.channels = photo.channels;
  info.random_access = is_random(spec, input->format_name()) ? 1 : 0;
  put_text(info.format, input->format_name());
  put_text(info.warning, warning);
}

std::uint8_t coded(float light, bool is_alpha) {
  if (!(light > 0.0F)) return 0;
  if (light >= 1.0F) return 255;
  const float value =
      is_alpha ? light : (light <= 0.0031308F ? light * 12.92F : 1.055F * std::pow(light, 1.0F / 2.4F) - 0.055F);
  return static_cast<std::uint8_t>(value * 255.0F + 0.5F);
}

void read_photo(IsohfOiioPhoto& photo, int column, int row, int columns, int rows, std::uint8_t* samples) {
  const OIIO::ImageSpec& spec = photo.spec;
  const auto read = [&](const OIIO::TypeDesc& type, void* out) {
    const int x = spec.x + column;
    const int y = spec.y + row;
    if (photo.cache->get_pixels(photo.path, 0, 0, x, x + columns, y, y + rows, spec.z, spec.z + 1, 0, photo.channels,
                                type, out, OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride, 0, photo.channels)) {
      return;
    }
    throw Error(ErrorCode::kCorrupt, "rows " + std::to_string(row) + " to " + std::to_string(row + rows - 1) + ": " +
                                         photo.cache->geterror());
  };
  if (!photo.is_linear) return read(OIIO::TypeUInt8, samples);
  const auto channels = static_cast<std::size_t>(photo.channels);
  std::vector<float> light(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * channels);
  read(OIIO::TypeFloat, light.data());
  for (std::size_t i = 0; i < light.size(); ++i) samples[i] = coded(light[i], i % channels == 3);
}

}  // namespace

int isohf_oiio_open_photo(const char* path, IsohfOiioPhoto** photo, IsohfOiioPhotoInfo* info,
                          IsohfOiioMessage* message) {
  return guarded(message, [&] {
    auto opened = std::make_unique<IsohfOiioPhoto>();
    *info = {};
    open_photo(*opened, path, *info);
    *photo = opened.release();
  });
}

int isohf_oiio_read_photo(IsohfOiioPhoto* photo, int64_t column, int64_t row, int64_t columns, int64_t rows,
                          uint8_t* samples, size_t bytes, IsohfOiioMessage* message) {
  return guarded(message, [&] {
    if (static_cast<size_t>(columns * rows) * static_cast<size_t>(photo->channels) != bytes) {
      throw Error(ErrorCode::kInvalidArgument, "the window and its buffer differ in size");
    }
    read_photo(*photo, static_cast<int>(column), static_cast<int>(row), static_cast<int>(columns),
               static_cast<int>(rows), samples);
  });
}

void isohf_oiio_bound_photo(IsohfOiioPhoto* photo, int64_t bytes) {
  const std::int64_t megabytes = std::max<std::int64_t>(bytes >> 20U, 1);
  photo->cache->attribute("max_memory_MB",
                          static_cast<float>(std::min<std::int64_t>(megabytes, std::numeric_limits<int>::max())));
}

void isohf_oiio_close_photo(IsohfOiioPhoto* photo) {
  delete photo;
}
