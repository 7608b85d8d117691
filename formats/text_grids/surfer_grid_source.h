#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that begins with `head` is a grid of Golden Software's Surfer.
[[nodiscard]] bool looks_like_surfer_grid(std::span<const std::byte> head);

/// Opens a grid of Surfer (Golden Software, Surfer grid formats): text (DSAA), Surfer 6 (DSBB, float32) or Surfer 7
/// (DSRB, float64). Rows are stored from South to North; the numbers of text come as float64. Nodes are points; their
/// unit and system are unknown but for a .prj beside. Blanked nodes, 1.70141e38 and above or the grid's own value, are
/// void. Text is scanned once when it is opened, which tells where rows begin.
/// Throws Error naming the path: kIo, kCorrupt (with the place), kUnsupported (turned grids), kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_surfer_grid(const std::string& path, const OpenOptions& options);

}  // namespace isohf
