#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "formats/oiio/oiio_plugin.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// One row of blocks may not be larger.
constexpr std::int64_t kMaxBlockRowBytes = std::int64_t{1} << 30U;

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::kUnsupported, what);
}

SampleType sample_type_of(const OIIO::TypeDesc& type) {
  static const std::map<unsigned char, SampleType> types = {
      {OIIO::TypeDesc::UINT8, SampleType::kUint8},   {OIIO::TypeDesc::INT8, SampleType::kInt8},
      {OIIO::TypeDesc::UINT16, SampleType::kUint16}, {OIIO::TypeDesc::INT16, SampleType::kInt16},
      {OIIO::TypeDesc::UINT32, SampleType::kUint32}, {OIIO::TypeDesc::INT32, SampleType::kInt32},
      {OIIO::TypeDesc::HALF, SampleType::kFloat16},  {OIIO::TypeDesc::FLOAT, SampleType::kFloat32},
      {OIIO::TypeDesc::DOUBLE, SampleType::kFloat64}};
  const auto found = types.find(type.basetype);
  if (found == types.end()) refuse("OpenImageIO: samples of type " + std::string(type.c_str()));
  return found->second;
}

void check(const OIIO::ImageSpec& spec) {
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
    throw Error(ErrorCode::kCorrupt, "OpenImageIO: raster of " + std::to_string(spec.width) + " x " +
                                         std::to_string(spec.height) + " samples");
  }
  if (spec.deep) refuse("OpenImageIO: deep picture");
  if (spec.depth > 1) refuse("OpenImageIO: volume, not a raster");
  if (spec.get_int_attribute("oiio:Movie") != 0) refuse("OpenImageIO: film, not a raster");
  const std::int64_t rows = spec.tile_width > 0 ? spec.tile_height : 1;
  const auto pixel_bytes = static_cast<std::int64_t>(spec.pixel_bytes());
  if (std::int64_t{spec.width} * rows > kMaxBlockRowBytes / std::max<std::int64_t>(pixel_bytes, 1)) {
    refuse("OpenImageIO: one row of blocks is larger than 1 GiB");
  }
}

/// OpenImageIO hands out pictures: a file is refused if it would deliver other numbers than the file has.
void require_stored_numbers(const std::string& format, const OIIO::ImageSpec& spec) {
  const std::string remedy = "; store the raster as TIFF or PNG (gdal_translate does)";
  if (format == "fits") refuse("OpenImageIO displaces the rows of FITS images" + remedy);
  if (format == "pnm" && !spec.format.is_floating_point()) {
    refuse("OpenImageIO spreads or rounds the samples of any-maps" + remedy);
  }
  const auto bits = static_cast<int>(8 * spec.format.size());
  const int stored_bits = spec.get_int_attribute("oiio:BitsPerSample", bits);
  if (stored_bits != bits) {
    refuse("the samples have " + std::to_string(stored_bits) + " bits, and OpenImageIO spreads them over " +
           std::to_string(bits) + remedy);
  }
}

std::string on_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Runs `action`, turning whatever it throws into Error that names the file.
template <typename Action>
auto named(const std::string& path, Action action) -> decltype(action()) {
  try {
    return action();
  } catch (const Error& error) {
    throw std::string_view(error.what()).starts_with(path) ? error : error.within(path);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, path + ": OpenImageIO ran out of memory");
  } catch (const std::exception& error) {
    throw Error(ErrorCode::kCorrupt, path + ": OpenImageIO: " + on_one_line(error.what()));
  }
}

class Picture final : public OiioPicture {
 public:
  Picture(const std::string& path, std::unique_ptr<OIIO::ImageInput> input)
      : input_(std::move(input)), spec_(input_->spec()) {
    check(spec_);
    const bool is_tiled = spec_.tile_width > 0;
    channels = spec_.nchannels;
    alpha = spec_.alpha_channel;
    const std::string space = spec_.get_string_attribute("oiio:ColorSpace");
    is_linear = !space.empty() && (space[0] == 'l' || space[0] == 'L');
    info_.path = path;
    info_.format = input_->format_name();
    info_.sample_type = sample_type_of(spec_.format);
    info_.width = spec_.width;
    info_.height = spec_.height;
    info_.block_width = is_tiled ? std::min(spec_.tile_width, spec_.width) : spec_.width;
    info_.block_height = is_tiled ? std::min(spec_.tile_height, spec_.height) : 1;
  }

  void choose_channel(const std::string& wanted) {
    std::string names;
    for (int at = 0; at < channels; ++at) {
      const std::string& name = spec_.channelnames.at(static_cast<std::size_t>(at));
      names.append(at > 0 ? ", " : "").append(name);
      if (wanted == name || wanted == std::to_string(at)) channel_ = at;
    }
    if (channel_ < 0 && !wanted.empty()) {
      throw Error(ErrorCode::kInvalidArgument, "has no channel \"" + wanted + "\"; it has " + names + " (or 0..." +
                                                   std::to_string(channels - 1) + ")");
    }
    if (channel_ < 0 && channels > 1) {
      refuse("is a picture with channels " + names + "; `channel` " + spec_.channelnames.front() + " reads one");
    }
    channel_ = std::max(channel_, 0);
    if (channels > 1) info_.channel = spec_.channelnames[static_cast<std::size_t>(channel_)];
  }

