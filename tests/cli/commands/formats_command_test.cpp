#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/run_program.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::HasSubstr;

TEST(FormatsCommand, ListsWhatIsReadAndWritten) {
  const RunResult result = run_isohf({"formats"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  for (const char* part :
       {"FORMAT ", "OpenEXR ", "read,write", ".asc", ".zip", "needs --raw", "writes uint8, uint16"}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
}

TEST(FormatsCommand, JsonSaysWhetherTheModuleIsThere) {
  const json formats = json::parse(run_isohf({"formats", "--json"}).out);
  EXPECT_GE(formats.at("read").size(), 13U);
  EXPECT_GE(formats.at("written").size(), 4U);
  const std::string table = run_isohf({"formats"}).out;
  for (const json& format : formats.at("written"))
    EXPECT_THAT(table, HasSubstr("writes " + format.at("note").get<std::string>()));
  for (const char* list : {"read", "written"}) {
    for (const json& format : formats.at(list)) {
      EXPECT_FALSE(format.at("extensions").empty());
      EXPECT_FALSE(format.at("library").get<std::string>().empty());
    }
  }
  const json& module = formats.at("read_by_module");
  const bool is_built = std::filesystem::exists(std::filesystem::path(isohf_path()).parent_path() / "isohf_oiio.so");
  ASSERT_EQ(module.at("present").get<bool>(), is_built);
  if (is_built) {
    EXPECT_THAT(module.at("library").get<std::string>(), HasSubstr("OpenImageIO "));
    EXPECT_THAT(module.at("extensions"), Contains(".fits"));
  } else {
    EXPECT_THAT(module.at("why").get<std::string>(), HasSubstr("isohf_oiio.so"));
  }
}

}  // namespace
}  // namespace isohf::test
