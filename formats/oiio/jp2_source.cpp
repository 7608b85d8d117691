#include <fmt/format.h>
#include <openjpeg.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/files/bands.h"
#include "formats/files/file_source.h"
#include "formats/files/text.h"
#include "formats/georeference/files_beside.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/readers.h"
#include "formats/tiff/geojp2.h"

namespace isohf {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kBoxes = "\0\0\0\x0CjP  \r\n\x87\n"sv;
constexpr std::string_view kCodestream = "\xFF\x4F\xFF\x51"sv;  // SOC, SIZ

/// Rows that are decoded at once of a picture without tiles: code-blocks have 64 at most, and what is decoded beyond them
/// for the wavelets is decoded again.
constexpr std::int64_t kStripRows = 256;
constexpr std::int64_t kLeastRows = 64;
/// Samples of all components that are decoded at once, at most; of a tiled picture a tile has no more than kMostTile.
constexpr std::int64_t kAtOnce = std::int64_t{1} << 20U;
constexpr double kMostTile = 0x1p28;
/// libopenjp2 keeps so much of a sample while it decodes a part, and of a code-block from the first part on, measured.
constexpr std::int64_t kBytesOfSample = 24;
constexpr double kBytesOfBlock = 256.0;
constexpr double kMostBlockBytes = 0x1p30;
/// Of one row of tiles, or strip.
constexpr std::int64_t kMostRowBytes = std::int64_t{1} << 30U;

/// One decoder on the file: libopenjp2's stream, codec and image, and what went wrong there.
class Decoder {
 public:
  explicit Decoder(const RawFile& file) : file_(file) {
    std::array<std::byte, 12> head{};
    const std::size_t there = file.read_some(0, head);
    const bool is_boxed = text_of(std::span(head).first(there)).starts_with(kBoxes);
    codec_ = opj_create_decompress(is_boxed ? OPJ_CODEC_JP2 : OPJ_CODEC_J2K);
    stream_ = opj_stream_create(std::size_t{1} << 16U, OPJ_TRUE);
    if (codec_ == nullptr || stream_ == nullptr) {
      close();
      throw Error(ErrorCode::kOutOfMemory, "libopenjp2 ran out of memory");
    }
    opj_stream_set_user_data(stream_, this, nullptr);
    opj_stream_set_user_data_length(stream_, file.size_bytes());
    opj_stream_set_read_function(stream_, on_read);
    opj_stream_set_skip_function(stream_, on_skip);
    opj_stream_set_seek_function(stream_, on_seek);
    opj_set_error_handler(codec_, on_error, this);
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    parameters.flags |= OPJ_DPARAMETERS_IGNORE_PCLR_CMAP_CDEF_FLAG;  // the numbers, no palette's colours
    const int threads = tbb::this_task_arena::max_concurrency();
    const bool is_open =
        opj_setup_decoder(codec_, &parameters) != 0 && opj_decoder_set_strict_mode(codec_, OPJ_TRUE) != 0;
    if (threads > 1) (void)opj_codec_set_threads(codec_, threads);  // else it decodes alone
    try {
      if (!is_open || opj_read_header(stream_, codec_, &image_) == 0) fail("has no codestream that libopenjp2 reads");
    } catch (...) {
      close();
      throw;
    }
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { close(); }

  [[nodiscard]] const opj_image_t& image() const { return *image_; }
  [[nodiscard]] std::unique_ptr<opj_codestream_info_v2_t, void (*)(opj_codestream_info_v2_t*)> codestream() const {
    return {opj_get_cstr_info(codec_), [](opj_codestream_info_v2_t* info) { opj_destroy_cstr_info(&info); }};
  }

  /// A rectangle of a picture of one tile, in the codestream's coordinates; one component after another.
  void decode_area(int x0, int y0, int x1, int y1) {
    if (opj_set_decode_area(codec_, image_, x0, y0, x1, y1) == 0 || opj_decode(codec_, stream_, image_) == 0) {
      fail("its codestream is damaged or cut off");
    }
  }
  void decode_tile(unsigned tile) {
    if (opj_get_decoded_tile(codec_, stream_, image_, tile) == 0) fail("its codestream is damaged or cut off");
  }

 private:
  static OPJ_SIZE_T on_read(void* bytes, OPJ_SIZE_T count, void* self) {
    auto& decoder = *static_cast<Decoder*>(self);
    try {
      const std::size_t got = decoder.file_.read_some(decoder.at_, {static_cast<std::byte*>(bytes), count});
      decoder.at_ += got;
      if (got > 0) return got;
    } catch (...) {
      if (!decoder.failure_) decoder.failure_ = std::current_exception();
    }
    return static_cast<OPJ_SIZE_T>(-1);
  }
  static OPJ_OFF_T on_skip(OPJ_OFF_T count, void* self) {
    static_cast<Decoder*>(self)->at_ += static_cast<std::uint64_t>(count);
    return count;
  }
  static OPJ_BOOL on_seek(OPJ_OFF_T offset, void* self) {
    static_cast<Decoder*>(self)->at_ = static_cast<std::uint64_t>(offset);
    return OPJ_TRUE;
  }
  static void on_error(const char* text, void* self) {
    auto& decoder = *static_cast<Decoder*>(self);
    if (decoder.message_.empty()) decoder.message_ = trimmed(printable(text));
  }

  [[noreturn]] void fail(const std::string& what) {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    throw Error(ErrorCode::kCorrupt, message_.empty() ? what : fmt::format("{} (libopenjp2: {})", what, message_));
  }

  void close() {
    if (image_ != nullptr) opj_image_destroy(image_);
    if (codec_ != nullptr) opj_destroy_codec(codec_);
    if (stream_ != nullptr) opj_stream_destroy(stream_);
  }

  const RawFile& file_;
  std::uint64_t at_ = 0;
  std::exception_ptr failure_;
  std::string message_;
  opj_codec_t* codec_ = nullptr;
  opj_stream_t* stream_ = nullptr;
  opj_image_t* image_ = nullptr;
};

class Jp2Source final : public FileSource {
 public:
  Jp2Source(const std::string& path, const OpenOptions& options) : FileSource(path, "JPEG 2000", options) {
    try {
      decoder_ = std::make_unique<Decoder>(*file_);
      describe(options);
    } catch (const Error& error) {
      throw error.within(path);
    }
    read_place_beside(info_, info_.channel.empty() ? 1 : 0);
    apply_open_options(info_, options);
  }

