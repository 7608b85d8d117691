#include "formats/registry.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <span>

#include "formats/georeference/complete_system.h"
#include "formats/io/file_stamp.h"
#include "formats/io/foreign_file.h"
#include "formats/io/packed_files.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/file.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/text/text.h"
#include "isohf/base/void_values.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Enough for every signature.
constexpr std::size_t kHeadBytes = 512;

struct Head {
  std::array<std::byte, kHeadBytes> bytes{};
  std::size_t size = 0;
};

/// The file's first bytes; refuses whatever is not a readable regular file with something in it.
Head read_head(const std::string& path) {
  const auto refuse = [&](ErrorCode code, const std::string& why) { throw Error(code, {path, why, "", ""}); };
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    refuse(ErrorCode::kIo, errno == ENOENT ? "no such file" : std::strerror(errno));
  }
  if (S_ISDIR(status.st_mode)) refuse(ErrorCode::kIo, "is a folder; a raster file is wanted");
  if (!S_ISREG(status.st_mode)) refuse(ErrorCode::kIo, "is not a regular file; a raster must be seekable");
  if (status.st_size == 0) refuse(ErrorCode::kCorrupt, "is empty (0 bytes)");
  Head head;
  head.size = File(path, File::Mode::kRead).read_at(0, head.bytes);
  return head;
}

bool has_extension(const std::string& path, const Format& format) {
  const std::string name = lower_case(unpacked_name(path));
  return std::any_of(format.extensions.begin(), format.extensions.end(), [&](const std::string& extension) {
    return name.size() > extension.size() && name.ends_with(extension);
  });
}

const Format* reader_of(const std::string& path, std::span<const std::byte> head) {
  if (is_foreign_raster(path, head)) return nullptr;
  if (const Format* const format = format_of_head(head)) return format;
  for (const Format& format : native_formats()) {
    if (format.described != nullptr && format.described(path)) return &format;
  }
  for (const Format& format : native_formats()) {
    if (format.goes_by_name && has_extension(path, format)) return &format;
  }
  return nullptr;
}

/// Who reads the file; nullptr where nobody here does.
const Format* reader_for(const std::string& path, const OpenOptions& options) {
  if (member_path(path)) return &kPackedFormat;
  const Head head = read_head(path);
  const auto bytes = std::span(head.bytes).first(head.size);
  if (is_compressed(path, bytes)) return &kPackedFormat;
  return options.raw ? &kRawFormat : reader_of(path, bytes);
}

}  // namespace

const std::vector<Format>& native_formats() {
  static const std::vector<Format> formats = {
      kExrFormat,    kTiffFormat, kPngFormat,        kWebpFormat,   kPmtilesFormat, kAsciiGridFormat, kVrtFormat,
      kNetcdfFormat, kEnviFormat, kHeaderGridFormat, kPds3Format,   kPds4Format,    kIsis3Format,     kNpyFormat,
      kDtedFormat,   kXyzFormat,  kHgtFormat,        kPackedFormat, kRawFormat};
  return formats;
}

const Format* native_format_of(const std::string& path, const OpenOptions& options) {
  return reader_for(path, options);
}

const Format* format_of_head(std::span<const std::byte> head) {
  for (const Format& format : native_formats()) {
    if (format.recognises != nullptr && format.recognises(head)) return &format;
  }
  return nullptr;
}

bool has_raster_extension(const std::string& path) {
  return std::ranges::any_of(native_formats(), [&](const Format& format) { return has_extension(path, format); });
}

bool is_raster_in_folder(const std::string& path) {
  const std::filesystem::path file(path);
  std::string name = lower_case(file.filename().string());
  if (name.starts_with(".")) return false;
  if (has_archive_name(name)) return is_archive_of_rasters(path);
  name = unpacked_name(name);
  if (name.ends_with(".dat")) return kEnviFormat.described(path);
  // Headers and virtual rasters are about other files, and so is a label beside its image.
  if (name.ends_with(".hdr") || name.ends_with(".vrt")) return false;
  std::error_code none;
  const auto has_image = [&](const char* extension) {
    return std::filesystem::exists(std::filesystem::path(path).replace_extension(extension), none);
  };
  if (name.ends_with(".lbl") && (has_image(".img") || has_image(".IMG") || has_image(".Img"))) return false;
  return has_raster_extension(name);
}

std::string library_of(const Format& format) {
  return format.library != nullptr ? format.library() : "isohf";
}

