#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "formats/raster_encoder.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr double kVoid = -32768.0;

[[noreturn]] void fail() {
  const int error = errno;
  throw Error(ErrorCode::kIo, fmt::format("cannot be written: {}", std::strerror(error)));
}

/// Big-endian int16, nothing else.
class HgtEncoder final : public RasterEncoder {
 public:
  explicit HgtEncoder(const std::string& path) : file_(std::fopen(path.c_str(), "wb")) {
    if (file_ == nullptr) fail();
  }
  ~HgtEncoder() override {
    if (file_ != nullptr) std::fclose(file_);
  }

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    swapped_.resize(rows.size());
    for (std::size_t at = 0; at < rows.size(); at += 2) {
      swapped_[at] = rows[at + 1];
      swapped_[at + 1] = rows[at];
    }
    if (std::fwrite(swapped_.data(), 1, swapped_.size(), file_) != swapped_.size()) fail();
  }

  void close() override {
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0) fail();
  }

 private:
  std::FILE* file_;
  std::vector<std::byte> swapped_;
};

bool is_tile_size(std::int64_t width, std::int64_t height) {
  return (height == 3601 && (width == 3601 || width == 1801)) || (height == 1201 && width == 1201);
}

}  // namespace

std::unique_ptr<RasterEncoder> encode_hgt(const std::string& path, const RasterSpec& spec) {
  if (spec.sample_type != SampleType::kInt16 || spec.channels != 1) {
    throw Error(ErrorCode::kUnsupported, fmt::format("HGT stores one channel of int16, not {} of {}", spec.channels,
                                                     to_string(spec.sample_type)));
  }
  if (!is_tile_size(spec.width, spec.height)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("an HGT tile has 1201 x 1201, 3601 x 3601 or 1801 x 3601 samples, not {} x {}", spec.width,
                            spec.height));
  }
  if (spec.void_value && *spec.void_value != kVoid) {
    throw Error(ErrorCode::kUnsupported, fmt::format("HGT's void value is -32768, not {}", *spec.void_value));
  }
  return std::make_unique<HgtEncoder>(path);
}

}  // namespace isohf
