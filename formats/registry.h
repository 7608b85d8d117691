#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/surface/height_source.h"

namespace isohf {

/// What the samples of a file without a header are.
struct RawLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  SampleType type = SampleType::kUint16;
  bool big_endian = false;
};

/// What a user may say about an input that the file does not, or says wrongly.
struct OpenOptions {
  std::string channel;                       ///< channel name or zero-based number; empty: the reader's choice
  std::string part;                          ///< of a file of several parts: name or zero-based number
  std::optional<Registration> registration;  ///< overrides the file's
  std::vector<double> void_values;           ///< override the file's; empty: the file's
  std::optional<double> z_scale;             ///< elevation = raw * z_scale + z_offset; overrides the file's
  std::optional<double> z_offset;
  std::optional<double> spacing;  ///< sample spacing in metres, for files that do not say; overrides
  std::optional<RawLayout> raw;   ///< the file is nothing but these samples, whatever its name and content say
  /// What all files that are open at once may hold of the contents that they have packed (.gz, .zip): contents that
  /// do not fit are unpacked piece by piece whenever they are read.
  std::uint64_t unpacked_bytes = std::uint64_t{256} << 20U;
  VoidTreatment voids;  ///< for whoever wraps the source in a FilledSource; open_source does not
};

/// One row of a table of formats.
struct Format {
  const char* name;                     ///< "OpenEXR"
  std::vector<const char*> extensions;  ///< ".exr"; lower case
  std::string (*library)() = nullptr;   ///< "libpng 1.6.39": who reads or writes it; nullptr: isohf's own code
  std::string note = {};                ///< what is special: an option that it takes or needs, samples that it holds
};

/// The formats read natively, in the order in which they are tried.
[[nodiscard]] const std::vector<Format>& native_formats();

/// The native format in which open_source() would read this file; nullptr where none knows it. Throws Error{kIo,
/// kCorrupt} as open_source does for what is no readable file.
[[nodiscard]] const Format* native_format_of(const std::string& path, const OpenOptions& options);

/// The native format whose signature a file's first 256 bytes hold; nullptr where they hold none.
[[nodiscard]] const Format* format_of_head(std::span<const std::byte> head);

/// "libtiff 4.5.0", or "isohf".
[[nodiscard]] std::string library_of(const Format& format);

/// Names a folder in which the OpenImageIO module is looked for first; empty: only beside the program and in
/// ../lib/isohf. A program calls it before it opens anything.
void set_module_folder(const std::string& folder);

/// Opens a raster of elevations by its content, not by its name: the file's first bytes pick the reader; the extension
/// decides only for formats without a signature (.hgt), options.raw before both. What no native reader knows goes to
/// the OpenImageIO module. Throws Error naming the path: kIo (missing, folder, unreadable), kUnsupported (unknown
/// format, with what is read), kCorrupt (empty, truncated, absurd sizes), kInvalidArgument (no such channel, with those
/// there are).
[[nodiscard]] std::unique_ptr<HeightSource> open_source(const std::string& path, const OpenOptions& options);

}  // namespace isohf
