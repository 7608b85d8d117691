#include "input/options_texture.h"

#include <fmt/format.h>

#include <bit>

#include "formats/georeference/reference_system.h"
#include "isohf/error.h"
#include "isohf/photo/texture_cutter.h"
#include "isohf/picture.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"

namespace isohf::cli {

void add_texture_options(CLI::App& line, TextureOptions& options) {
  CLI::Option* const photo =
      option(line, "--texture", "PHOTO",
             "Cut a texture for every tile from a picture, placed by its georeference, else over "
             "the whole input",
             options.photo);
  option(line, "--texture-size", "N", "At most N texels a side, a power of two from 64 to 4096 [default: 1024]",
         [&options](const std::string& text) {
           const std::int64_t size = parse_whole_number(text, kMinTextureSize, kMaxTextureSize);
           if (!std::has_single_bit(static_cast<std::uint64_t>(size))) {
             throw Error(ErrorCode::kInvalidArgument, fmt::format("found '{}', must be a power of two", text));
           }
           options.max_size = static_cast<int>(size);
         })
      ->needs(photo);
}

std::unique_ptr<PhotoSource> open_texture(const TextureOptions& options, const SourceInfo& source,
                                          std::optional<TextureRequest>& request) {
  if (options.photo.empty()) return nullptr;
  std::unique_ptr<PhotoSource> photo = open_photo(options.photo);
  request.emplace();
  request->max_size = options.max_size.value_or(request->max_size);
  request->photo = photo.get();
  if (const auto& place = photo->info().georeference; place && source.georeference.has_origin) {
    request->same_system = are_same(place->system, source.georeference.system);
  }
  return photo;
}

std::string describe_textures(const TextureInfo& info, double pixels_per_texel) {
  std::string text =
      fmt::format("{0} x {0} texels a tile, {1} levels, {2}{3}, {4}: {5} members, {6}", info.size, info.levels,
                  to_string(info.format), info.format == TextureFormat::kJpeg ? fmt::format(" {}", info.quality) : "",
                  info.channels == 1 ? "grey" : (info.channels == 3 ? "RGB" : "RGBA"), describe_count(info.members),
                  describe_bytes(info.bytes));
  if (pixels_per_texel > 0.0) text += fmt::format("; {:.3g} photo pixels a texel", pixels_per_texel);
  return text;
}

}  // namespace isohf::cli
