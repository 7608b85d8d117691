#include "isohf/archive.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <thread>

#include "archive/tile/tiles.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/writer.h"
#include "isohf/error.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;

/// An archive's members apart, to be put together again in some other way.
struct Parts {
  struct Part {
    ZipMember member;
    std::vector<std::byte> data;
    std::string other_local_name;  ///< for a local header that says something else
  };
  std::vector<Part> parts;

  explicit Parts(const std::vector<std::byte>& file) {
    const auto source = memory_source(file);
    for (ZipEntries entries(*source, find_archive_end(*source)); const auto entry = entries.next();) {
      const auto data = std::span(file).subspan(checked_data_offset(*source, *entry), entry->compressed_bytes);
      parts.push_back({*entry, {data.begin(), data.end()}, ""});
    }
  }

  [[nodiscard]] Part& find(const std::string& name) {
    return *std::find_if(parts.begin(), parts.end(), [&](const Part& part) { return part.member.name == name; });
  }
  void erase(const std::string& name) {
    std::erase_if(parts, [&](const Part& part) { return part.member.name == name; });
  }

  /// `change` may touch the members after they have their places and before the directory is written.
  [[nodiscard]] std::vector<std::byte> join(const std::function<void(std::vector<Part>&)>& change = {}) {
    std::vector<std::byte> file;
    for (Part& part : parts) {
      part.member.header_offset = file.size();
      ZipMember local = part.member;
      if (!part.other_local_name.empty()) local.name = part.other_local_name;
      append_local_header(local, file);
      file.insert(file.end(), part.data.begin(), part.data.end());
    }
    if (change) change(parts);
    const std::uint64_t start = file.size();
    for (const Part& part : parts) append_directory_entry(part.member, file);
    append_end_records(parts.size(), start, file.size() - start, file);
    return file;
  }
};

class ArchiveReaderTest : public testing::Test {
 protected:
  ArchiveReaderTest() : grid_(TileGrid::make(TileShape::make(5, 5, 1), 4, 3, 10.0, 10.0)) {
    test::make_archive(path(), grid_, CodeType::kU16);
    good_ = test::read_bytes(path());
  }
  [[nodiscard]] std::string path() const { return folder_ / "a.isohf"; }
  [[nodiscard]] TileCodes tile(std::int64_t flat) const { return test::tile_of_archive(grid_, CodeType::kU16, flat); }

  /// Opens the bytes and reads all there is: what can be read must be right. The error's text where there is one.
  std::string read_all(const std::vector<std::byte>& bytes) {
    test::write_file(path(), bytes);
    std::unique_ptr<ArchiveReader> reader;
    try {
      reader = std::make_unique<ArchiveReader>(path());
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path()));
      return error.what();
    }
    EXPECT_EQ(reader->grid().tile_count(), grid_.tile_count());
    std::string first_error;
    const auto attempt = [&](const auto& deed) {
      try {
        deed();
      } catch (const Error& error) {
        if (first_error.empty()) first_error = error.what();
      }
    };
    for (std::int64_t flat = 0; flat < grid_.tile_count(); ++flat) {
      attempt([&] { EXPECT_EQ(reader->read_tile(grid_.tile_at(flat)), tile(flat)) << flat; });
    }
    attempt([&] { EXPECT_EQ(reader->read_member("preview.png"), std::vector<std::byte>(33, std::byte{9})); });
    attempt([&] { EXPECT_EQ(reader->read_member("shadow/seeds.bin"), std::vector<std::byte>(1000, std::byte{7})); });
    if (first_error.empty() && reader->reads_by_directory()) {
      EXPECT_FALSE(reader->warnings().empty());
      EXPECT_FALSE(reader->check_structure().empty());
      return "by directory";
    }
    return first_error;
  }

  TemporaryFolder folder_;
  TileGrid grid_;
  std::vector<std::byte> good_;
};

TEST_F(ArchiveReaderTest, RefusesEveryTruncation) {
  for (std::size_t size = 0; size < good_.size(); size += size < 16000 ? 97 : 1) {
    const std::vector<std::byte> cut(good_.begin(), good_.begin() + static_cast<std::ptrdiff_t>(size));
    test::write_file(path(), cut);
    EXPECT_THROW(ArchiveReader{path()}, Error) << size;
  }
}

