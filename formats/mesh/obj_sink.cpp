#include <fmt/format.h>

#include <iterator>

#include "formats/mesh/mesh_sinks.h"
#include "isohf/base/output_file.h"

namespace isohf {
namespace {

/// Vertices count from 1 through the whole file.
class ObjSink final : public MeshSink {
 public:
  ObjSink(const std::string& path, const MeshSpec& spec) : MeshSink(path), file_(path, {.overwrite = spec.overwrite}) {
    for (const std::string& line : header_lines(spec)) file_.append("# " + line + "\n");
    file_.append("# x East, y up, z South\n");
  }

  void add(const MeshPiece& piece, std::span<const std::byte>) override {
    const std::int64_t first = vertices() + 1;
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "o tile_{}_{}\n", piece.tile.column, piece.tile.row);
    for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
      const auto& [position, normal] = piece.vertices[i];
      fmt::format_to(out, "v {:.10g} {:.9g} {:.10g}\nvt {:.7g} {:.7g}\nvn {:.6g} {:.6g} {:.6g}\n",
                     piece.corner.x + static_cast<double>(position[0]), position[1],
                     piece.corner.z + static_cast<double>(position[2]), piece.texture_places[i][0],
                     1.0F - piece.texture_places[i][1], normal[0], normal[1], normal[2]);
    }
    for (std::size_t i = 0; i < piece.indices.size(); i += 3) {
      text.push_back('f');
      for (std::size_t k = i; k < i + 3; ++k) {
        fmt::format_to(out, " {0}/{0}/{0}", first + piece.indices[k]);
      }
      text.push_back('\n');
    }
    file_.append(std::string_view(text.data(), text.size()));
  }
  void complete() override { file_.commit(); }

 private:
  OutputFile file_;
};

}  // namespace

std::unique_ptr<MeshSink> create_obj(const std::string& path, const MeshSpec& spec) {
  return std::make_unique<ObjSink>(path, spec);
}

}  // namespace isohf
