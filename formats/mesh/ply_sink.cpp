#include <fmt/format.h>

#include <cstring>
#include <limits>
#include <vector>

#include "formats/mesh/mesh_sinks.h"
#include "isohf/base/bytes.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kPlyVertexBytes = 24;
constexpr std::size_t kPlyFaceBytes = 13;
constexpr std::size_t kCopiedBytes = std::size_t{1} << 20U;

/// Vertices stand before faces: faces go to a file of their own first, which complete() appends. The counts in the header
/// have a fixed width and are filled in at the end.
class PlySink final : public MeshSink {
 public:
  PlySink(const std::string& path, const MeshSpec& spec)
      : MeshSink(path),
        spec_(spec),
        file_(path, {.overwrite = spec.overwrite}),
        faces_(path + ".faces", {.overwrite = true}) {
    file_.append(header());
  }

  void add(const MeshPiece& piece, std::span<const std::byte>) override {
    const std::int64_t first = vertices();
    if (first + static_cast<std::int64_t>(piece.vertices.size()) > std::numeric_limits<std::int32_t>::max()) {
      throw Error(ErrorCode::kInvalidArgument,
                  "a PLY file holds at most 2147483647 vertices; use `level` or `max_triangles`, or write .glb");
    }
    std::vector<std::byte> bytes(piece.vertices.size() * kPlyVertexBytes);
    std::byte* out = bytes.data();
    for (const auto& [position, normal] : piece.vertices) {
      const auto x = static_cast<float>(piece.corner.x + static_cast<double>(position[0]));
      const auto south = static_cast<float>(piece.corner.z + static_cast<double>(position[2]));
      for (const float value : {x, -south, position[1], normal[0], -normal[2], normal[1]}) {
        std::memcpy(out, &value, sizeof value);
        out += sizeof value;
      }
    }
    file_.append(bytes);
    bytes.resize(piece.indices.size() / 3 * kPlyFaceBytes);
    out = bytes.data();
    for (std::size_t i = 0; i < piece.indices.size(); i += 3) {
      *out++ = std::byte{3};
      for (std::size_t k = i; k < i + 3; ++k) {
        const auto index = static_cast<std::int32_t>(first + piece.indices[k]);
        std::memcpy(out, &index, sizeof index);
        out += sizeof index;
      }
    }
    faces_.append(bytes);
  }

  void complete() override {
    faces_.flush();
    std::vector<std::byte> part(kCopiedBytes);
    for (std::uint64_t at = 0; at < faces_.position();) {
      const std::size_t read = faces_.read_at(at, part);
      if (read == 0) throw Error(ErrorCode::kIo, "the faces cannot be read back");
      file_.append(std::span(part).first(read));
      at += read;
    }
    const std::string text = header();
    file_.flush();
    file_.write_at(0, std::as_bytes(std::span(text)));
    file_.commit();
  }

 private:
  [[nodiscard]] std::string header() const {
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& line : header_lines(spec_)) text += "comment " + line + "\n";
    text += "comment x East, y North, z up\n";
    text += fmt::format("element vertex {:010}\n", vertices());
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text += fmt::format("property float {}\n", name);
    text += fmt::format("element face {:010}\nproperty list uchar int vertex_indices\nend_header\n", triangles());
    return text;
  }

  MeshSpec spec_;
  OutputFile file_;
  OutputFile faces_;
};

}  // namespace

std::unique_ptr<MeshSink> create_ply(const std::string& path, const MeshSpec& spec) {
  return std::make_unique<PlySink>(path, spec);
}

}  // namespace isohf
