#include "isohf/fill/geoid_source.h"

#include <fmt/format.h>

#include <GeographicLib/Geoid.hpp>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/sampling/source/read_step.h"

namespace isohf {
namespace {

/// Degrees of latitude whose rows of the geoid are kept: 5 MB of the finest model all round the Earth.
constexpr double kStrip = 2.0;
constexpr double kNoStrip = std::numeric_limits<double>::quiet_NaN();

constexpr const char* kToEllipsoidal = ":to-ellipsoidal";
constexpr const char* kToOrthometric = ":to-orthometric";

struct KnownGeoid {
  const char* name;
  const char* title;
  int epsg;
};
constexpr KnownGeoid kKnown[] = {
    {"egm2008", "EGM2008 height", 3855}, {"egm96", "EGM96 height", 5773}, {"egm84", "EGM84 height", 5798}};

bool has_more_than_24_bits(SampleType type) {
  return type == SampleType::kUint32 || type == SampleType::kInt32 || type == SampleType::kFloat64;
}

/// Elevations in double, NaN where void, of samples as stored.
void elevations_from(const SourceInfo& info, std::span<const std::byte> raw, std::vector<double>& out) {
  const std::size_t bytes = size_bytes(info.sample_type);
  out.resize(raw.size() / bytes);
  // Whole numbers of more than 24 bits do not pass through floats.
  const auto convert = [&](auto sample) {
    using T = decltype(sample);
    for (std::size_t i = 0; i < out.size(); ++i) {
      T value;
      std::memcpy(&value, raw.data() + i * bytes, sizeof value);
      const auto number = static_cast<double>(value);
      out[i] =
          info.is_nodata(number) ? std::numeric_limits<double>::quiet_NaN() : number * info.z_scale + info.z_offset;
    }
  };
  switch (info.sample_type) {
    case SampleType::kUint32:
      return convert(std::uint32_t{});
    case SampleType::kInt32:
      return convert(std::int32_t{});
    case SampleType::kFloat64:
      return convert(double{});
    default:
      break;
  }
  std::vector<float> heights(out.size());
  heights_from_samples(info, 0.0, raw, heights);
  std::copy(heights.begin(), heights.end(), out.begin());
}

}  // namespace

GeoidRequest GeoidRequest::parse(const std::string& text) {
  GeoidRequest request;
  request.path = text;
  for (const auto& [suffix, shift] :
       {std::pair{kToEllipsoidal, GeoidShift::kToEllipsoidal}, std::pair{kToOrthometric, GeoidShift::kToOrthometric}}) {
    if (!text.ends_with(suffix)) continue;
    request.path = text.substr(0, text.size() - std::strlen(suffix));
    request.shift = shift;
  }
  if (!request.path.ends_with(".pgm")) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("found '{}', must be a geoid's FILE.pgm, FILE.pgm:to-ellipsoidal or FILE.pgm:to-orthometric",
                    text));
  }
  return request;
}

/// The geoid's heights, a strip of it in memory.
class GeoidSource::Model {
 public:
  explicit Model(const std::string& path) : path_(path) {
    const std::filesystem::path file(path);
    if (std::error_code error; !std::filesystem::is_regular_file(file, error)) {
      throw Error(ErrorCode::kIo, fmt::format("{}: no such file; geoids come with GeographicLib "
                                              "(geographiclib-get-geoids)",
                                              path));
    }
    // Twice as many columns as rows, less one, of two bytes: a little more than there are.
    std::error_code ignored;
    per_degree_ = std::sqrt(static_cast<double>(std::filesystem::file_size(file, ignored))) / 360.0;
    try {
      const std::string folder = file.parent_path().empty() ? "." : file.parent_path().string();
      geoid_ = std::make_unique<GeographicLib::Geoid>(file.stem().string(), folder);
    } catch (const std::exception& error) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: is no geoid of GeographicLib's: {}", path, error.what()));
    }
  }

  /// Heights above the ellipsoid of a row of places, metres.
  void row(double latitude, double longitude, double step, std::span<double> out) {
    try {
      keep(latitude, longitude, longitude + step * static_cast<double>(out.size() - 1));
      for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = (*geoid_)(latitude, longitude + step * static_cast<double>(i));
      }
    } catch (const std::exception& error) {
      throw Error(ErrorCode::kIo, fmt::format("{}: {}", path_, error.what()));
    }
  }

  /// Of the strip that is kept, so many degrees of longitude wide.
  [[nodiscard]] std::uint64_t strip_bytes(double degrees) const {
    return static_cast<std::uint64_t>((degrees * per_degree_ + 8.0) * (kStrip * per_degree_ + 8.0) *
                                      sizeof(std::uint16_t));
  }

 private:
  void keep(double latitude, double west, double east) {
    if (latitude <= north_ && latitude >= south_ && west >= west_ && east <= east_) return;
    north_ = std::min(std::ceil(latitude / kStrip) * kStrip, 90.0);
    south_ = std::max(north_ - kStrip, -90.0);
    west_ = west;
    east_ = east;
    geoid_->CacheArea(south_, west_, north_, std::min(east_, west_ + 359.999));
  }

  std::string path_;
  std::unique_ptr<GeographicLib::Geoid> geoid_;
  double per_degree_ = 0.0;  ///< its samples
  double north_ = kNoStrip;
  double south_ = kNoStrip;
  double west_ = kNoStrip;
  double east_ = kNoStrip;
};

