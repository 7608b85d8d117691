#include "isohf/metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "archive/tile/tiles.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/json_members.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

Metadata full() {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 5, 4, 1.0 / 3.0, 0.1);
  Metadata metadata = test::make_metadata(grid, CodeType::kU16);
  metadata.content_sha256 = std::string(64, 'a');
  metadata.ground_sha256 = std::string(64, 'b');
  metadata.tiles_stored = 17;
  metadata.extensions = {{"shadow", R"({"sun":[0.1,2],"note":"ä"})"}, {"accuracy", "1.5"}};
  return metadata;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Metadata, ComesBackAsItWas) {
  const Metadata metadata = full();
  const std::string json = format_metadata(metadata);
  const Metadata back = parse_metadata(json);
  EXPECT_EQ(format_metadata(back), json);
  EXPECT_EQ(back.grid.extent_x(), 1.0 / 3.0);  // doubles to the last bit
  EXPECT_EQ(back.grid.shape(), metadata.grid.shape());
  EXPECT_EQ(back.grid.tile_columns(), 5);
  EXPECT_EQ(back.quantisation.offset, -12.5);
  EXPECT_EQ(back.quantisation.scale, 0.1);
  EXPECT_EQ(back.valid.x1, metadata.valid.x1);
  EXPECT_EQ(back.source.name, metadata.source.name);
  EXPECT_EQ(back.source.origin_x, 6.000123456789);
  EXPECT_EQ(back.source.origin_y, std::nullopt);
  EXPECT_EQ(back.source.crs_epsg, 32611);
  EXPECT_EQ(back.source.crs_wkt, metadata.source.crs_wkt);
  EXPECT_EQ(back.statistics.max, std::nullopt);
  EXPECT_EQ(back.statistics.vertices, 1234567890123);
  EXPECT_EQ(back.textures, metadata.textures);
  EXPECT_EQ(back.tiles_stored, 17);
  ASSERT_EQ(back.extensions.size(), 2U);
  EXPECT_EQ(back.extensions[0], metadata.extensions[0]);
}

TEST(Metadata, ABoundOnTheRoundingIsHalfAStepOrMore) {
  Metadata metadata = full();
  metadata.rounding = 0.07;  // of steps of 0.1
  const std::string json = format_metadata(metadata);
  EXPECT_EQ(parse_metadata(json).rounding, 0.07);
  EXPECT_EQ(parse_metadata(format_metadata(full())).rounding, std::nullopt);
  for (const char* const wrong : {"0.049", "0", "-1", "\"much\""}) {
    EXPECT_THROW((void)parse_metadata(replaced(json, "\"rounding\": 0.07", std::string("\"rounding\": ") + wrong)),
                 Error)
        << wrong;
  }
}

TEST(Metadata, RecordsHowVoidsWereTreated) {
  Metadata metadata = full();
  metadata.source.void_values = {-9999.0, std::nan(""), HUGE_VAL};
  metadata.source.valid_range = {-500.0, 9000.5};
  metadata.source.raw_range = {-HUGE_VAL, 32000.0};
  metadata.source.fill_distance = 100;
  const std::string json = format_metadata(metadata);
  const SourceRecord back = parse_metadata(json).source;
  ASSERT_EQ(back.void_values.size(), 3U);
  EXPECT_EQ(back.void_values[0], -9999.0);
  EXPECT_TRUE(std::isnan(back.void_values[1]));
  EXPECT_EQ(back.void_values[2], HUGE_VAL);
  EXPECT_EQ(back.valid_range, metadata.source.valid_range);
  EXPECT_EQ(back.raw_range, metadata.source.raw_range);
  EXPECT_EQ(back.fill_distance, 100);
  for (const char* wrong : {"\"fill_distance\": -1", "\"fill_distance\": 1.5", "\"fill_distance\": \"far\""}) {
    EXPECT_THROW((void)parse_metadata(replaced(json, "\"fill_distance\": 100", wrong)), Error) << wrong;
  }
  EXPECT_THROW((void)parse_metadata(replaced(json, "\"nan\"", "\"none\"")), Error);
  EXPECT_THROW((void)parse_metadata(replaced(json, "9000.5", "\"high\"")), Error);
  for (const char* wrong : {"\"inf\"", "\"nan\"", "32001.0"})  // nothing, or nobody knows what, lies between
    EXPECT_THROW((void)parse_metadata(replaced(json, "\"-inf\"", wrong)), Error) << wrong;
}

