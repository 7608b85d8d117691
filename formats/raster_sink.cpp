#include "formats/raster_sink.h"

#include <fmt/format.h>

#include <fstream>
#include <limits>

#include "formats/letter_case.h"
#include "formats/libraries.h"
#include "formats/output_part.h"
#include "formats/output_stream.h"
#include "formats/raster_encoder.h"
#include "formats/raster_sidecars.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

struct Writer {
  Format format;
  std::unique_ptr<RasterEncoder> (*encode)(const std::string& path, const RasterSpec& spec);
};

const std::vector<Writer>& writers() {
  static const std::vector<Writer> table = {
      {{"GeoTIFF", {".tif", ".tiff"}, tiff_library, "samples of any type"}, encode_tiff},
      {{"OpenEXR", {".exr"}, exr_library, "float16, float32, uint32"}, encode_exr},
      {{"PNG", {".png"}, png_library, "uint8, uint16"}, encode_png},
      {{"SRTM HGT", {".hgt"}, nullptr, "int16; 1201x1201, 3601x3601 or 1801x3601"}, encode_hgt},
      {{"ESRI ASCII grid", {".asc"}, nullptr, "samples of any type"}, encode_asc},
      {{"GridFloat", {".flt"}, nullptr, "float32; with .hdr"}, encode_flt},
      {{"raw 16 bit", {".r16", ".raw"}, nullptr, "uint16; with .json"}, encode_r16},
      {{"raw 32 bit", {".r32"}, nullptr, "float32; with .json"}, encode_r32},
      {{"NumPy", {".npy"}, nullptr, "samples of any type"}, encode_npy},
  };
  return table;
}

std::string lower_extension(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos || path.find('/', dot) != std::string::npos) return {};
  return lower_case(path.substr(dot));
}

const Writer& writer_for(const std::string& path) {
  const std::string extension = lower_extension(path);
  for (const Writer& writer : writers()) {
    for (const char* known : writer.format.extensions) {
      if (extension == known) return writer;
    }
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("no writer for the extension \"{}\"; there are {}", extension,
                                                   fmt::join(writable_extensions(), " ")));
}

void check(const RasterSpec& spec) {
  constexpr std::int64_t kMaxSide = std::numeric_limits<std::int32_t>::max();
  if (spec.width < 1 || spec.height < 1 || spec.width > kMaxSide || spec.height > kMaxSide) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("a raster of {} x {} samples, must be 1...{} on each side",
                                                         spec.width, spec.height, kMaxSide));
  }
  if (spec.channels != 1 && spec.channels != 3 && spec.channels != 4) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} channels, must be 1, 3 or 4", spec.channels));
  }
}

/// Whether the file is there already, as it would be written: rasters of one name may share a .prj.
bool holds(const Sidecar& sidecar) {
  std::ifstream in(sidecar.path, std::ios::binary);
  std::string text(sidecar.text.size() + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  return in.gcount() == static_cast<std::streamsize>(sidecar.text.size()) && text.starts_with(sidecar.text);
}

std::vector<std::unique_ptr<OutputPart>> begin_sidecars(const std::string& path, const RasterSpec& spec) {
  std::vector<std::unique_ptr<OutputPart>> parts;
  for (const Sidecar& sidecar : sidecars_of(path, spec)) {
    if (holds(sidecar)) continue;
    try {
      parts.push_back(std::make_unique<OutputPart>(sidecar.path, spec.overwrite));
      OutputStream out(parts.back()->path());
      out.write(sidecar.text);
      out.close();
    } catch (const Error& error) {
      throw error.within(sidecar.path);
    }
  }
  return parts;
}

}  // namespace

RasterSink::RasterSink(std::string path, const RasterSpec& spec, std::unique_ptr<OutputPart> part,
                       std::vector<std::unique_ptr<OutputPart>> sidecars, std::unique_ptr<RasterEncoder> encoder)
    : path_(std::move(path)),
      spec_(spec),
      part_(std::move(part)),
      sidecars_(std::move(sidecars)),
      encoder_(std::move(encoder)) {}

RasterSink::~RasterSink() = default;

void RasterSink::write_rows(std::span<const std::byte> rows) {
  const std::size_t one_row = row_bytes(spec_);
  const auto count = static_cast<std::int64_t>(rows.size() / one_row);
  if (rows.size() % one_row != 0 || count > spec_.height - rows_written_) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} bytes after row {} of {}, must be whole rows of {} bytes", path_, rows.size(),
                            rows_written_, spec_.height, one_row));
  }
  if (count == 0) return;
  try {
    encoder_->write(rows, count);
  } catch (const Error& error) {
    throw error.within(path_);
  }
  rows_written_ += count;
}

void RasterSink::finish() {
  if (rows_written_ != spec_.height || !encoder_) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: finished after {} of {} rows", path_, rows_written_, spec_.height));
  }
  try {
    encoder_->close();
    encoder_.reset();
    // What the name stands for is complete when it appears.
    for (const auto& sidecar : sidecars_) sidecar->commit();
    part_->commit();
  } catch (const Error& error) {
    throw error.within(path_);
  }
}

std::unique_ptr<RasterSink> create_raster(const std::string& path, const RasterSpec& spec) {
  try {
    const Writer& writer = writer_for(path);
    check(spec);
    auto part = std::make_unique<OutputPart>(path, spec.overwrite);
    auto sidecars = begin_sidecars(path, spec);
    auto encoder = writer.encode(part->path(), spec);
    return std::make_unique<RasterSink>(path, spec, std::move(part), std::move(sidecars), std::move(encoder));
  } catch (const Error& error) {
    throw error.within(path);
  }
}

const std::vector<std::string>& writable_extensions() {
  static const std::vector<std::string> extensions = [] {
    std::vector<std::string> list;
    for (const Format& format : writable_formats()) {
      list.insert(list.end(), format.extensions.begin(), format.extensions.end());
    }
    return list;
  }();
  return extensions;
}

const std::vector<Format>& writable_formats() {
  static const std::vector<Format> formats = [] {
    std::vector<Format> list;
    for (const Writer& writer : writers()) list.push_back(writer.format);
    return list;
  }();
  return formats;
}

}  // namespace isohf
