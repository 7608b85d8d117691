#include "formats/readers.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/OpenEXRConfig.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "formats/exr/exr_header.h"
#include "formats/georeference/sidecars.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/open_options.h"
#include "isohf/base/arena.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// After kHeightWords, channels called so, in any case; those of layers of normals and the like are something else.
constexpr std::array kPreferredChannels = {"y", "z", "depth", "r"};
constexpr std::array kOtherLayers = {"n", "normal", "normals", "uv", "st", "motion", "velocity", "tangent"};

/// Rows are decoded in runs of at most about this size, so that several chunks are decoded at a time.
constexpr std::uint64_t kBandBytes = std::uint64_t{8} << 20U;

struct Channel {
  int part = 0;
  std::string part_name;  ///< empty in a file of one part
  std::string name;
  Imf::PixelType type = Imf::HALF;
  bool subsampled = false;
  bool deep = false;
};

std::string full_name(const Channel& channel) {
  return channel.part_name.empty() ? channel.name : channel.part_name + "." + channel.name;
}

/// For messages.
std::string shown_name(const Channel& channel) {
  return one_line(full_name(channel));
}

/// The words between the dots of a name, in lower case.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words;
  std::istringstream text(lower_case(name));
  for (std::string word; std::getline(text, word, '.');) words.push_back(word);
  return words.empty() ? std::vector<std::string>{""} : words;
}

template <std::size_t count>
std::size_t place_in(const std::array<const char*, count>& list, const std::string& word) {
  return static_cast<std::size_t>(std::find(list.begin(), list.end(), word) - list.begin());
}

/// How likely a channel holds elevations, the likeliest 0: "height", then "height.Y" or "terrain.height", then "Y",
/// then "beauty.Y"; from kNoHeights on its name says nothing of them. Opacity is last.
constexpr std::size_t kNoHeights = 2 * (kHeightWords.size() + kPreferredChannels.size());
std::size_t unlikeliness(const Channel& channel) {
  const std::vector<std::string> words = words_of(channel.name);
  const bool is_whole = words.size() == 1;
  std::size_t heights = kHeightWords.size();
  for (const std::string& word : words) heights = std::min(heights, place_in(kHeightWords, word));
  if (heights < kHeightWords.size()) return heights + (is_whole ? 0 : kHeightWords.size());
  if (words.back() == "a" || words.back() == "alpha") return kNoHeights + 3;
  if (!is_whole && place_in(kOtherLayers, words.front()) < kOtherLayers.size()) return kNoHeights + 2;
  const std::size_t preferred = place_in(kPreferredChannels, words.back());
  if (preferred == kPreferredChannels.size()) return kNoHeights + (is_whole ? 0 : 1);
  return 2 * kHeightWords.size() + preferred + (is_whole ? 0 : kPreferredChannels.size());
}

/// All channels, in the order of the file, which is that of their names in each part.
std::vector<Channel> channels_of(const Imf::MultiPartInputFile& file) {
  std::vector<Channel> channels;
  for (int part = 0; part < file.parts(); ++part) {
    const Imf::Header& header = file.header(part);
    for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
      Channel& channel = channels.emplace_back();
      channel.part = part;
      if (file.parts() > 1) channel.part_name = header.hasName() ? header.name() : std::to_string(part);
      channel.name = at.name();
      channel.type = at.channel().type;
      channel.subsampled = at.channel().xSampling != 1 || at.channel().ySampling != 1;
      channel.deep = header.hasType() && Imf::isDeepData(header.type());
    }
  }
  if (channels.empty()) throw Error(ErrorCode::kCorrupt, "OpenEXR file has no channels");
  return channels;
}

std::string list_of(const std::vector<Channel>& channels) {
  std::string list;
  for (const Channel& channel : channels) list += (list.empty() ? "" : ", ") + shown_name(channel);
  return list;
}

/// Drops the channels of all parts but one, given by its name or number.
void keep_part(std::vector<Channel>& channels, const std::string& wanted) {
  const std::vector<Channel> all = channels;
  const bool is_name = std::ranges::count(channels, wanted, &Channel::part_name) > 0;
  std::erase_if(channels, [&](const Channel& channel) {
    return (is_name ? channel.part_name : std::to_string(channel.part)) != wanted;
  });
  if (!channels.empty()) return;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("has no part \"{}\"; its channels are {}, in parts 0...{}",
                                                       wanted, list_of(all), all.back().part));
}

/// The channel of that name, with or without its part's, or number; if none is wanted, the one that most likely holds
/// elevations.
Channel choose_channel(const std::vector<Channel>& channels, const std::string& wanted) {
  if (wanted.empty()) {
    const auto key = [](const Channel& channel) { return std::pair(channel.deep, unlikeliness(channel)); };
    return *std::ranges::min_element(channels, {}, key);
  }
  for (const bool is_full : {false, true}) {
    for (const Channel& channel : channels) {
      if ((is_full ? full_name(channel) : channel.name) == wanted) return channel;
    }
  }
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (wanted == std::to_string(i)) return channels[i];
  }
  throw Error(ErrorCode::kInvalidArgument, fmt::format("has no channel \"{}\"; it has {} (or 0...{})", wanted,
                                                       list_of(channels), channels.size() - 1));
}