TEST(Metadata, BeginsWithFormatAndVersion) {
  EXPECT_THAT(format_metadata(full()), testing::StartsWith("{\n \"format\": \"isohf\",\n \"version\": 1,\n"));
}

TEST(Metadata, HoldsPlanesAgainstShapeAndGrid) {
  Metadata metadata = full();
  metadata.planes = {4, 2};
  const std::string json = format_metadata(metadata);
  EXPECT_EQ(parse_metadata(json).planes, (PlaneInfo{4, 2}));
  EXPECT_EQ(format_metadata(parse_metadata(json)), json);
  for (const auto& [from, to] : {std::pair("\"stride\": 4", "\"stride\": 8"),
                                 {"\"stride\": 4", "\"stride\": 3"},
                                 {"\"count\": 2", "\"count\": 3"},
                                 {"\"count\": 2", "\"count\": 0"}}) {
    EXPECT_THROW(static_cast<void>(parse_metadata(replaced(json, from, to))), Error) << to;
  }
}

TEST(Metadata, KeepsExtensionsWhereverTheyStand) {
  std::string json = format_metadata(full());
  json = replaced(json, "\"name\": \"hügel", "\"sensor/no\": {\"a\": [1]}, \"name\": \"hügel");
  json = replaced(json, "\"void\":", "\"unit~\": \"m\", \"void\":");
  const Metadata metadata = parse_metadata(json);
  ASSERT_EQ(metadata.extensions.size(), 4U);
  EXPECT_EQ(metadata.extensions[0].first, "/samples/unit~0");
  EXPECT_EQ(metadata.extensions[1].first, "/source/sensor~1no");
  const auto back = nlohmann::json::parse(format_metadata(metadata));
  EXPECT_EQ(back["source"]["sensor/no"]["a"][0], 1);
  EXPECT_EQ(back["samples"]["unit~"], "m");
}

TEST(Metadata, NamesWhatIsWrong) {
  const std::string json = format_metadata(full());
  const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
      {{"\"format\": \"isohf\"", "\"format\": \"other\""}, "format"},
      {{"\"version\": 1", "\"version\": \"1\""}, "version"},
      {{"\"rows\": 11", "\"rows\": 12"}, "tile_shape"},
      {{"\"rows\": 11", "\"rows\": 1e9"}, "tile_shape.rows"},
      {{"\"columns\": 12", "\"columns\": -12"}, "tile_shape.columns"},
      {{"\"rows\": 4", "\"rows\": 0"}, "tile grid"},
      {{"\"rows\": 4", "\"rows\": 18446744073709551615"}, "tiles.rows"},
      {{"\"stored\": 17", "\"stored\": 21"}, "tiles.stored"},
      {{"\"type\": \"u16\"", "\"type\": \"u17\""}, "samples.type"},
      {{"\"scale\": 0.1", "\"scale\": 0"}, "samples.scale"},
      {{"\"scale\": 0.1", "\"scale\": -1"}, "samples.scale"},
      {{"\"scale\": 0.1", "\"scale\": 1e999"}, ""},
      {{"\"offset\": -12.5", "\"offset\": null"}, "samples.offset"},
      {{"\"textures\"", "\"textures2\""}, "textures"},
      {{"\"x0\"", "\"y0\""}, "valid.x0"},
      {{"aaaa", "AAAA"}, "content_sha256"},
      {{"bbbb", "BBBB"}, "ground_sha256"},
      {{"\"ground_sha256\"", "\"ground\""}, "ground_sha256"},
      {{"\"epsg\": 32611", "\"epsg\": \"x\""}, "source.crs.epsg"},
      {{"{", "["}, ""},
  };
  for (const auto& [change, name] : cases) {
    SCOPED_TRACE(change.second);
    const Error error = test::error_of([&] { (void)parse_metadata(replaced(json, change.first, change.second)); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_THAT(error.what(), testing::HasSubstr(name));
  }
  const char* const requiring = "\"version\": 1, \"requires\": [\"rotated lattice\"]";
  const char* const fitted = "\"version\": 1, \"heights\": \"fitted\"";
  for (const auto& [version, name] :
       {std::pair{"\"version\": 2", "version"}, {requiring, "rotated lattice"}, {fitted, "fitted"}}) {
    const Error error = test::error_of([&] { (void)parse_metadata(replaced(json, "\"version\": 1", version)); });
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported) << version;
    EXPECT_THAT(error.what(), testing::HasSubstr(name));
  }
  for (const char* const same : {"\"version\": 1, \"requires\": []", "\"version\": 1, \"heights\": \"point\""})
    EXPECT_EQ(format_metadata(parse_metadata(replaced(json, "\"version\": 1", same))), json) << same;
}

