#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a NAME.EXT.json is beside the raster NAME.EXT.
[[nodiscard]] bool has_raster_description(const std::string& raster_path);

/// What isohf writes beside rasters that have no room for it (raster_sidecars.h), read again: what the samples are,
/// what they mean and where they lie; all but the reference system's text and ellipsoid.
/// Every member throws Error{kCorrupt} naming the .json where it says something that isohf would not have written.
class RasterDescription {
 public:
  /// Throws also Error{kIo}.
  explicit RasterDescription(const std::string& raster_path);
  ~RasterDescription();
  RasterDescription(const RasterDescription&) = delete;
  RasterDescription& operator=(const RasterDescription&) = delete;

  /// "png", "raw samples"; empty where it names none.
  [[nodiscard]] std::string format() const { return word("format"); }

  /// Of raw samples, which say nothing of themselves.
  [[nodiscard]] RawLayout layout() const;

  /// Refuses a description of a raster of another format, size or sample type than `info` has.
  void require(const std::string& format, const SourceInfo& info) const;

  /// Fills in scale, offset, void value, unit and georeference; info.sample_type must be known.
  void describe(SourceInfo& info) const;

 private:
  [[noreturn]] void refuse(const std::string& what) const;
  void describe_place(Georeference& place) const;
  [[nodiscard]] std::int64_t side(const char* key) const;
  [[nodiscard]] SampleType sample_type() const;
  /// nullopt where it is absent or null.
  [[nodiscard]] std::optional<double> number(const char* key) const;
  [[nodiscard]] std::optional<int> code(const char* key) const;
  /// Empty where it is absent.
  [[nodiscard]] std::string word(const char* key) const;

  std::string path_;
  struct Json;
  std::unique_ptr<Json> json_;
};

}  // namespace isohf
