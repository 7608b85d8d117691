#include "formats/mesh/create_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "formats/io/raw_file.h"
#include "formats/mesh/mesh_sinks.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Create = std::unique_ptr<MeshSink> (*)(const std::string& path, const MeshSpec& spec);

struct MeshFormat {
  const char* extension;
  Create create;
  std::array<std::string_view, 4> begins;  ///< how its files begin
};

constexpr MeshFormat kFormats[] = {{".glb", create_glb, {"glTF"}},
                                   {".obj", create_obj, {"# ", "v ", "o ", "mtll"}},
                                   {".ply", create_ply, {"ply\n", "ply\r"}}};

const MeshFormat* format_of(const std::string& path) {
  const std::string extension = extension_of(path);
  for (const MeshFormat& format : kFormats) {
    if (extension == format.extension) return &format;
  }
  return nullptr;
}

}  // namespace

bool is_mesh_name(const std::string& path) {
  return format_of(path) != nullptr;
}

bool is_textured_mesh_name(const std::string& path) {
  return extension_of(path) == ".glb";
}

bool begins_as_mesh(const std::string& path, std::string_view head) {
  const MeshFormat* const format = format_of(path);
  return format != nullptr && std::ranges::any_of(format->begins, [&](std::string_view begin) {
           return !begin.empty() && head.starts_with(begin);
         });
}

std::unique_ptr<MeshSink> create_mesh(const std::string& path, const MeshSpec& spec) {
  const MeshFormat* const format = format_of(path);
  if (format == nullptr) {
    throw Error(ErrorCode::kInvalidArgument, path + ": the name of a mesh ends in .glb, .obj or .ply");
  }
  try {
    return format->create(path, spec);
  } catch (const Error& error) {
    throw error.within(path);
  }
}

std::vector<std::string> header_lines(const MeshSpec& spec) {
  std::vector<std::string> lines = {fmt::format("{}, written by {}", spec.name, spec.producer),
                                    fmt::format("unit: {}; elevations times {:.9g}", spec.unit, spec.elevation_scale)};
  if (spec.origin) {
    lines.push_back(fmt::format("origin: {:.12g} East, {:.12g} North in {}", spec.origin->easting,
                                spec.origin->northing, spec.crs.empty() ? "an unknown system" : spec.crs));
  }
  if (spec.origin_geo) {
    lines.push_back(fmt::format("origin: longitude {:.10g}, latitude {:.10g}", spec.origin_geo->longitude,
                                spec.origin_geo->latitude));
  }
  for (std::string& line : lines) {
    for (char& c : line) c = static_cast<unsigned char>(c) < 0x20U ? ' ' : c;
  }
  return lines;
}

}  // namespace isohf