TEST(ShardRecord, RefusesRowsAndNumbersThatNoConversionHas) {
  const auto read = [](const ShardRecord& record) {
    Metadata metadata(TileGrid::make(TileShape::make(12, 11, 3), 2, 3, 1.0, 1.0));
    metadata.extensions.emplace_back(kShardName, format_shard_record(record));
    return shard_record(metadata);
  };
  EXPECT_EQ(read({"", 2, 3, 1, 2, {0.0}})->number, 2);
  for (const ShardRecord& wrong : std::vector<ShardRecord>{{"", 1, 4, 0, 1, {0.0}},
                                                           {"", 1, 2000000000, 0, 1, {0.0}},
                                                           {"", 4, 3, 0, 1, {0.0}},
                                                           {"", 1, 3, -1, 0, {0.0}},
                                                           {"", 1, 3, 1, 1, {}},
                                                           {"", 1, 3, 2, 4, {0.0, 0.0}},
                                                           {"", 1, 3, 0, 2, {0.0}}}) {
    const Error error = test::error_of([&] { (void)read(wrong); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_THAT(error.what(), testing::HasSubstr("shard.")) << wrong.number;
  }
}

TEST(Metadata, RefusesEveryTruncation) {
  const std::string json = format_metadata(full());
  for (std::size_t size = 0; size < json.size(); ++size) {
    EXPECT_THROW(static_cast<void>(parse_metadata(json.substr(0, size))), Error) << size;
  }
}

TEST(Metadata, RefusesDeepNesting) {
  EXPECT_THROW(static_cast<void>(parse_metadata(std::string(1000000, '['))), Error);
  std::string json = format_metadata(full());
  json.insert(1, "\"deep\":" + std::string(100, '[') + std::string(100, ']') + ",");
  EXPECT_THROW(static_cast<void>(parse_metadata(json)), Error);
}

TEST(Metadata, IgnoresBracketsInStrings) {
  Metadata metadata = full();
  metadata.source.crs_wkt = std::string(500, '[') + "\\\"{";
  EXPECT_EQ(parse_metadata(format_metadata(metadata)).source.crs_wkt, metadata.source.crs_wkt);
}

TEST(Metadata, RefusesAnExtensionWithANameOfTheFormat) {
  Metadata metadata = full();
  metadata.extensions = {{"source", "1"}};
  EXPECT_THROW(static_cast<void>(format_metadata(metadata)), Error);
}

TEST(CodeType, HasNames) {
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    EXPECT_EQ(code_type_from_string(to_string(type)), type);
  }
  EXPECT_THROW(static_cast<void>(code_type_from_string("u32")), Error);
}

Metadata projected() {
  Metadata metadata = full();
  ProjectionRecord record;
  record.spec.kind = ProjectionKind::kLambertConformal;
  record.spec.ellipsoid = {3396190.0, 169.894447223612};
  record.spec.longitude_0 = 137.1234;
  record.spec.latitude_0 = -4.5;
  record.spec.parallel_1 = -8.0;
  record.spec.parallel_2 = -1.0 / 3.0;
  record.origin = {-12345.678, 23456.789};
  record.worst_scale_error = 0.0123;
  record.worst_place = {130.0, -12.0};
  record.why = "asked for";
  metadata.projection = record;
  metadata.wraps_x = true;
  return metadata;
}

TEST(Metadata, ProjectionsComeBackAsTheyWere) {
  const std::string json = format_metadata(projected());
  const Metadata back = parse_metadata(json);
  EXPECT_EQ(format_metadata(back), json);
  ASSERT_TRUE(back.projection);
  EXPECT_EQ(back.projection->spec, projected().projection->spec);
  EXPECT_EQ(back.projection->origin.easting, -12345.678);
  EXPECT_EQ(back.projection->worst_scale_error, 0.0123);
  EXPECT_EQ(back.projection->why, "asked for");
  EXPECT_TRUE(back.wraps_x);
  Metadata endless = projected();
  endless.projection->worst_scale_error = std::numeric_limits<double>::infinity();
  EXPECT_EQ(parse_metadata(format_metadata(endless)).projection->worst_scale_error,
            std::numeric_limits<double>::infinity());
}

TEST(Metadata, RequiresOfReadersToKnowReferenceSystemsAsProjections) {
  Metadata metadata = projected();
  ProjectionSpec& spec = metadata.projection->spec;
  EXPECT_THAT(format_metadata(metadata), testing::Not(testing::HasSubstr("requires")));
  spec = {};
  spec.kind = ProjectionKind::kSystem;
  spec.system = {"EPSG:2263", "NAD83 / New York", "+proj=pipeline +step +proj=noop", 1200.0 / 3937.0};
  const std::string json = format_metadata(metadata);
  EXPECT_THAT(json, testing::HasSubstr("\"projection-system\""));
  const Metadata back = parse_metadata(json);
  EXPECT_EQ(back.projection->spec, spec);
  EXPECT_EQ(format_metadata(back), json);
  // Of another kind it says nothing, and this kind is nothing without it.
  EXPECT_THROW((void)parse_metadata(replaced(json, "\"kind\": \"system\"", "\"kind\": \"utm\"")), Error);
  EXPECT_THROW((void)parse_metadata(replaced(json, "\"crs\": \"EPSG:2263\"", "\"crs\": 2263")), Error);
}

TEST(Metadata, NamesThatThisBuildDoesNotKnowAreNoValues) {
  std::string json = format_metadata(full());
  const Metadata whole = parse_metadata(json);
  EXPECT_TRUE(whole.filter && whole.acquisition && whole.edges);
  EXPECT_NE(whole.source.registration, Registration::kUnknown);
  auto altered = nlohmann::json::parse(json);
  for (const char* name : {"filter", "acquisition", "edges"}) altered[name] = "nonsense";
  altered["source"]["registration"] = "nonsense";
  const Metadata metadata = parse_metadata(altered.dump());
  EXPECT_FALSE(metadata.filter || metadata.acquisition || metadata.edges);
  EXPECT_EQ(metadata.source.registration, Registration::kUnknown);
}

TEST(Metadata, RefusesProjectionsThatMakeNoMap) {
  const std::string json = format_metadata(projected());
  for (const auto& [from, to] :
       {std::pair{"\"lambert-conformal\"", "\"mercator\""}, std::pair{"\"lambert-conformal\"", "\"none\""},
        std::pair{"\"lambert-conformal\"", "7"},
        std::pair{"\"semi_major_axis_m\": 3396190.0,\n  \"inverse_flattening\": 169",
                  "\"semi_major_axis_m\": -1.0,\n  \"inverse_flattening\": 169"},
        std::pair{"\"inverse_flattening\": 169.894447223612", "\"inverse_flattening\": 0.5"},
        std::pair{"\"longitude_0\": 137.1234", "\"longitude_0\": null"},
        std::pair{"\"utm_zone\": null", "\"utm_zone\": 61"}, std::pair{"\"wraps_x\": true", "\"wraps_x\": 1"}}) {
    EXPECT_THROW((void)parse_metadata(replaced(json, from, to)), Error) << to;
  }
}

using Json = nlohmann::json;

Json schema_file(const std::string& name) {
  return Json::parse(test::read_file(ISOHF_SOURCE_DIR "/docs/schema/" + name));
}

/// References put in place; whether other members are allowed is for the programs' documents to say.
Json resolved(const Json& schema, const Json& common) {
  if (schema.is_object() && schema.contains("$ref")) {
    const auto reference = schema["$ref"].get<std::string>();
    return resolved(common.at(Json::json_pointer(reference.substr(reference.find('#') + 1))), common);
  }
  if (!schema.is_structured()) return schema;
  Json result = schema;
  if (schema.is_object() && schema.value("additionalProperties", Json()) == false) result.erase("additionalProperties");
  for (auto& part : result) part = resolved(part, common);
  return result;
}

template <typename T>
Json extension_schema(void (*members)(JsonMembers&, T&)) {
  T value;
  return Json::parse(schema_of_members([&](JsonMembers& json) { members(json, value); }));
}

TEST(Metadata, AreDescribedByTheSchemaOfTheirTable) {
  Json made = Json::parse(metadata_schema());
  made["properties"]["statistics"]["type"] = {"object", "null"};  // what a plan prints has none yet
  made["properties"]["accuracy"] = extension_schema(accuracy_members);
  made["properties"]["tile_textures"] = extension_schema(texture_members);
  made["properties"]["shard"] = extension_schema(shard_members);
  made["properties"]["shadow_seeds"] = extension_schema(shadow_seed_members);
  const Json file = resolved(schema_file("metadata.json"), schema_file("common.json"));
  EXPECT_TRUE(file.at("required") == made["required"]) << made["required"].dump();
  for (const auto& [name, schema] : made["properties"].items()) {
    Json found = file.at("properties").value(name, Json());
    if (name == "projection")
      found = {{"type", {"object", "null"}},
               {"properties", found["anyOf"][0]["properties"]},
               {"required", found["anyOf"][0]["required"]}};
    EXPECT_TRUE(found == schema) << name << " is " << found.dump() << ", must be " << schema.dump();
  }
}

/// Names of members that the page does not have in code type, alone or behind a dot.
std::vector<std::string> names_off_the_page(const Json& schema, const std::string& page) {
  std::vector<std::string> missing;
  const Json properties = schema.value("properties", Json::object());
  for (const auto& [name, member] : properties.items()) {
    const bool is_there =
        page.find("." + name + "`") != std::string::npos || page.find("`" + name + "`") != std::string::npos;
    if (!is_there && !member.contains("properties")) missing.push_back(name);
    const auto inner = names_off_the_page(member, page);
    missing.insert(missing.end(), inner.begin(), inner.end());
  }
  return missing;
}

TEST(Metadata, HaveEveryMemberOnThePageOfTheFormat) {
  const std::string page = test::read_file(ISOHF_SOURCE_DIR "/docs/archive_format.md");
  EXPECT_THAT(names_off_the_page(resolved(schema_file("metadata.json"), schema_file("common.json")), page),
              testing::IsEmpty());
}

}  // namespace
}  // namespace isohf
