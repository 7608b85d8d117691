#pragma once

#include <memory>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// Which way a geoid moves elevations.
enum class GeoidShift {
  kToEllipsoidal,  ///< elevations above the geoid become heights above the ellipsoid
  kToOrthometric,  ///< the other way
};

/// A geoid model's file and what to do with it.
struct GeoidRequest {
  std::string path;  ///< GeographicLib's .pgm; empty: no geoid
  GeoidShift shift = GeoidShift::kToEllipsoidal;

  /// "FILE", "FILE:to-ellipsoidal" or "FILE:to-orthometric".
  [[nodiscard]] static GeoidRequest parse(const std::string& text);
};

/// A source whose elevations are moved by the geoid's height above the ellipsoid, sample by sample, before anything is
/// resampled. Samples become float32, or float64 where they had more than 24 bits; voids stay voids and become NaN.
///
/// Keeps a strip of the geoid's rows in memory, whatever the source's size, and the samples of the last window as the
/// other source has them.
class GeoidSource final : public HeightSource {
 public:
  /// Throws Error{kInvalidArgument} for a source without degrees, or of another body than the Earth; Error{kIo,
  /// kCorrupt} where the file cannot be used.
  GeoidSource(std::unique_ptr<HeightSource> source, const GeoidRequest& request);
  ~GeoidSource() override;

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override;
  [[nodiscard]] bool is_gap(const Window& window) const override { return source_->is_gap(window); }
  [[nodiscard]] std::uint64_t buffer_bytes() const override;

 private:
  class Model;

  std::unique_ptr<HeightSource> source_;
  SourceInfo info_;
  double sign_;
  std::unique_ptr<Model> model_;
  std::vector<std::byte> raw_;
  std::vector<double> elevations_;  ///< of a row
  std::vector<double> shift_;
};

}  // namespace isohf
