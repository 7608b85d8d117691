#include "formats/mesh/create_mesh.h"

#include <fmt/format.h>

#include <utility>

#include "formats/io/raw_file.h"
#include "formats/mesh/mesh_sinks.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Create = std::unique_ptr<MeshSink> (*)(const std::string& path, const MeshSpec& spec);

constexpr std::pair<const char*, Create> kFormats[] = {
    {".glb", create_glb}, {".obj", create_obj}, {".ply", create_ply}};

/// Names the file in what goes wrong.
class NamedSink final : public MeshSink {
 public:
  NamedSink(std::string path, std::unique_ptr<MeshSink> sink) : path_(std::move(path)), sink_(std::move(sink)) {}
  void write(const MeshPiece& piece, std::span<const std::byte> picture) override {
    try {
      sink_->write(piece, picture);
    } catch (const Error& error) {
      throw error.within(path_);
    }
    count(piece);
  }
  void finish() override {
    try {
      sink_->finish();
    } catch (const Error& error) {
      throw error.within(path_);
    }
  }

 private:
  std::string path_;
  std::unique_ptr<MeshSink> sink_;
};

}  // namespace

bool is_mesh_name(const std::string& path) {
  const std::string extension = extension_of(path);
  for (const auto& [known, create] : kFormats) {
    if (extension == known) return true;
  }
  return false;
}

bool is_textured_mesh_name(const std::string& path) {
  return extension_of(path) == ".glb";
}

std::unique_ptr<MeshSink> create_mesh(const std::string& path, const MeshSpec& spec) {
  const std::string extension = extension_of(path);
  for (const auto& [known, create] : kFormats) {
    if (extension != known) continue;
    try {
      return std::make_unique<NamedSink>(path, create(path, spec));
    } catch (const Error& error) {
      throw error.within(path);
    }
  }
  throw Error(ErrorCode::kInvalidArgument, path + ": the name of a mesh ends in .glb, .obj or .ply");
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
