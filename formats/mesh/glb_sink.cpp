#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "formats/mesh/mesh_sinks.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::uint64_t kHeaderBytes = 12;
constexpr std::uint64_t kChunkHeaderBytes = 8;
/// Room for the text in front of the triangles: what stands there once, and for each piece. Unused room is spaces.
constexpr std::uint64_t kTextBytes = 8192;
constexpr std::uint64_t kTextBytesOfPiece = 2048;

constexpr int kFloat = 5126;
constexpr int kUint16 = 5123;
constexpr int kUint32 = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr std::size_t kVertexBytes = 32;  ///< position, normal, texture coordinates

/// Parts of the binary chunk begin at multiples of four.
std::size_t padded(std::size_t bytes) {
  return (bytes + 3) / 4 * 4;
}

class GlbSink final : public MeshSink {
 public:
  GlbSink(const std::string& path, const MeshSpec& spec)
      : MeshSink(path),
        spec_(spec),
        text_room_(kTextBytes + kTextBytesOfPiece * static_cast<std::uint64_t>(spec.pieces)),
        file_(path, {.overwrite = spec.overwrite}) {
    if (text_room_ > std::numeric_limits<std::uint32_t>::max() / 2) refuse();
    file_.append(std::string(kHeaderBytes + kChunkHeaderBytes + text_room_ + kChunkHeaderBytes, ' '));
    binary_ = file_.position();
    nodes_.push_back({{"name", spec.name}, {"children", ordered_json::array()}, {"extras", extras()}});
    materials_.push_back(material());
  }

  void add(const MeshPiece& piece, std::span<const std::byte> picture) override {
    const std::size_t vertices = add_view(vertex_bytes(piece), kArrayBuffer, kVertexBytes);
    const bool is_wide = piece.vertices.size() > std::numeric_limits<std::uint16_t>::max();
    const std::size_t indices = add_view(
        is_wide ? index_bytes<std::uint32_t>(piece) : index_bytes<std::uint16_t>(piece), kElementArrayBuffer, 0);
    const auto [least, most] = bounds(piece);
    const std::size_t first = accessors_.size();
    accessors_.push_back({{"bufferView", vertices},
                          {"componentType", kFloat},
                          {"count", piece.vertices.size()},
                          {"type", "VEC3"},
                          {"min", least},
                          {"max", most}});
    accessors_.push_back({{"bufferView", vertices},
                          {"byteOffset", 12},
                          {"componentType", kFloat},
                          {"count", piece.vertices.size()},
                          {"type", "VEC3"}});
    accessors_.push_back({{"bufferView", vertices},
                          {"byteOffset", 24},
                          {"componentType", kFloat},
                          {"count", piece.vertices.size()},
                          {"type", "VEC2"}});
    accessors_.push_back({{"bufferView", indices},
                          {"componentType", is_wide ? kUint32 : kUint16},
                          {"count", piece.indices.size()},
                          {"type", "SCALAR"}});
    const std::string name = fmt::format("tile {} {}", piece.tile.column, piece.tile.row);
    meshes_.push_back(
        {{"name", name},
         {"primitives",
          ordered_json::array({{{"attributes", {{"POSITION", first}, {"NORMAL", first + 1}, {"TEXCOORD_0", first + 2}}},
                                {"indices", first + 3},
                                {"material", add_material(picture)}}})}});
    nodes_[0]["children"].push_back(nodes_.size());
    nodes_.push_back({{"name", name},
                      {"mesh", meshes_.size() - 1},
                      {"translation", ordered_json::array({piece.corner.x, 0.0, piece.corner.z})}});
  }

  void complete() override {
    if (meshes_.empty()) throw Error(ErrorCode::kInvalidArgument, "there is no triangle to write: all of it is nodata");
    const std::uint64_t end = file_.position();
    if (end > std::numeric_limits<std::uint32_t>::max()) refuse();
    std::string text = json(end - binary_).dump();
    ISOHF_ASSERT(text.size() <= text_room_);
    text.resize(text_room_, ' ');
    std::vector<std::byte> head;
    ByteWriter out(head);
    out.write(kMagic);
    out.write(std::uint32_t{2});
    out.write(static_cast<std::uint32_t>(end));
    out.write(static_cast<std::uint32_t>(text.size()));
    out.write(kJsonChunk);
    const auto text_bytes = std::as_bytes(std::span(text));
    head.insert(head.end(), text_bytes.begin(), text_bytes.end());
    out.write(static_cast<std::uint32_t>(end - binary_));
    out.write(kBinaryChunk);
    file_.flush();
    file_.write_at(0, head);
    file_.commit();
  }

 private:
  [[noreturn]] static void refuse() {
    throw Error(ErrorCode::kInvalidArgument,
                "a .glb file holds at most 4 GiB; use `level`, `max_triangles` or `tiles` for less");
  }