/// The error's text; it must be one of input and output.
std::string io_error_of(const std::function<void()>& deed) {
  const Error error = test::error_of(deed);
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  return error.what();
}

TEST_F(ArchiveReaderTest, SaysThatAnotherProgramCutTheOpenFile) {
  // More than opening keeps of the file's end, and whole pages of a map go with what is cut.
  const TileGrid grid = TileGrid::make(TileShape::make(5, 5, 1), 100, 80, 10.0, 10.0);
  std::filesystem::remove(path());
  test::make_archive(path(), grid, CodeType::kU16);
  const std::vector<std::byte> large = test::read_bytes(path());
  const auto is_told = HasSubstr(": another program cut it");
  for (const std::size_t left : {std::size_t{0}, std::size_t{100}, std::size_t{4096}, std::size_t{100000}}) {
    SCOPED_TRACE(left);
    test::write_file(path(), large);
    const ArchiveReader reader(path());
    const ArchiveReader knows_members(path());
    const MemberEntry member = knows_members.members()[1];  // not in the tail
    std::filesystem::resize_file(path(), left);
    const TileIndex last{0, 20};
    EXPECT_THAT(io_error_of([&] { (void)reader.read_tile(last); }), is_told);
    EXPECT_THAT(io_error_of([&] { (void)reader.members(); }), is_told);
    EXPECT_THAT(io_error_of([&] { (void)knows_members.read_member(member); }), is_told);
    EXPECT_THAT(reader.check_structure(), testing::Contains(is_told));
  }
}

TEST_F(ArchiveReaderTest, RefusesOrSeesThroughBytesBehindTheEnd) {
  std::vector<std::byte> longer = good_;
  longer.push_back(std::byte{0});
  EXPECT_NE(read_all(longer), "");
}

TEST_F(ArchiveReaderTest, NeverHandsOutAWrongTileWhateverByteIsDamaged) {
  // The padding of the metadata, thousands of blanks alike, is gone through in larger steps.
  for (std::size_t at = 0; at<good_.size(); at += at> 3000 && at < 16000 ? 501 : 1) {
    std::vector<std::byte> damaged = good_;
    damaged[at] ^= std::byte{0x21};
    static_cast<void>(read_all(damaged));
    if (testing::Test::HasFailure()) FAIL() << "byte " << at;
  }
}

TEST_F(ArchiveReaderTest, SeesDamageAnywhereWhenItChecksTheStructureAndReadsAll) {
  for (std::size_t at = 0; at < good_.size(); at += 37) {
    std::vector<std::byte> damaged = good_;
    damaged[at] ^= std::byte{1};  // the lowest bit: the others may be what fills up a Deflate stream's last byte
    if (!read_all(damaged).empty()) continue;
    EXPECT_FALSE(ArchiveReader(path()).check_structure().empty()) << "byte " << at;
  }
}

TEST_F(ArchiveReaderTest, ReadsAReorderedArchiveByItsDirectory) {
  Parts parts(good_);
  std::reverse(parts.parts.begin(), parts.parts.end());
  EXPECT_EQ(read_all(parts.join()), "by directory");
}

TEST_F(ArchiveReaderTest, ReadsAnArchiveWithoutIndexByItsDirectory) {
  Parts parts(good_);
  parts.erase("index.bin");
  EXPECT_EQ(read_all(parts.join()), "by directory");
}

TEST_F(ArchiveReaderTest, ReadsTilesThatAnArchiverStored) {
  Parts parts(good_);
  for (auto& part : parts.parts) {
    if (part.member.method == ZipMethod::kStored) continue;
    std::vector<std::byte> plain(part.member.bytes);
    inflate_exactly(part.data, plain);
    part.data = plain;
    part.member.method = ZipMethod::kStored;
    part.member.compressed_bytes = plain.size();
  }
  EXPECT_EQ(read_all(parts.join()), "by directory");
}

TEST_F(ArchiveReaderTest, KnowsRangesOfARepackedArchiveFromItsOldIndex) {
  Parts parts(good_);
  const TileEntry before = ArchiveReader(path()).tile_entry({2, 0});
  std::rotate(parts.parts.begin(), parts.parts.end() - 2, parts.parts.end());
  EXPECT_EQ(read_all(parts.join()), "by directory");
  const TileEntry after = ArchiveReader(path()).tile_entry({2, 0});
  EXPECT_EQ(after.code_min, before.code_min);
  EXPECT_EQ(after.code_max, before.code_max);
  EXPECT_NE(after.offset_bytes, before.offset_bytes);
}