  /// Colours of 8 bits, which may be packed elevations.
  [[nodiscard]] static bool has_colours(const std::string& path) {
    const RawFile file(path);
    const Decoder decoder(file);
    const opj_image_t& image = decoder.image();
    return (image.numcomps == 3 || image.numcomps == 4) && image.comps[0].prec == 8 && image.comps[0].sgnd == 0;
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const std::size_t size = size_bytes(info_.sample_type);
    const std::size_t columns = static_cast<std::size_t>(window.columns) * size;
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      if (row < kept_begin_ || row >= kept_end_) keep(row);
      const std::byte* from =
          kept_.data() + static_cast<std::size_t>((row - kept_begin_) * info_.width + window.column) * size;
      std::memcpy(samples.data() + static_cast<std::size_t>(row - window.row) * columns, from, columns);
    }
  }

  void limit_buffers(std::uint64_t bytes) override {
    strip_rows_ = strip_rows_within(bytes);
    kept_begin_ = kept_end_ = 0;
    kept_.clear();
    kept_.shrink_to_fit();
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return bytes_ + static_cast<std::uint64_t>(info_.width * strip_rows_within(limit)) * size_bytes(info_.sample_type);
  }

 private:
  /// A row of tiles, or of code-blocks, is the least.
  [[nodiscard]] std::int64_t strip_rows_within(std::uint64_t bytes) const {
    if (is_tiled_) return tile_height_;
    const std::uint64_t row_bytes = static_cast<std::uint64_t>(info_.width) * size_bytes(info_.sample_type);
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::min<std::uint64_t>(bytes / row_bytes, kStripRows)),
                                    kLeastRows, kStripRows);
  }

  void describe(const OpenOptions& options) {
    const opj_image_t& image = decoder_->image();
    const auto codestream = decoder_->codestream();
    if (!codestream) throw Error(ErrorCode::kOutOfMemory, "libopenjp2 ran out of memory");
    component_ = static_cast<unsigned>(choose_band(info_, options, image.numcomps));
    const opj_image_comp_t& component = image.comps[component_];
    x0_ = image.x0;
    y0_ = image.y0;
    tile_x0_ = codestream->tx0;
    tile_y0_ = codestream->ty0;
    tile_width_ = codestream->tdx;
    tile_height_ = codestream->tdy;
    tiles_across_ = codestream->tw;
    is_tiled_ = std::uint64_t{codestream->tw} * codestream->th > 1;
    info_.width = std::int64_t{image.x1} - x0_;
    info_.height = std::int64_t{image.y1} - y0_;
    if (info_.width < 1 || info_.height < 1 || image.x1 > INT32_MAX || image.y1 > INT32_MAX) {
      throw Error(ErrorCode::kCorrupt, fmt::format("says {} x {} samples", info_.width, info_.height));
    }
    for (unsigned i = 0; i < image.numcomps; ++i) {
      if (image.comps[i].dx != 1 || image.comps[i].dy != 1) {
        throw Error(ErrorCode::kUnsupported, fmt::format("has fewer samples in its channel {} than pixels", i));
      }
    }
    if (component.prec > 31) {
      throw Error(ErrorCode::kUnsupported, fmt::format("has samples of {} bits; isohf reads up to 31", component.prec));
    }
    const bool is_signed = component.sgnd != 0;
    info_.sample_type = component.prec <= 8    ? (is_signed ? SampleType::kInt8 : SampleType::kUint8)
                        : component.prec <= 16 ? (is_signed ? SampleType::kInt16 : SampleType::kUint16)
                                               : (is_signed ? SampleType::kInt32 : SampleType::kUint32);
    const std::int64_t all = image.numcomps;
    strip_rows_ = strip_rows_within(UINT64_MAX);
    // Every code-block of a tile has its record, however little of the tile is decoded.
    double blocks = 0.0;
    for (unsigned i = 0; i < image.numcomps; ++i) {
      const auto& coding = codestream->m_default_tile_info.tccp_info[i];
      double samples = tile_samples();  // of a level
      for (unsigned level = coding.numresolutions; level-- > 0; samples /= 4.0) {
        const unsigned precinct = coding.prcw[level] + coding.prch[level];  // libopenjp2 2.5.0 leaves out some: 0
        const unsigned block = coding.cblkw + coding.cblkh;
        blocks += samples / std::exp2(precinct > 0 ? std::min(block, precinct) : block) + 1.0;
      }
    }
    const double at_once = is_tiled_ ? tile_samples() * static_cast<double>(all) : static_cast<double>(kAtOnce);
    if (at_once > kMostTile || blocks * kBytesOfBlock > kMostBlockBytes ||
        info_.width > kMostRowBytes / strip_rows_within(0) / static_cast<std::int64_t>(size_bytes(info_.sample_type))) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("has tiles of {} x {} samples, of which one, or a row, takes more than 1 GiB (gdal_translate -co "
                      "TILED=YES makes a TIFF of it)",
                      tile_width_, tile_height_));
    }
    info_.block_width = info_.width;
    info_.block_height = std::min(strip_rows_, info_.height);
    bytes_ = static_cast<std::uint64_t>(at_once) * kBytesOfSample + static_cast<std::uint64_t>(blocks * kBytesOfBlock) +
             (is_tiled_ ? 0 : file_->size_bytes());
    if (const GeoTags tags = geojp2_tags(info_.path); !tags.empty()) place(tags);
  }

  /// Of one tile that lies whole in the picture.
  [[nodiscard]] double tile_samples() const {
    return std::min(static_cast<double>(tile_width_), static_cast<double>(info_.width)) *
           std::min(static_cast<double>(tile_height_), static_cast<double>(info_.height));
  }

  void place(const GeoTags& tags) {
    GeoTiffPlace found = place_from_geotiff(tags, info_.height);
    if (found.rows_from_south) {
      throw Error(ErrorCode::kUnsupported, "has its southernmost row first; gdalwarp turns it");
    }
    info_.georeference = std::move(found.georeference);
    info_.vertical_unit = found.vertical_unit;
    info_.metres_per_vertical_unit = found.metres_per_vertical_unit;
    info_.warnings.insert(info_.warnings.end(), found.warnings.begin(), found.warnings.end());
  }

  /// Decodes the strip, or row of tiles, that has `row`.
  void keep(std::int64_t row) {
    const std::int64_t first_row = is_tiled_ ? tile_y0_ - y0_ : 0;  // at or before row 0
    const std::int64_t down = (row - first_row) / strip_rows_;
    const std::int64_t begin = std::max<std::int64_t>(first_row + down * strip_rows_, 0);
    const std::int64_t end = std::min(first_row + (down + 1) * strip_rows_, info_.height);
    kept_end_ = kept_begin_;
    kept_.resize(static_cast<std::size_t>((end - begin) * info_.width) * size_bytes(info_.sample_type));
    try {
      if (is_tiled_) {
        for (std::int64_t across = 0; across < tiles_across_; ++across) {
          decoder_->decode_tile(static_cast<unsigned>(down * tiles_across_ + across));
          const std::int64_t left = tile_x0_ + across * tile_width_ - x0_;
          take(std::max<std::int64_t>(left, 0), std::min(left + tile_width_, info_.width), begin, end);
        }
      } else {
        const std::int64_t columns = std::max<std::int64_t>(kAtOnce / strip_rows_ / decoder_->image().numcomps, 64);
        for (std::int64_t left = 0; left < info_.width; left += columns) {
          const std::int64_t right = std::min(left + columns, info_.width);
          const auto at = [](std::int64_t place) { return static_cast<int>(place); };
          decoder_->decode_area(at(x0_ + left), at(y0_ + begin), at(x0_ + right), at(y0_ + end));
          take(left, right, begin, end);
        }
      }
    } catch (const Error& error) {
      throw Error(error.code(), fmt::format("{}: rows {} to {}: {}", info_.path, begin, end - 1, error.what()));
    }
    kept_begin_ = begin;
    kept_end_ = end;
  }

  /// What was decoded, into columns and rows of kept_, which begins with `top`.
  void take(std::int64_t left, std::int64_t right, std::int64_t top, std::int64_t bottom) {
    const opj_image_comp_t& found = decoder_->image().comps[component_];
    if (found.data == nullptr || found.w != right - left || found.h != bottom - top) {
      throw Error(ErrorCode::kCorrupt, fmt::format("has {} x {} samples where {} x {} must be", found.w, found.h,
                                                   right - left, bottom - top));
    }
    const auto put = [&](auto sample) {
      using T = decltype(sample);
      for (std::int64_t row = 0; row < bottom - top; ++row) {
        const OPJ_INT32* const from = found.data + row * (right - left);
        std::byte* const to = kept_.data() + static_cast<std::size_t>(row * info_.width + left) * sizeof(T);
        for (std::int64_t i = 0; i < right - left; ++i) {
          const T value = static_cast<T>(from[i]);
          std::memcpy(to + static_cast<std::size_t>(i) * sizeof(T), &value, sizeof(T));
        }
      }
    };
    switch (size_bytes(info_.sample_type)) {
      case 1:
        return put(std::uint8_t{});
      case 2:
        return put(std::uint16_t{});
      default:
        return put(std::uint32_t{});
    }
  }

  std::unique_ptr<Decoder> decoder_;
  unsigned component_ = 0;
  bool is_tiled_ = false;
  std::int64_t x0_ = 0;  ///< of the picture and of its first tile, in the codestream's coordinates
  std::int64_t y0_ = 0;
  std::int64_t tile_x0_ = 0;
  std::int64_t tile_y0_ = 0;
  std::int64_t tile_width_ = 0;
  std::int64_t tile_height_ = 0;
  std::int64_t tiles_across_ = 0;
  std::int64_t strip_rows_ = 0;
  std::uint64_t bytes_ = 0;  ///< that decoding takes
  std::vector<std::byte> kept_;
  std::int64_t kept_begin_ = 0;
  std::int64_t kept_end_ = 0;
};

}  // namespace

bool looks_like_jp2(std::span<const std::byte> head) {
  return text_of(head).starts_with(kBoxes) || text_of(head).starts_with(kCodestream);
}

std::unique_ptr<HeightSource> open_jp2(const std::string& path, const OpenOptions& options) {
  // Packed elevations are looked for where all pictures' are.
  if (packing_from_string(options.channel)) return open_with_oiio(path, options);
  try {
    if (options.channel.empty() && Jp2Source::has_colours(path)) return open_with_oiio(path, options);
  } catch (const Error& error) {
    throw error.within(path);
  }
  return std::make_unique<Jp2Source>(path, options);
}

std::string jp2_library() {
  return std::string("libopenjp2 ") + opj_version();
}

}  // namespace isohf
