#pragma once

#include <memory>
#include <optional>
#include <string>

#include "isohf/archive/textures/texture_info.h"
#include "isohf/convert.h"
#include "program.h"

namespace isohf::cli {

/// --texture and --texture-size.
struct TextureOptions {
  std::string photo;  ///< empty: no textures
  std::optional<int> max_size;
};

void add_texture_options(CLI::App& line, TextureOptions& options);
/// Opens the photo of a source and fills `request`, which points to it; nullptr where none was asked for.
[[nodiscard]] std::unique_ptr<PhotoSource> open_texture(const TextureOptions& options, const SourceInfo& source,
                                                        std::optional<TextureRequest>& request);

/// "1024 x 1024 texels a tile, 8 levels, jpeg 90: 1040 members, 12.3 MB; 0.87 photo pixels a texel". 0 pixels: left
/// out.
[[nodiscard]] std::string describe_textures(const TextureInfo& info, double pixels_per_texel);

}  // namespace isohf::cli