namespace {

/// Numbers that no raster of ground has, and for which sizes and errors would be told in hundreds of digits.
void check_numbers(const SourceInfo& info) {
  constexpr double kLeast = 1e-12;
  constexpr double kMost = 1e12;
  const Georeference& place = info.georeference;
  const auto check = [&](const char* what, double value, double least) {
    if (std::abs(value) >= least && std::abs(value) <= kMost) return;
    throw Error(ErrorCode::kCorrupt, {fmt::format("{}: {}", info.path, what), fmt::format("{:.3g}", value),
                                      fmt::format("from {} to {}", least > 0.0 ? least : -kMost, kMost), ""});
  };
  check("the spacing of columns", place.spacing_x, kLeast);
  check("the spacing of rows", place.spacing_y, kLeast);
  if (place.has_origin) {
    check("the first sample's x", place.origin_x, 0.0);
    check("the first sample's y", place.origin_y, 0.0);
  }
}

/// What open_raster() hands out: its windows are held against the raster, once for all readers. A raster whose file
/// stays as it is while it is read: of one that another program writes, part would be old and part new, or not there
/// yet.
class UnchangedSource final : public HeightSource {
 public:
  UnchangedSource(std::unique_ptr<HeightSource> source, const FileStamp& stamp, const OpenOptions& options)
      : source_(std::move(source)), info_(source_->info()), stamp_(stamp) {
    warn_of_feet(options);
    warn_of_latitudes();
    take_heights_of_code();
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    require_window(info_.path, info_.width, info_.height, window, size_bytes(info_.sample_type), samples.size());
    source_->read_window(window, samples);
    require_unchanged(info_.path, stamp_);
    check_elevations(samples);
  }
  [[nodiscard]] bool is_gap(const Window& window) const override { return source_->is_gap(window); }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return source_->buffer_bytes(); }

 private:
  /// Heights beside coordinates in feet may be either, and nothing of the surface tells which.
  void warn_of_feet(const OpenOptions& options) {
    const Georeference& place = info_.georeference;
    const bool is_in_feet = place.unit == HorizontalUnit::kMetre && std::abs(place.metres_per_unit - 0.3048) < 1e-5;
    if (!is_in_feet || !info_.vertical_unit.empty() || options.z_scale) return;
    constexpr int kNavd88UsFeet = 6360;
    constexpr int kNavd88Feet = 8228;
    const bool is_us_foot = place.metres_per_unit != 0.3048;
    info_.warnings.push_back(fmt::format(
        "its coordinates are in feet, and nothing says what its elevations are in: they are taken for metres; "
        "{}`z_scale` {:.10g} turns feet into metres",
        place.system.epsg ? fmt::format("`reference_system` EPSG:{}+{} says that they are feet, ", *place.system.epsg,
                                        is_us_foot ? kNavd88UsFeet : kNavd88Feet)
                          : std::string(),
        place.metres_per_unit));
  }

  /// A system of three coordinates says what heights are above, whatever else the file says of them.
  void take_heights_of_code() {
    ReferenceSystem& system = info_.georeference.system;
    if (!system.vertical_datum.empty()) return;
    const bool is_in_degrees = info_.georeference.unit == HorizontalUnit::kDegree;
    // GDAL writes EPSG:4979 as the system of heights beside EPSG:4326.
    const auto code = system.vertical_epsg ? system.vertical_epsg : is_in_degrees ? system.epsg : std::nullopt;
    if (code && gives_heights_above_ellipsoid(*code)) system.vertical_datum = kAboveEllipsoid;
  }

  /// No ground is beyond a pole: degrees there are no degrees, or a part of the raster is margin.
  void warn_of_latitudes() {
    if (std::string text = latitude_warning(info_); !text.empty()) info_.warnings.emplace_back(std::move(text));
  }

  /// Numbers that no elevation is, and that no void value or range declares: one of them would stretch the codes of all
  /// others to nothing.
  void check_elevations(std::span<const std::byte> samples) const {
    if (info_.valid_max <= kBeyondAnyGround && info_.valid_min >= -kBeyondAnyGround) return;  // voids, then
    if (info_.sample_type == SampleType::kFloat32) check_floats<float>(samples);
    if (info_.sample_type == SampleType::kFloat64) check_floats<double>(samples);
  }

