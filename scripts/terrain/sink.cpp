#include "sink.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "isohf/error.h"

namespace isohf::terrain {
namespace {

class RawSink final : public Sink {
 public:
  RawSink(const std::string& path, bool big_endian)
      : path_(path), big_endian_(big_endian), file_(std::fopen(path.c_str(), "wb")) {
    if (file_ == nullptr) fail("cannot create");
  }
  ~RawSink() override {
    if (file_ != nullptr) std::fclose(file_);
  }

  void write_band(std::span<std::byte> samples) override {
    if (big_endian_) {
      for (std::size_t i = 0; i + 1 < samples.size(); i += 2) std::swap(samples[i], samples[i + 1]);
    }
    if (std::fwrite(samples.data(), 1, samples.size(), file_) != samples.size()) fail("cannot write");
  }

  void finish() override {
    std::FILE* file = std::exchange(file_, nullptr);
    if (std::fclose(file) != 0) fail("cannot write");
  }

 private:
  [[noreturn]] void fail(const char* what) const {
    throw Error(ErrorCode::kIo, path_ + ": " + what + ": " + std::strerror(errno));
  }

  std::string path_;
  bool big_endian_;
  std::FILE* file_;
};

void require(bool fits, const std::string& path, const char* what) {
  if (!fits) throw Error(ErrorCode::kInvalidArgument, path + ": " + what);
}

}  // namespace

std::size_t size_bytes(SampleType type) {
  return type == SampleType::kFloat32 ? 4 : 2;
}

std::unique_ptr<Sink> make_raw_sink(const std::string& path, const Raster& /*raster*/, bool big_endian) {
  return std::make_unique<RawSink>(path, big_endian);
}

std::unique_ptr<Sink> make_sink(const std::string& name, const std::string& path, const Raster& raster) {
  std::string extension = std::filesystem::path(name).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool half = raster.type == SampleType::kFloat16;
  const bool real = half || raster.type == SampleType::kFloat32;
  if (extension == ".tif" || extension == ".tiff") {
    require(!half, name, "TIFF holds int16, uint16 or float32 here; half goes to .exr");
    return make_tiff_sink(path, raster);
  }
  if (extension == ".exr") {
    require(real, name, "OpenEXR holds half or float32; add --type float32");
    return make_exr_sink(path, raster);
  }
  if (extension == ".png") {
    require(raster.type == SampleType::kUint16, name, "PNG holds uint16; add --type uint16");
    require(!raster.voids, name, "PNG cannot mark voids");
    return make_png_sink(path, raster);
  }
  if (extension == ".hgt") {
    require(raster.type == SampleType::kInt16, name, ".hgt holds int16");
    require(raster.columns == raster.rows && (raster.rows == 1201 || raster.rows == 3601), name,
            ".hgt is 1201x1201 or 3601x3601");
    return make_raw_sink(path, raster, true);
  }
  if (extension == ".raw" || extension == ".r16" || extension == ".r32") {
    require(extension != ".r16" || raster.type == SampleType::kUint16, name, ".r16 holds uint16; add --type uint16");
    require(extension != ".r32" || raster.type == SampleType::kFloat32, name, ".r32 holds float32");
    return make_raw_sink(path, raster, false);
  }
  throw Error(ErrorCode::kInvalidArgument,
              name + ": unknown extension; .tif .exr .png .hgt .raw .r16 .r32 are written");
}

}  // namespace isohf::terrain