GeoidSource::GeoidSource(std::unique_ptr<HeightSource> source, const GeoidRequest& request)
    : source_(std::move(source)),
      info_(source_->info()),
      sign_(request.shift == GeoidShift::kToEllipsoidal ? 1.0 : -1.0) {
  const Georeference& place = info_.georeference;
  if (place.unit != HorizontalUnit::kDegree || !place.has_origin) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: `geoid` needs an input in degrees with a place; shift this one before it is projected",
                            info_.path));
  }
  if (!place.system.body.empty() && place.system.body != "Earth") {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: `geoid` holds for the Earth, the input shows {}", info_.path, place.system.body));
  }
  model_ = std::make_unique<Model>(request.path);
  info_.sample_type = has_more_than_24_bits(info_.sample_type) ? SampleType::kFloat64 : SampleType::kFloat32;
  info_.void_values.clear();
  info_.valid_min = -std::numeric_limits<double>::infinity();
  info_.valid_max = std::numeric_limits<double>::infinity();
  info_.z_scale = 1.0;
  info_.z_offset = 0.0;
  ReferenceSystem& system = info_.georeference.system;
  const std::string& datum = system.vertical_datum;
  const bool is_ellipsoidal = datum.find("llipsoid") != std::string::npos;
  const bool is_orthometric = !is_ellipsoidal && (!datum.empty() || system.vertical_epsg);
  const bool was_orthometric_wanted = request.shift == GeoidShift::kToOrthometric;
  if (was_orthometric_wanted ? is_orthometric : is_ellipsoidal) {
    info_.warnings.push_back(
        fmt::format("{}: heights are above {} already, and `geoid` moves them once more, to {}; leave it out, or give "
                    "the other way",
                    info_.path, datum.empty() ? fmt::format("EPSG:{}", *system.vertical_epsg) : datum,
                    was_orthometric_wanted ? "orthometric heights" : "ellipsoidal heights"));
  }
  const std::string name = std::filesystem::path(request.path).stem().string();
  system.vertical_epsg.reset();
  if (request.shift == GeoidShift::kToEllipsoidal) {
    system.vertical_datum = fmt::format("the ellipsoid, by {}", name);
    return;
  }
  system.vertical_datum = name;
  for (const KnownGeoid& known : kKnown) {
    if (!name.starts_with(known.name)) continue;
    system.vertical_datum = known.title;
    system.vertical_epsg = known.epsg;
  }
}

GeoidSource::~GeoidSource() = default;

void GeoidSource::read_window(const Window& window, std::span<std::byte> samples) {
  const SourceInfo& from = source_->info();
  const Georeference& place = info_.georeference;
  const auto columns = static_cast<std::size_t>(window.columns);
  const std::size_t row_bytes = columns * size_bytes(from.sample_type);
  raw_.resize(row_bytes * static_cast<std::size_t>(window.rows));
  source_->read_window(window, raw_);
  shift_.resize(columns);
  const double factor = sign_ / info_.metres_per_vertical_unit;
  std::byte* out = samples.data();
  for (std::int64_t r = 0; r < window.rows; ++r) {
    elevations_from(from, std::span(raw_).subspan(static_cast<std::size_t>(r) * row_bytes, row_bytes), elevations_);
    const double latitude = place.origin_y - place.spacing_y * static_cast<double>(window.row + r);
    const double longitude = place.origin_x + place.spacing_x * static_cast<double>(window.column);
    // Half a pixel beyond a pole there is no other latitude.
    model_->row(std::clamp(latitude, -90.0, 90.0), longitude, place.spacing_x, shift_);
    for (std::size_t c = 0; c < columns; ++c) elevations_[c] += factor * shift_[c];
    if (info_.sample_type == SampleType::kFloat64) {
      std::memcpy(out, elevations_.data(), columns * sizeof(double));
      out += columns * sizeof(double);
      continue;
    }
    for (std::size_t c = 0; c < columns; ++c, out += sizeof(float)) {
      const auto height = static_cast<float>(elevations_[c]);
      std::memcpy(out, &height, sizeof height);
    }
  }
}

std::uint64_t GeoidSource::buffer_bytes() const {
  // Who reads a strip at a time reads about so much.
  constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;
  const ReadStep step = ReadStep::make(info_, kReadBytes);
  const std::uint64_t window = step.most_bytes(info_) / size_bytes(info_.sample_type);
  const std::uint64_t row = 2 * sizeof(double) * static_cast<std::uint64_t>(info_.width);
  const double columns = std::min(static_cast<double>(info_.width) * info_.georeference.spacing_x, 360.0);
  return source_->buffer_bytes() + window * size_bytes(source_->info().sample_type) + row +
         model_->strip_bytes(columns);
}

}  // namespace isohf
