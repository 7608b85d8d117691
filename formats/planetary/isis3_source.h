#pragma once

#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether these first bytes are an ISIS 3 cube's label: Object = IsisCube.
[[nodiscard]] bool looks_like_isis3(std::span<const std::byte> head);

/// Opens an ISIS 3 cube with its label in the file, or a label whose ^Core names the file beside it
/// (USGS, ISIS 3 logical and physical cube formats): tiles or bands in
/// sequence, 8 and 16 bit integers, unsigned 32 bit integers and Real, both byte orders; Base and Multiplier are the
/// vertical offset and scale; special pixels (NULL and the saturations) are voids. Of several bands `options.channel`
/// picks one by its number from 0. The group Mapping places the samples in metres of its projection, whose name is
/// carried with target and radii. Memory is at most 1 MiB.
/// Throws Error naming file and label line: kIo, kCorrupt, kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_isis3(const std::string& path, const OpenOptions& options);

}  // namespace isohf