  template <typename Float>
  void check_floats(std::span<const std::byte> samples) const {
    const auto is_beyond = [](Float value) {
      return std::abs(value) > static_cast<Float>(kBeyondAnyGround) &&
             std::abs(value) <= std::numeric_limits<Float>::max();
    };
    const std::size_t count = samples.size() / sizeof(Float);
    const auto at = [&](std::size_t i) {
      Float value;
      std::memcpy(&value, samples.data() + i * sizeof(Float), sizeof(Float));
      return value;
    };
    int beyond = 0;
    for (std::size_t i = 0; i < count; ++i) beyond |= static_cast<int>(is_beyond(at(i)));
    for (std::size_t i = 0; beyond != 0 && i < count; ++i) {
      const double value = double{at(i)};
      if (!is_beyond(at(i)) || info_.is_nodata(value)) continue;
      throw Error(ErrorCode::kCorrupt, {info_.path, fmt::format("an elevation of {:.9g}", value),
                                        fmt::format("{} at most either way", kBeyondAnyGround),
                                        void_values_with(info_, {value}) + " takes it as nodata"});
    }
  }

  std::unique_ptr<HeightSource> source_;
  SourceInfo info_;  ///< its path is that of the samples, where a header was named
  FileStamp stamp_;
};

/// A raster whose system the user completes.
class PlacedSource final : public HeightSource {
 public:
  PlacedSource(std::unique_ptr<HeightSource> source, const OpenOptions& options)
      : source_(std::move(source)), info_(source_->info()) {
    const Georeference& place = info_.georeference;
    if (!place.has_origin && place.unit == HorizontalUnit::kUnknown && place.spacing_x == 1.0 &&
        place.spacing_y == 1.0) {
      throw Error(
          ErrorCode::kInvalidArgument,
          info_.path + ": has no coordinates that `reference_system` could be about; a world file gives it some");
    }
    try {
      complete_system(options.reference_system, info_);
      // Warnings that ask for it are answered.
      std::erase_if(info_.warnings, [](const Warning& text) { return text.find("`reference_system`") != text.npos; });
    } catch (const Error& error) {
      throw error.within(info_.path);
    }
    if (!options.z_scale) require_unit_of_heights(source_->info());
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    source_->read_window(window, samples);
  }
  [[nodiscard]] bool is_gap(const Window& window) const override { return source_->is_gap(window); }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return source_->buffer_bytes(); }

 private:
  /// Samples stay as they are: a system with heights in another unit would make hills of mountains.
  void require_unit_of_heights(const SourceInfo& own) const {
    constexpr double kSame = 1e-9;
    const double factor = own.metres_per_vertical_unit / info_.metres_per_vertical_unit;
    if (own.vertical_unit.empty() || std::abs(factor - 1.0) < kSame) return;
    throw Error(
        ErrorCode::kInvalidArgument,
        {info_.path,
         fmt::format("elevations in {}, which `reference_system` takes for {}", own.vertical_unit, info_.vertical_unit),
         "the same unit", fmt::format("`z_scale` {:.12g} converts them, a system without heights keeps them", factor)});
  }

  std::unique_ptr<HeightSource> source_;
  SourceInfo info_;
};

}  // namespace

std::unique_ptr<HeightSource> open_by_content(const std::string& path, const OpenOptions& options) {
  const Format* const format = reader_for(path, options);
  if (format == nullptr) return open_with_oiio(path, options);
  if (!options.part.empty() && !format->takes_part) {
    throw Error(
        ErrorCode::kInvalidArgument,
        path + ": has no parts; `part` is for archives, TIFF and OpenEXR files of several, and zoom levels of tiles");
  }
  if (!options.encoding.empty() && !format->takes_encoding) {
    throw Error(ErrorCode::kInvalidArgument, path + ": has no colours; `encoding` is for pictures and tiles of them");
  }
  return format->open(path, options);
}

std::unique_ptr<HeightSource> open_raster(const std::string& path, const OpenOptions& options) {
  require_known("`registration`", options.registration.value_or(Registration::kPoint), Registration::kPoint);
  if (options.raw) require_known("`raw`: its type", options.raw->type, SampleType::kFloat64);
  try {
    const FileStamp named = FileStamp::of(path);
    std::unique_ptr<HeightSource> source = open_by_content(path, options);
    // A header that was named is read for good by now.
    const std::string& samples = source->info().path;
    const FileStamp stamp = samples == path ? named : FileStamp::of(samples);
    require_unchanged(path, named);
    if (!options.reference_system.empty()) {
      source = std::make_unique<PlacedSource>(std::move(source), options);
    }
    check_numbers(source->info());
    return std::make_unique<UnchangedSource>(std::move(source), stamp, options);
  } catch (const Error& error) {
    throw error.at(path);  // which every reader's message names
  }
}

}  // namespace isohf