TEST_F(ArchiveReaderTest, ReadsWhatZipMadeOfIt) {
  if (std::system("command -v zip unzip >/dev/null 2>&1") != 0) GTEST_SKIP() << "zip or unzip is not installed";
  for (const char* level : {"-0", "-9"}) {
    test::write_file(path(), good_);
    const std::string out = folder_ / "out";
    ASSERT_EQ(std::system(fmt::format("cd {0} && rm -rf out b.zip && mkdir out && cd out && unzip -q ../a.isohf && "
                                      "zip -q -r {1} ../b.zip .",
                                      folder_ / ".", level)
                              .c_str()),
              0);
    EXPECT_EQ(read_all(test::read_bytes(folder_ / "b.zip")), "by directory") << level;
  }
}

TEST_F(ArchiveReaderTest, ReadsWhatOtherToolsAddedToIt) {
  if (std::system("command -v zip python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "zip or python3 is not installed";
  const std::vector<std::byte> note(5000, std::byte{7});
  test::write_file(folder_ / "note", note);
  for (const char* command :
       {"zip -q a.isohf note", "zip -q -g a.isohf note",
        "python3 -c \"import zipfile; z = zipfile.ZipFile('a.isohf', 'a'); z.write('note'); z.close()\""}) {
    test::write_file(path(), good_);
    ASSERT_EQ(std::system(fmt::format("cd {} && {}", folder_ / ".", command).c_str()), 0);
    EXPECT_EQ(read_all(test::read_bytes(path())), "") << command;
    const ArchiveReader archive(path());
    EXPECT_THAT(archive.check_structure(), IsEmpty()) << command;
    EXPECT_EQ(archive.read_member("note"), note) << command;
    for (const Finding& finding : verify_archive(path()).findings) EXPECT_NE(finding.id, finding::kStructure);
  }
}

TEST_F(ArchiveReaderTest, PassesUnzipsTest) {
  if (std::system("command -v unzip >/dev/null 2>&1") != 0) GTEST_SKIP() << "unzip is not installed";
  EXPECT_EQ(std::system(fmt::format("unzip -tqq {} >/dev/null 2>&1", path()).c_str()), 0);
}

TEST_F(ArchiveReaderTest, RefusesHostileNames) {
  for (const std::string name : {"../preview.png", "/preview.png", "a/../../b", "tiles/00/1.tile", "tiles/0/4.tile",
                                 "tiles/3/0.tile", "tiles/-1/0.tile", "tiles/0/x.tile", "tiles/0/1.tile2",
                                 "tiles/99999999999999999999/0.tile", "C:\\x", "a\x01"}) {
    Parts parts(good_);
    parts.find("preview.png").member.name = name;
    EXPECT_THAT(read_all(parts.join()), HasSubstr("member \"")) << name;
  }
}

TEST_F(ArchiveReaderTest, RefusesTwoMembersOfOneName) {
  for (const char* name : {"tiles/0/1.tile", "shadow/seeds.bin", "isohf.json"}) {
    Parts parts(good_);
    parts.find("preview.png").member.name = name;
    EXPECT_THAT(read_all(parts.join()), HasSubstr("twice")) << name;
  }
}

TEST_F(ArchiveReaderTest, RefusesOverlappingMembers) {
  Parts parts(good_);
  const auto file =
      parts.join([](std::vector<Parts::Part>& all) { all[3].member.header_offset = all[2].member.header_offset; });
  static_cast<void>(read_all(file));
  EXPECT_FALSE(ArchiveReader(path()).check_structure().empty());
  // An honest second entry for the same bytes under another name overlaps as well.
  Parts twice(good_);
  Parts::Part copy = twice.find("preview.png");
  copy.member.name = "copy.png";
  const auto overlapping = twice.join([&](std::vector<Parts::Part>& all) {
    copy.member.header_offset = std::find_if(all.begin(), all.end(), [](const auto& p) {
                                  return p.member.name == "preview.png";
                                })->member.header_offset;
    all.push_back(copy);
  });
  static_cast<void>(read_all(overlapping));
  EXPECT_FALSE(ArchiveReader(path()).check_structure().empty());
}

TEST_F(ArchiveReaderTest, RefusesLyingSizes) {
  const auto read_with = [&](const std::function<void(ZipMember&)>& lie, bool in_local_header_too) {
    Parts parts(good_);
    ZipMember& member = parts.find("tiles/0/2.tile").member;
    if (in_local_header_too) lie(member);
    return read_all(parts.join([&](std::vector<Parts::Part>& all) {
      if (in_local_header_too) return;
      for (auto& part : all) {
        if (part.member.name == "tiles/0/2.tile") lie(part.member);
      }
    }));
  };
  for (const bool both : {false, true}) {
    for (const std::int64_t by : {-1, 1, 1000, 1 << 30}) {
      const auto add = [by](std::uint64_t& value) {
        value = static_cast<std::uint64_t>(static_cast<std::int64_t>(value) + by);
      };
      EXPECT_NE(read_with([&](ZipMember& member) { add(member.bytes); }, both), "by directory") << by << both;
      EXPECT_NE(read_with([&](ZipMember& member) { add(member.compressed_bytes); }, both), "by directory")
          << by << both;
    }
    EXPECT_NE(read_with([](ZipMember& member) { member.crc32 ^= 1U; }, both), "by directory");
  }
}

TEST_F(ArchiveReaderTest, RefusesALocalHeaderOfAnotherName) {
  Parts parts(good_);
  parts.find("tiles/0/2.tile").other_local_name = "tiles/0/3.tile";
  EXPECT_THAT(read_all(parts.join()), HasSubstr("local header"));
}

TEST_F(ArchiveReaderTest, RefusesAGridThatTheFileCannotHold) {
  // Absent tiles cost nothing in a directory, so that a few bytes could claim any number of them.
  Parts parts(good_);
  auto& metadata = parts.find("isohf.json");
  std::string json(reinterpret_cast<const char*>(metadata.data.data()), metadata.data.size());
  const std::string columns = "\"tiles\": {\n  \"columns\": 4,\n  \"rows\": 3";
  ASSERT_NE(json.find(columns), std::string::npos);
  json.replace(json.find(columns), columns.size(), "\"tiles\": {\n  \"columns\": 65536,\n  \"rows\": 65536");
  metadata.data.assign(reinterpret_cast<const std::byte*>(json.data()),
                       reinterpret_cast<const std::byte*>(json.data()) + json.size());
  metadata.member.bytes = metadata.member.compressed_bytes = json.size();
  metadata.member.crc32 = crc32(metadata.data);
  EXPECT_THAT(read_all(parts.join()), HasSubstr("tiles: 65536x65536 are stated"));
}

TEST_F(ArchiveReaderTest, RefusesAnIndexOfMoreAbsentTilesThanStoredOnesMakeLikely) {
  // A shard may have an index of 65,536 pages of nothing, 3 MB in all. Under another name it is an archive.
  const TileGrid grid = TileGrid::make(TileShape::make(5, 5, 1), 65536, 65536, 10.0, 10.0);
  Metadata metadata = test::make_metadata(grid, CodeType::kU16);
  metadata.extensions.emplace_back(kShardName, format_shard_record({"", 1, 65536, 0, 1, {0.0}}));
  std::filesystem::remove(path());
  ArchiveWriter writer(path(), grid, WriterOptions{});
  writer.skip_tiles(grid.tile_count());
  static_cast<void>(writer.finish(metadata));
  EXPECT_EQ(ArchiveReader(path(), ArchiveReader::Shards::kRead).tables().front().columns, 65536);
  Parts parts(test::read_bytes(path()));
  auto& text = parts.find("isohf.json");
  std::string json(reinterpret_cast<const char*>(text.data.data()), text.data.size());
  json.replace(json.find("\"shard\""), 7, "\"shelf\"");
  std::ranges::copy(std::as_bytes(std::span<const char>(json)), text.data.begin());
  text.member.crc32 = crc32(text.data);
  test::write_file(path(), parts.join());
  EXPECT_THAT(test::error_of([&] { ArchiveReader{path()}; }).what(), HasSubstr("tiles: 65536x65536 are stated"));
  // No writer makes such an archive either.
  metadata.extensions.clear();
  ArchiveWriter refused(folder_ / "b.isohf", grid, WriterOptions{});
  refused.skip_tiles(grid.tile_count());
  EXPECT_THAT(test::error_of([&] { static_cast<void>(refused.finish(metadata)); }).what(),
              HasSubstr("an archive that cannot be read"));
}

TEST_F(ArchiveReaderTest, NamesEachMemberThatOnlyIndexOrDirectoryHas) {
  Parts parts(good_);
  const auto without = [&](const std::string& name, const std::string& instead) {
    return parts.join([&](std::vector<Parts::Part>& all) {
      for (Parts::Part& part : all) {
        if (part.member.name == name) part.member.name = instead;
      }
    });
  };
  // The directory has another name in its place.
  test::write_file(path(), without("tiles/0/1.tile", "tiles/2/0.tile"));
  EXPECT_THAT(ArchiveReader(path()).check_structure(),
              testing::AllOf(testing::Contains(HasSubstr("another name than the directory")),
                             testing::Contains(HasSubstr("member \"tiles/0/1.tile\": the index has it"))));
  Parts added(good_);
  added.parts.insert(added.parts.begin() + 2, added.find("preview.png"));
  added.parts[2].member.name = "tiles/2/0.tile";  // a void one
  test::write_file(path(), added.join());
  EXPECT_FALSE(ArchiveReader(path()).check_structure().empty());
}

TEST_F(ArchiveReaderTest, NegativeZeroIsNoRowOfResiduals) {
  EXPECT_FALSE(table_place("residual/-0000000"));
  EXPECT_EQ(table_place("residual/00000000")->row, 0);
}

TEST_F(ArchiveReaderTest, SaysWhatItIsNot) {
  const auto message = [&](const std::string& text) {
    std::vector<std::byte> bytes;
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    return read_all(bytes);
  };
  EXPECT_THAT(message(""), HasSubstr("no isohf archive"));
  EXPECT_THAT(message(std::string(100000, 'x')), HasSubstr("no isohf archive"));
  Parts parts(good_);
  parts.erase("isohf.json");
  EXPECT_THAT(read_all(parts.join()), HasSubstr("no member \"isohf.json\""));
  EXPECT_THROW(ArchiveReader{folder_ / "absent"}, Error);
  EXPECT_THROW(ArchiveReader{folder_ / "."}, Error);
}

TEST_F(ArchiveReaderTest, RefusesTilesOutsideItsGrid) {
  const ArchiveReader reader(path());
  for (const TileIndex tile : {TileIndex{-1, 0}, TileIndex{0, -1}, TileIndex{4, 0}, TileIndex{0, 3}}) {
    EXPECT_THROW(static_cast<void>(reader.tile_entry(tile)), Error);
    EXPECT_THROW(static_cast<void>(reader.read_tile(tile)), Error);
  }
}

TEST_F(ArchiveReaderTest, GivesElevationsInUnits) {
  const ArchiveReader reader(path());
  const std::vector<double> elevations = reader.read_elevations({2, 0});
  const TileCodes codes = tile(2);
  ASSERT_EQ(elevations.size(), codes.codes.size());
  EXPECT_EQ(elevations[6], -12.5 + 0.1 * codes.codes[6]);
  for (const double elevation : reader.read_elevations({0, 2})) EXPECT_TRUE(std::isnan(elevation));  // all void
}

TEST_F(ArchiveReaderTest, ReadsFromManyThreadsAtOnce) {
  const ArchiveReader reader(path());
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&, t] {
      for (int round = 0; round < 50; ++round) {
        const std::int64_t flat = (t * 5 + round) % grid_.tile_count();
        if (reader.read_tile(grid_.tile_at(flat)) != tile(flat)) ++wrong;
        if (reader.members().size() != 5) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(MemberTables, ADescriptionWithReservedNumbersSetIsNone) {
  TableDescription table;
  table.members.name = "tiles/{row}/{column}.tile";
  table.members.columns = table.members.rows = 1;
  table.page_records = 512;
  std::vector<std::byte> bytes;
  append_description(table, bytes);
  ASSERT_TRUE(parse_descriptions(bytes, 1));
  for (const std::size_t reserved : {5U, 65U, 72U, 79U}) {
    bytes[reserved] ^= std::byte{1};
    EXPECT_FALSE(parse_descriptions(bytes, 1)) << reserved;
    bytes[reserved] ^= std::byte{1};
  }
}

}  // namespace
}  // namespace isohf