SampleType sample_type_of(Imf::PixelType type) {
  switch (type) {
    case Imf::UINT:
      return SampleType::kUint32;
    case Imf::HALF:
      return SampleType::kFloat16;
    case Imf::FLOAT:
      return SampleType::kFloat32;
    default:
      throw Error(ErrorCode::kCorrupt, fmt::format("OpenEXR pixel type {} is unknown", static_cast<int>(type)));
  }
}

/// Runs `action`, turning whatever the OpenEXR library throws into Error with `where` in front.
template <typename Action>
auto translated(const std::string& where, Action action) -> decltype(action()) {
  try {
    return action();
  } catch (const Error& error) {
    throw error.within(where);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, where + ": OpenEXR ran out of memory");
  } catch (const std::exception& error) {
    throw Error(ErrorCode::kCorrupt, where + ": OpenEXR: " + one_line(error.what()));
  }
}

class ExrSource final : public HeightSource {
 public:
  /// `rows_of_chunks`  of each part.
  ExrSource(const std::string& path, const std::vector<std::int64_t>& rows_of_chunks, const OpenOptions& options)
      : file_(path.c_str(), Imf::globalThreadCount(), false),
        band_bytes_(static_cast<std::int64_t>(std::min(options.buffer_bytes, kBandBytes))) {
    std::vector<Channel> channels = channels_of(file_);
    if (!options.part.empty()) keep_part(channels, options.part);
    channel_ = choose_channel(channels, options.channel);
    if (channel_.deep) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("OpenEXR channel {} is deep, several samples per pixel; flatten it", shown_name(channel_)));
    }
    if (channel_.subsampled) {
      throw Error(ErrorCode::kUnsupported, fmt::format("OpenEXR channel {} is subsampled; the file has {}",
                                                       shown_name(channel_), list_of(channels)));
    }
    if (!file_.partComplete(channel_.part)) {
      throw Error(ErrorCode::kCorrupt, "OpenEXR file is incomplete: its table of chunks has gaps");
    }
    describe(path, channels, options.channel.empty());
    open_part(rows_of_chunks.at(static_cast<std::size_t>(channel_.part)));
    read_sidecars(info_, channels.size() == 1 ? 1 : 0);
    apply_open_options(info_, options);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const std::size_t row_bytes = static_cast<std::size_t>(window.columns) * sample_bytes_;
    if (samples.empty()) return;
    std::byte* out = samples.data();
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row, out += row_bytes) {
      if (!band_holds(row, window)) load_band(row, window);
      const std::int64_t at = (row - band_.row) * band_.columns + window.column - band_.column;
      std::memcpy(out, samples_.data() + static_cast<std::size_t>(at) * sample_bytes_, row_bytes);
    }
  }

  /// Of the band, and of OpenEXR's chunks with all their channels: two for each of its threads, and about as much again
  /// as stored and once more while they are decoded.
  [[nodiscard]] std::uint64_t buffer_bytes() const override {
    const std::int64_t rows = std::min(band_rows(info_.width), info_.height);
    std::int64_t pixel_bytes = 0;
    const Imf::ChannelList& channels = file_.header(channel_.part).channels();
    for (auto at = channels.begin(); at != channels.end(); ++at) {
      pixel_bytes += static_cast<std::int64_t>(size_bytes(sample_type_of(at.channel().type)));
    }
    const std::int64_t chunks = std::max(2 * Imf::globalThreadCount(), 1);
    const std::int64_t chunk_bytes = 3 * info_.block_width * info_.block_height * pixel_bytes;
    return static_cast<std::uint64_t>(rows * info_.width * static_cast<std::int64_t>(sample_bytes_) +
                                      chunks * chunk_bytes);
  }

 private:
  /// Rows of whole chunks of so many columns that a band has room for.
  [[nodiscard]] std::int64_t band_rows(std::int64_t columns) const {
    const std::int64_t affordable = band_bytes_ / (columns * static_cast<std::int64_t>(sample_bytes_));
    return std::max(affordable / info_.block_height * info_.block_height, info_.block_height);
  }

  void describe(const std::string& path, const std::vector<Channel>& channels, bool chosen_here) {
    const Imf::Header& header = file_.header(channel_.part);
    const Imath::Box2i& data = header.dataWindow();
    const Imath::Box2i& display = header.displayWindow();
    info_.path = path;
    info_.format = "OpenEXR";
    info_.width = std::int64_t{data.max.x} - data.min.x + 1;
    info_.height = std::int64_t{data.max.y} - data.min.y + 1;
    info_.sample_type = sample_type_of(channel_.type);
    info_.channel = channels.size() > 1 || !channel_.part_name.empty() ? full_name(channel_) : std::string();
    sample_bytes_ = size_bytes(info_.sample_type);
    if (chosen_here && channels.size() > 1) {
      const bool is_guess = unlikeliness(channel_) >= kNoHeights;
      const std::string text =
          fmt::format("channel {} is read, of {} ({}){}; `channel` chooses another", shown_name(channel_),
                      channels.size(), list_of(channels), is_guess ? ", none of which says height" : "");
      info_.warnings.push_back(is_guess ? loss(text) : Warning(text));
    }
    if (data != display) {
      info_.warnings.push_back(fmt::format(
          "the data window ({}, {}) - ({}, {}) is read; the display window ({}, {}) - "
          "({}, {}) differs",
          data.min.x, data.min.y, data.max.x, data.max.y, display.min.x, display.min.y, display.max.x, display.max.y));
    }
  }

  void open_part(std::int64_t rows_of_chunk) {
    const Imf::Header& header = file_.header(channel_.part);
    origin_ = header.dataWindow().min;
    if (header.hasType() ? Imf::isTiled(header.type()) : header.hasTileDescription()) {
      tiles_.emplace(file_, channel_.part);
      info_.block_width = std::min<std::int64_t>(tiles_->tileXSize(), info_.width);
      info_.block_height = std::min<std::int64_t>(tiles_->tileYSize(), info_.height);
    } else {
      scan_lines_.emplace(file_, channel_.part);
      info_.block_width = info_.width;
      info_.block_height = std::clamp<std::int64_t>(rows_of_chunk, 1, info_.height);
    }
  }

  [[nodiscard]] bool band_holds(std::int64_t row, const Window& window) const {
    return row >= band_.row && row < band_.row + band_.rows && window.column >= band_.column &&
           window.column + window.columns <= band_.column + band_.columns;
  }

  /// Decodes whole chunks around the part of `window` that begins at `row`: all of its rows if they are few.
  void load_band(std::int64_t row, const Window& window) {
    const auto down = [](std::int64_t value, std::int64_t step) { return value / step * step; };
    const auto up = [](std::int64_t value, std::int64_t step, std::int64_t end) {
      return std::min((value + step - 1) / step * step, end);
    };
    Window band;
    band.column = down(window.column, info_.block_width);
    band.columns = up(window.column + window.columns, info_.block_width, info_.width) - band.column;
    band.row = down(row, info_.block_height);
    const std::int64_t wanted = up(window.row + window.rows, info_.block_height, info_.height) - band.row;
    band.rows = std::min({wanted, band_rows(band.columns), info_.height - band.row});
    band_ = {};  // what is there is overwritten, even if decoding fails half-way
    translated(fmt::format("{}: rows {} to {}", info_.path, band.row, band.row + band.rows - 1), [&] { decode(band); });
    band_ = band;
  }

  void decode(const Window& band) {
    samples_.resize(static_cast<std::size_t>(band.columns * band.rows) * sample_bytes_);
    const Imath::V2i first(origin_.x + static_cast<int>(band.column), origin_.y + static_cast<int>(band.row));
    Imf::FrameBuffer frame;
    frame.insert(channel_.name,
                 Imf::Slice::Make(channel_.type, samples_.data(), first, band.columns, band.rows, sample_bytes_,
                                  sample_bytes_ * static_cast<std::size_t>(band.columns)));
    if (tiles_) {
      tiles_->setFrameBuffer(frame);
      const auto tile = [](std::int64_t at, std::int64_t size) { return static_cast<int>(at / size); };
      tiles_->readTiles(tile(band.column, info_.block_width), tile(band.column + band.columns - 1, info_.block_width),
                        tile(band.row, info_.block_height), tile(band.row + band.rows - 1, info_.block_height));
    } else {
      scan_lines_->setFrameBuffer(frame);
      scan_lines_->readPixels(first.y, first.y + static_cast<int>(band.rows) - 1);
    }
  }

  Imf::MultiPartInputFile file_;
  std::optional<Imf::InputPart> scan_lines_;
  std::optional<Imf::TiledInputPart> tiles_;
  Channel channel_;
  Imath::V2i origin_;
  SourceInfo info_;
  std::size_t sample_bytes_ = 0;
  std::int64_t band_bytes_;
  Window band_;                     ///< what samples_ holds
  std::vector<std::byte> samples_;  ///< decoded chunks of the channel
};

std::unique_ptr<HeightSource> open_exr(const std::string& path, const OpenOptions& options) {
  return translated(path, [&]() -> std::unique_ptr<HeightSource> {
    const std::vector<std::int64_t> rows_of_chunks = check_exr_headers(path);
    start_exr_threads();
    return std::make_unique<ExrSource>(path, rows_of_chunks, options);
  });
}

}  // namespace

const Format kExrFormat = {.name = "OpenEXR",
                           .extensions = {".exr"},
                           .library = [] { return std::string("OpenEXR " OPENEXR_VERSION_STRING); },
                           .note = "takes `channel` and `part`",
                           .open = open_exr,
                           .recognises = looks_like_exr,
                           .takes_part = true};

void start_exr_threads() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::setGlobalThreadCount(
        possible_threads(static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 4U))));
  });
}

}  // namespace isohf