  [[nodiscard]] ordered_json extras() const {
    ordered_json extras = {{"unit", spec_.unit}, {"elevation_scale", spec_.elevation_scale}};
    if (spec_.origin) {
      extras["origin"] = {{"crs", spec_.crs}, {"easting", spec_.origin->easting}, {"northing", spec_.origin->northing}};
    }
    if (spec_.origin_geo) {
      extras["origin_geographic"] = {{"longitude", spec_.origin_geo->longitude},
                                     {"latitude", spec_.origin_geo->latitude}};
    }
    return extras;
  }

  [[nodiscard]] static ordered_json material() {
    return {{"name", "terrain"},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", {0.62, 0.58, 0.5, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
  }

  std::size_t add_material(std::span<const std::byte> picture) {
    if (picture.empty()) return 0;
    const bool is_png = picture[0] == std::byte{0x89};
    const std::size_t view = add_view({picture.begin(), picture.end()}, 0, 0);
    images_.push_back({{"bufferView", view}, {"mimeType", is_png ? "image/png" : "image/jpeg"}});
    textures_.push_back({{"source", images_.size() - 1}, {"sampler", 0}});
    ordered_json textured = material();
    textured["pbrMetallicRoughness"]["baseColorFactor"] = {1.0, 1.0, 1.0, 1.0};
    textured["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", textures_.size() - 1}};
    materials_.push_back(std::move(textured));
    return materials_.size() - 1;
  }

  /// target, stride  0: none is stated
  std::size_t add_view(std::vector<std::byte> bytes, int target, std::size_t stride) {
    ordered_json view = {{"buffer", 0}, {"byteOffset", file_.position() - binary_}, {"byteLength", bytes.size()}};
    if (stride != 0) view["byteStride"] = stride;
    if (target != 0) view["target"] = target;
    views_.push_back(std::move(view));
    bytes.resize(padded(bytes.size()));
    file_.append(bytes);
    return views_.size() - 1;
  }

  [[nodiscard]] static std::vector<std::byte> vertex_bytes(const MeshPiece& piece) {
    std::vector<std::byte> bytes(piece.vertices.size() * kVertexBytes);
    std::byte* out = bytes.data();
    for (std::size_t i = 0; i < piece.vertices.size(); ++i, out += kVertexBytes) {
      const auto& [position, normal] = piece.vertices[i];
      std::memcpy(out, position.data(), 12);
      std::memcpy(out + 12, normal.data(), 12);
      std::memcpy(out + 24, piece.texture_places[i].data(), 8);
    }
    return bytes;
  }

  template <typename T>
  [[nodiscard]] static std::vector<std::byte> index_bytes(const MeshPiece& piece) {
    std::vector<std::byte> bytes(piece.indices.size() * sizeof(T));
    for (std::size_t i = 0; i < piece.indices.size(); ++i) {
      store_little(bytes.data() + i * sizeof(T), static_cast<T>(piece.indices[i]));
    }
    return bytes;
  }

  [[nodiscard]] static std::pair<std::array<float, 3>, std::array<float, 3>> bounds(const MeshPiece& piece) {
    std::array<float, 3> least = piece.vertices.front().position;
    std::array<float, 3> most = least;
    for (const MeshVertex& vertex : piece.vertices) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        least[axis] = std::min(least[axis], vertex.position[axis]);
        most[axis] = std::max(most[axis], vertex.position[axis]);
      }
    }
    return {least, most};
  }

  [[nodiscard]] ordered_json json(std::uint64_t binary_bytes) const {
    ordered_json all = {{"asset", {{"version", "2.0"}, {"generator", spec_.producer}}},
                        {"scene", 0},
                        {"scenes", ordered_json::array({{{"nodes", ordered_json::array({0})}}})},
                        {"nodes", nodes_},
                        {"meshes", meshes_},
                        {"materials", materials_},
                        {"accessors", accessors_},
                        {"bufferViews", views_},
                        {"buffers", ordered_json::array({{{"byteLength", binary_bytes}}})}};
    if (!images_.empty()) {
      constexpr int kClampToEdge = 33071;
      all["images"] = images_;
      all["textures"] = textures_;
      all["samplers"] = ordered_json::array({{{"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}}});
    }
    return all;
  }

  MeshSpec spec_;
  std::uint64_t text_room_;
  OutputFile file_;
  std::uint64_t binary_ = 0;
  ordered_json nodes_ = ordered_json::array();
  ordered_json meshes_ = ordered_json::array();
  ordered_json materials_ = ordered_json::array();
  ordered_json accessors_ = ordered_json::array();
  ordered_json views_ = ordered_json::array();
  ordered_json images_ = ordered_json::array();
  ordered_json textures_ = ordered_json::array();
};

}  // namespace

std::unique_ptr<MeshSink> create_glb(const std::string& path, const MeshSpec& spec) {
  return std::make_unique<GlbSink>(path, spec);
}

}  // namespace isohf
