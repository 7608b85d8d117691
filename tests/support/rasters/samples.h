#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/sample.h"
#include "isohf/raster.h"

namespace isohf::test {

/// Options that name a channel.
inline OpenOptions of_channel(const std::string& name) {
  OpenOptions options;
  options.channel = name;
  return options;
}

/// The samples of a window as the file stores them, in host order.
inline std::vector<std::byte> read_window(HeightSource& source, const Window& window) {
  std::vector<std::byte> samples(static_cast<std::size_t>(window.columns * window.rows) *
                                 size_bytes(source.info().sample_type));
  source.read_window(window, samples);
  return samples;
}

inline Window whole(const HeightSource& source) {
  return {0, 0, source.info().width, source.info().height};
}

inline std::vector<std::byte> read_whole(HeightSource& source) {
  return read_window(source, whole(source));
}

/// Sample `i` of `raw` as a number.
inline double value_at(SampleType type, std::span<const std::byte> raw, std::size_t i) {
  return with_stored_type(type, [&](auto stored) {
    return static_cast<double>(number_of(stored_at<decltype(stored)>(raw.subspan(i * sizeof stored).data())));
  });
}

/// All of them.
inline std::vector<double> values_of(SampleType type, std::span<const std::byte> raw) {
  std::vector<double> values(raw.size() / size_bytes(type));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = value_at(type, raw, i);
  return values;
}

inline std::vector<double> values_of(HeightSource& source) {
  return values_of(source.info().sample_type, read_whole(source));
}

/// Whether a sample is none, by the conventions of its file.
inline bool is_void(const SourceInfo& info, double value) {
  if (!std::isfinite(value) || value < info.valid_min || value > info.valid_max) return true;
  return std::find(info.void_values.begin(), info.void_values.end(), value) != info.void_values.end();
}

}  // namespace isohf::test
