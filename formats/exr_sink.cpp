#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>

#include "formats/exr_threads.h"
#include "formats/raster_encoder.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

/// The library writes the table of chunks in a destructor, which cannot report a full disk; this stream remembers.
class CheckedStream final : public Imf::OStream {
 public:
  explicit CheckedStream(const std::string& path) : OStream(path.c_str()), file_(std::fopen(path.c_str(), "wb")) {
    if (file_ == nullptr) fail();
  }
  CheckedStream(const CheckedStream&) = delete;
  CheckedStream& operator=(const CheckedStream&) = delete;
  ~CheckedStream() override {
    if (file_ != nullptr) std::fclose(file_);
  }

  void write(const char c[], int n) override {
    if (n > 0 && std::fwrite(c, 1, static_cast<std::size_t>(n), file_) != static_cast<std::size_t>(n)) fail();
  }
  std::uint64_t tellp() override {
    const auto position = ::ftello(file_);
    if (position < 0) fail();
    return static_cast<std::uint64_t>(position);
  }
  void seekp(std::uint64_t position) override {
    if (::fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) fail();
  }

  /// Throws if anything has failed, here or before.
  void close() {
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0 && !error_) error_ = errno;
    if (error_) throw_error();
  }

 private:
  [[noreturn]] void fail() {
    if (!error_) error_ = errno;
    throw_error();
  }
  [[noreturn]] void throw_error() const {
    throw Error(ErrorCode::kIo, fmt::format("cannot be written: {}", std::strerror(*error_)));
  }

  std::FILE* file_;
  std::optional<int> error_;
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
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("OpenEXR stores float16, float32 and uint32, not {}", to_string(type)));
  }
}

Imf::Header header_of(const RasterSpec& spec) {
  Imf::Header header(static_cast<int>(spec.width), static_cast<int>(spec.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  return header;
}

class ExrEncoder final : public RasterEncoder {
 public:
  ExrEncoder(const std::string& path, const RasterSpec& spec) : spec_(spec), type_(pixel_type(spec.sample_type)) {
    static constexpr std::array<const char*, 4> kColours = {"R", "G", "B", "A"};
    Imf::Header header = header_of(spec);
    for (int channel = 0; channel < spec.channels; ++channel) {
      names_.emplace_back(spec.channels == 1 ? "Y" : kColours[static_cast<std::size_t>(channel)]);
      header.channels().insert(names_.back(), Imf::Channel(type_));
    }
    start_exr_threads();
    stream_.emplace(path);
    translated([&] { file_.emplace(*stream_, header); });
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
    stream_->close();
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

std::unique_ptr<RasterEncoder> encode_exr(const std::string& path, const RasterSpec& spec) {
  return std::make_unique<ExrEncoder>(path, spec);
}

}  // namespace isohf
