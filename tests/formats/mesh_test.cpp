#include "formats/mesh/create_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "isohf/error.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// Two triangles of a tile.
MeshPiece piece_at(TileIndex tile, double x, double z) {
  MeshPiece piece;
  piece.tile = tile;
  piece.corner = {x, z};
  const float s = std::sqrt(0.5F);
  piece.vertices = {
      {{0, 10, 0}, {0, 1, 0}}, {{2, 11, 0}, {0, 1, 0}}, {{0, 12, 3}, {s, s, 0}}, {{2, 13.5F, 3}, {0, s, s}}};
  piece.texture_places = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  piece.indices = {0, 2, 1, 1, 2, 3};
  return piece;
}

MeshSpec spec() {
  MeshSpec spec;
  spec.name = "land \"x\".tif\n";
  spec.producer = "isohf test";
  spec.unit = "metre";
  spec.crs = "EPSG:32632";
  spec.origin = MapPoint{400000.0, 5000000.25};
  spec.origin_geo = GeoPoint{7.7, 45.1};
  spec.pieces = 2;
  return spec;
}

class Mesh : public testing::Test {
 protected:
  std::string write(const std::string& name, std::span<const std::byte> picture = {}) {
    const auto sink = create_mesh(folder / name, spec());
    sink->write(piece_at({0, 0}, 0.0, 0.0), picture);
    sink->write(piece_at({1, 0}, 2.0, 0.0), {});
    sink->finish();
    EXPECT_EQ(sink->vertices(), 8);
    EXPECT_EQ(sink->triangles(), 4);
    EXPECT_FALSE(std::filesystem::exists(folder / (name + ".part")));
    return test::read_file(folder / name);
  }
  const test::TemporaryFolder folder;
};

template <typename T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

TEST_F(Mesh, GlbIsWhatTheSpecificationSays) {
  const std::string picture = "\x89PNG and so on";
  const std::string bytes = write("two.glb", std::as_bytes(std::span(picture)));
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 4), 2U);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 8), bytes.size());
  const std::size_t text = number_at<std::uint32_t>(bytes, 12);
  EXPECT_EQ(text % 4, 0U);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  const std::size_t binary = 28 + text;
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 20 + text), bytes.size() - binary);
  EXPECT_EQ(bytes.substr(24 + text, 4), std::string("BIN\0", 4));
  const json all = json::parse(bytes.substr(20, text));
  EXPECT_EQ(all["asset"]["version"], "2.0");
  EXPECT_EQ(all["scenes"][0]["nodes"], json::array({0}));
  EXPECT_EQ(all["nodes"][0]["children"], json::array({1, 2}));
  EXPECT_EQ(all["nodes"][0]["extras"]["origin"]["northing"], 5000000.25);
  EXPECT_EQ(all["nodes"][2]["translation"], json::array({2.0, 0.0, 0.0}));
  EXPECT_EQ(all["buffers"][0]["byteLength"], bytes.size() - binary);
  const auto view_of = [&](std::size_t accessor) {
    return all["bufferViews"][all["accessors"][accessor]["bufferView"].get<std::size_t>()];
  };
  for (std::size_t mesh = 0; mesh < 2; ++mesh) {
    const json& primitive = all["meshes"][mesh]["primitives"][0];
    const std::size_t position = primitive["attributes"]["POSITION"];
    const std::size_t at = binary + view_of(position)["byteOffset"].get<std::size_t>();
    EXPECT_EQ(number_at<float>(bytes, at + 3 * 32 + 4), 13.5F);
    EXPECT_EQ(all["accessors"][position]["min"], json::array({0.0, 10.0, 0.0}));
    EXPECT_EQ(all["accessors"][position]["max"], json::array({2.0, 13.5, 3.0}));
    const std::size_t texture = primitive["attributes"]["TEXCOORD_0"];
    EXPECT_EQ(number_at<float>(bytes, at + 2 * 32 + all["accessors"][texture]["byteOffset"].get<std::size_t>() + 4),
              1.0F);
    const std::size_t indices = primitive["indices"];
    const std::size_t first = binary + view_of(indices)["byteOffset"].get<std::size_t>();
    EXPECT_EQ(all["accessors"][indices]["componentType"], 5123);
    EXPECT_EQ(number_at<std::uint16_t>(bytes, first + 2), 2);
    EXPECT_EQ(first % 4, 0U);
    EXPECT_EQ(primitive["material"], mesh == 0 ? 1 : 0);
  }
  const json& image = all["images"][0];
  EXPECT_EQ(image["mimeType"], "image/png");
  EXPECT_EQ(
      bytes.substr(binary + all["bufferViews"][image["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>(),
                   picture.size()),
      picture);
}

TEST_F(Mesh, ObjCountsVerticesThroughAllTiles) {
  const std::string text = write("two.obj");
  EXPECT_THAT(text, HasSubstr("# land \"x\".tif , written by isohf test\n"));
  EXPECT_THAT(text, HasSubstr("# origin: 400000 East, 5000000.25 North in EPSG:32632\n"));
  EXPECT_THAT(text, HasSubstr("o tile_1_0\nv 2 10 0\nvt 0 1\nvn 0 1 0\n"));
  EXPECT_THAT(text, HasSubstr("f 1/1/1 3/3/3 2/2/2\n"));
  EXPECT_THAT(text, HasSubstr("f 6/6/6 7/7/7 8/8/8\n"));
}

TEST_F(Mesh, PlyHasNorthingsAndHeights) {
  const std::string bytes = write("two.PLY");
  EXPECT_THAT(bytes, HasSubstr("element vertex 0000000008\n"));
  EXPECT_THAT(bytes, HasSubstr("element face 0000000004\n"));
  const std::size_t data = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size(), data + 8 * 24 + 4 * 13);
  const std::size_t last = data + 7 * 24;
  EXPECT_EQ(number_at<float>(bytes, last), 4.0F);
  EXPECT_EQ(number_at<float>(bytes, last + 4), -3.0F);
  EXPECT_EQ(number_at<float>(bytes, last + 8), 13.5F);
  const std::size_t face = data + 8 * 24 + 3 * 13;
  EXPECT_EQ(bytes[face], 3);
  EXPECT_EQ(number_at<std::int32_t>(bytes, face + 1), 5);
  EXPECT_EQ(number_at<std::int32_t>(bytes, face + 9), 7);
  EXPECT_FALSE(std::filesystem::exists(folder / "two.PLY.faces.part"));
}

TEST_F(Mesh, FilesThatCannotBeWrittenAreNamed) {
  const auto refusal = [](const std::string& path, bool overwrite) -> std::string {
    try {
      MeshSpec wanted = spec();
      wanted.overwrite = overwrite;
      create_mesh(path, wanted)->finish();
    } catch (const Error& error) {
      return error.what();
    }
    return "done";
  };
  EXPECT_THAT(refusal("/no/where.glb", false), HasSubstr("/no/where.glb: "));
  EXPECT_THAT(refusal(folder / "x.stl", false), HasSubstr("ends in .glb, .obj or .ply"));
  EXPECT_THAT(refusal(folder / "empty.glb", false), HasSubstr("empty.glb: there is no triangle"));
  (void)write("there.obj");
  EXPECT_THAT(refusal(folder / "there.obj", false), HasSubstr("exists"));
  EXPECT_EQ(refusal(folder / "there.obj", true), "done");
  EXPECT_TRUE(is_mesh_name("a.GLB"));
  EXPECT_FALSE(is_mesh_name("glb"));
}

}  // namespace
}  // namespace isohf