  [[nodiscard]] SourceInfo& mutable_info() { return info_; }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] const OIIO::ImageSpec& spec() const { return spec_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const std::size_t sample = spec_.format.size();
    const std::size_t row_bytes = static_cast<std::size_t>(info_.width) * sample;
    const std::size_t out_bytes = static_cast<std::size_t>(window.columns) * sample;
    const std::int64_t step = info_.block_height;
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      if (row / step != band_) named(info_.path, [&] { read_band(row / step); });
      const std::size_t at = static_cast<std::size_t>(row % step) * row_bytes;
      std::memcpy(samples.data(), rows_.data() + at + static_cast<std::size_t>(window.column) * sample, out_bytes);
      samples = samples.subspan(out_bytes);
    }
  }

  [[nodiscard]] std::uint64_t buffer_bytes() const override {
    return static_cast<std::uint64_t>(info_.width * info_.block_height) * spec_.format.size();
  }

  void read_pixels(std::int64_t row, std::int64_t rows, std::byte* out) override {
    named(info_.path, [&] { read_rows(row, rows, 0, channels, out); });
  }

 private:
  /// Reads a row of blocks of the channel.
  void read_band(std::int64_t band) {
    band_ = -1;
    rows_.resize(buffer_bytes());
    const std::int64_t first = band * info_.block_height;
    read_rows(first, std::min(info_.block_height, info_.height - first), channel_, channel_ + 1, rows_.data());
    band_ = band;
  }

  void read_rows(std::int64_t row, std::int64_t rows, int begin, int end, std::byte* out) {
    const int from = spec_.y + static_cast<int>(row);
    const int to = from + static_cast<int>(rows);
    const bool is_read = spec_.tile_width > 0
                             ? input_->read_tiles(0, 0, spec_.x, spec_.x + spec_.width, from, to, spec_.z, spec_.z + 1,
                                                  begin, end, spec_.format, out)
                             : input_->read_scanlines(0, 0, from, to, spec_.z, begin, end, spec_.format, out);
    if (is_read) return;
    throw Error(ErrorCode::kCorrupt, "rows " + std::to_string(row) + " to " + std::to_string(row + rows - 1) + ": " +
                                         on_one_line(input_->geterror()));
  }

  std::unique_ptr<OIIO::ImageInput> input_;
  OIIO::ImageSpec spec_;
  SourceInfo info_;
  int channel_ = -1;
  std::int64_t band_ = -1;  ///< which row of blocks is in rows_; -1: none
  std::vector<std::byte> rows_;
};

std::unique_ptr<OIIO::ImageInput> open_input(const std::string& path) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // numbers as stored, not multiplied by alpha
  config.attribute("oiio:RawColor", 1);
  // Of a name that says nothing OpenImageIO tries every format, DICOM among them, which reads through zeros for
  // minutes.
  constexpr std::uintmax_t kMostToTry = std::uintmax_t{16} << 20U;
  static std::mutex one_at_a_time;  // the attribute is the library's
  const std::lock_guard lock(one_at_a_time);
  std::error_code unknown;
  OIIO::attribute("try_all_readers", std::filesystem::file_size(path, unknown) <= kMostToTry ? 1 : 0);
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &config);
  if (input) return input;
  const std::string why = OIIO::geterror();
  if (why.find("could not find a format reader") != std::string::npos) return nullptr;
  throw Error(ErrorCode::kCorrupt, "OpenImageIO: " + on_one_line(why));
}

std::unique_ptr<OiioPicture> open_picture(const std::string& path, OiioPlugin::For use, const std::string& channel,
                                          const std::function<void(SourceInfo& info)>& complete) {
  return named(path, [&]() -> std::unique_ptr<OiioPicture> {
    std::unique_ptr<OIIO::ImageInput> input = open_input(path);
    if (!input) return nullptr;
    auto picture = std::make_unique<Picture>(path, std::move(input));
    if (use == OiioPlugin::For::kPhoto) return picture;
    require_stored_numbers(picture->info().format, picture->spec());
    picture->choose_channel(channel);
    complete(picture->mutable_info());
    return picture;
  });
}

std::string library() {
  const int version = OIIO::openimageio_version();
  return "OpenImageIO " + std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

/// `text` between two of `c`.
std::string between(char c, const std::string& text) {
  std::string all(1, c);
  all.append(text).push_back(c);
  return all;
}

/// OpenImageIO has them as "bmp:bmp,dib;cineon:cin;...", formats that it only writes as well.
std::vector<std::string> extensions() {
  const std::string readable = between(',', std::string(OIIO::get_string_attribute("input_format_list")));
  std::vector<std::string> list;
  std::istringstream formats{std::string(OIIO::get_string_attribute("extension_list"))};
  for (std::string format; std::getline(formats, format, ';');) {
    const std::size_t colon = format.find(':');
    if (colon == std::string::npos || readable.find(between(',', format.substr(0, colon))) == std::string::npos)
      continue;
    std::istringstream names(format.substr(colon + 1));
    for (std::string name; std::getline(names, name, ',');) list.push_back(std::string(1, '.').append(name));
  }
  return list;
}

}  // namespace
}  // namespace isohf

extern "C" __attribute__((visibility("default"))) const isohf::OiioPlugin* isohf_oiio_plugin() {
  static const isohf::OiioPlugin plugin = {isohf::kOiioAbi, isohf::open_picture, isohf::library, isohf::extensions};
  return &plugin;
}
