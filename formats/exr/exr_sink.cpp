#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>

#include <array>
#include <exception>
#include <optional>

#include "formats/exr/exr_header.h"
#include "formats/write/encoders.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The library writes the table of chunks in a destructor, which cannot report a full disk; this stream remembers.
class CheckedStream final : public Imf::OStream {
 public:
  explicit CheckedStream(OutputFile& out) : OStream(out.path().c_str()), out_(out) {}

  void write(const char c[], int n) override {
    if (n <= 0) return;
    const std::string_view bytes(c, static_cast<std::size_t>(n));
    try {
      out_.write_at(position_, std::as_bytes(std::span(bytes)));
    } catch (...) {
      if (!error_) error_ = std::current_exception();
      throw;
    }
    position_ += bytes.size();
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

  /// Throws what has failed before.
  void check() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  OutputFile& out_;
  std::uint64_t position_ = 0;
  std::exception_ptr error_;
};

Imf::PixelType pixel_type(SampleType type) {
  switch (type) {
    case SampleType::kFloat16:
      return Imf::HALF;
    case SampleType::kFloat32:
      return Imf::FLOAT;
    case SampleType::kUint32:
      return Imf::UINT;
    default:
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("OpenEXR stores float16, float32 and uint32, not {}", to_string(type)));
  }
}

/// Rows that are compressed together, where they take no more; of very wide pictures each for itself.
constexpr std::size_t kRowsTogether = 16;
constexpr std::size_t kMostBytesTogether = std::size_t{8} << 20U;

Imf::Header header_of(const RasterSpec& spec) {
  Imf::Header header(static_cast<int>(spec.width), static_cast<int>(spec.height));
  const bool is_wide = kRowsTogether * row_bytes(spec) > kMostBytesTogether;
  header.compression() = !spec.compress ? Imf::NO_COMPRESSION : is_wide ? Imf::ZIPS_COMPRESSION : Imf::ZIP_COMPRESSION;
  return header;
}

class ExrEncoder final : public RasterEncoder {
 public:
  ExrEncoder(OutputFile& out, const RasterSpec& spec) : spec_(spec), type_(pixel_type(spec.sample_type)) {
    static constexpr std::array<const char*, 4> kColours = {"R", "G", "B", "A"};
    Imf::Header header = header_of(spec);
    for (int channel = 0; channel < spec.channels; ++channel) {
      names_.emplace_back(spec.channels == 1 ? "Y" : kColours[static_cast<std::size_t>(channel)]);
      header.channels().insert(names_.back(), Imf::Channel(type_));
    }
    start_exr_threads();
    stream_.emplace(out);
    // Each thread has buffers of its own.
    translated([&] { file_.emplace(*stream_, header, spec.scratch ? 0 : Imf::globalThreadCount()); });
  }

  void write(std::span<const std::byte> rows, std::int64_t count) override {
    const std::size_t sample = size_bytes(spec_.sample_type);
    const std::size_t pixel = sample * names_.size();
    const Imath::V2i origin(0, static_cast<int>(row_));
    Imf::FrameBuffer frame;
    for (std::size_t channel = 0; channel < names_.size(); ++channel) {
      frame.insert(names_[channel], Imf::Slice::Make(type_, rows.data() + channel * sample, origin, spec_.width, count,
                                                     pixel, pixel * static_cast<std::size_t>(spec_.width)));
    }
    translated([&] {
      file_->setFrameBuffer(frame);
      file_->writePixels(static_cast<int>(count));
    });
    row_ += count;
  }

  void close() override {
    file_.reset();
    stream_->check();
  }

 private:
  template <typename Action>
  static void translated(Action action) {
    try {
      action();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& error) {
      throw Error(ErrorCode::kIo, fmt::format("OpenEXR cannot write it: {}", error.what()));
    }
  }

  RasterSpec spec_;
  Imf::PixelType type_;
  std::vector<std::string> names_;
  std::optional<CheckedStream> stream_;
  std::optional<Imf::OutputFile> file_;
  std::int64_t row_ = 0;
};

}  // namespace

std::unique_ptr<RasterEncoder> encode_exr(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<ExrEncoder>(out, spec);
}

}  // namespace isohf
