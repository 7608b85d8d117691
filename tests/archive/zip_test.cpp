#include "isohf/base/zip.h"

#include <gtest/gtest.h>

#include "archive/tile/tiles.h"
#include "isohf/archive.h"
#include "isohf/archive/archive_index_builder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(Zip, NamesTilesAndReadsTheirNamesBack) {
  EXPECT_EQ(tile_name({7, 12}), "tiles/12/7.tile");
  for (const TileIndex tile : {TileIndex{0, 0}, TileIndex{10, 0}, TileIndex{16777215, 16777215}}) {
    EXPECT_EQ(tile_from_name(tile_name(tile)), (PlaneTile{0, tile}));
    EXPECT_EQ(tile_from_name(tile_name(tile, 12)), (PlaneTile{12, tile}));
  }
  for (const char* name :
       {"", "tiles/", "tiles/1", "tiles/1/", "tiles/1/2", "tiles/01/2.tile", "tiles/1/02.tile", "tiles/+1/2.tile",
        "tiles/1/2.tile ", "Tiles/1/2.tile", "tiles/1/-2.tile", "tiles//2.tile", "tiles/1/2/3.tile",
        "planes/0/1/2.tile", "planes/1/2.tile", "planes/01/1/2.tile", "planes/1/1/2", "planes/-1/1/2.tile"}) {
    EXPECT_EQ(tile_from_name(name), std::nullopt) << name;
  }
}

/// Entries of a directory that stands alone in a file.
std::vector<ZipEntry> entries_of(const std::vector<std::byte>& file) {
  std::vector<ZipEntry> entries;
  const auto source = memory_source(file);
  for (ZipEntries all(*source, find_archive_end(*source)); const auto entry = all.next();) entries.push_back(*entry);
  return entries;
}

TEST(Zip, KeepsSizesAndOffsetsBeyond32Bits) {
  const std::uint64_t values[] = {0, 1, 0xfffffffeU, 0xffffffffU, 0x100000000U, 0x123456789abcU};
  std::vector<ZipMember> members;
  for (const std::uint64_t bytes : values) {
    for (const std::uint64_t offset : values)
      members.push_back({"a/b", ZipMethod::kDeflated, 77, bytes / 2, bytes, offset});
  }
  std::vector<std::byte> file;
  for (const ZipMember& member : members) append_directory_entry(member, file);
  append_end_records(members.size(), 0, file.size(), file);
  const std::vector<ZipEntry> entries = entries_of(file);
  ASSERT_EQ(entries.size(), members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    EXPECT_EQ(entries[i].bytes, members[i].bytes);
    EXPECT_EQ(entries[i].compressed_bytes, members[i].compressed_bytes);
    EXPECT_EQ(entries[i].header_offset, members[i].header_offset);
    EXPECT_EQ(entries[i].crc32, 77U);
    EXPECT_EQ(entries[i].name, "a/b");
  }
}

TEST(Zip, CountsMoreEntriesThan16Bits) {
  std::vector<std::byte> file;
  for (int i = 0; i < 70000; ++i) append_directory_entry({"x", ZipMethod::kStored, 0, 0, 0, 0}, file);
  append_end_records(70000, 0, file.size(), file);
  EXPECT_EQ(entries_of(file).size(), 70000U);
}

TEST(Zip, StatesTheSizeOfALocalHeader) {
  for (const std::uint64_t bytes : {std::uint64_t{5}, std::uint64_t{0xffffffffU}}) {
    const ZipMember member{"some/name", ZipMethod::kStored, 1, bytes, bytes, 0};
    std::vector<std::byte> header;
    append_local_header(member, header);
    EXPECT_EQ(header.size(), local_header_bytes(member));
  }
}

TEST(Zip, RefusesEveryTruncationOfADirectory) {
  std::vector<std::byte> file;
  for (int i = 0; i < 3; ++i) append_directory_entry({"name", ZipMethod::kStored, 0, 1, 1, 0x1ffffffffU}, file);
  append_end_records(3, 0, file.size(), file);
  for (std::size_t size = 0; size < file.size(); ++size) {
    const std::vector<std::byte> cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_THROW(static_cast<void>(entries_of(cut)), Error) << size;
  }
}

TEST(Zip, RefusesEndRecordsThatContradictEachOther) {
  std::vector<std::byte> file;
  append_directory_entry({"name", ZipMethod::kStored, 0, 1, 1, 0}, file);
  append_end_records(1, 0, file.size(), file);
  EXPECT_EQ(entries_of(file).size(), 1U);
  // Entries, size and offset of the plain record: others, and those that say "see the other one".
  for (const auto& [behind_end, bytes] : {std::pair(14, 2), std::pair(12, 2), std::pair(10, 4), std::pair(6, 4)}) {
    std::vector<std::byte> changed = file;
    const auto field = changed.end() - behind_end;
    *field ^= std::byte{2};
    if (bytes == 2) *(changed.end() - 26 + behind_end) ^= std::byte{2};  // both counts
    EXPECT_THROW(static_cast<void>(entries_of(changed)), Error) << behind_end;
    std::fill_n(field, bytes, std::byte{0xff});
    if (bytes == 2) std::fill_n(changed.end() - 26 + behind_end, bytes, std::byte{0xff});
    EXPECT_EQ(entries_of(changed).size(), 1U) << behind_end;
  }
}

TEST(Zip, ReachesTilesBeyondFourGibibytes) {
  // Five GiB of a hole as a member, one tile, index, metadata.
  const test::TemporaryFolder folder;
  const std::string path = folder / "large.isohf";
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 1, 1, 1.0, 1.0);
  const TileCodes tile = test::make_tile(grid.shape(), CodeType::kU16, test::Kind::kTerrain, 1);
  const EncodedTile encoded = encode_tile(grid.shape(), tile);
  Metadata metadata = test::make_metadata(grid, CodeType::kU16);
  metadata.content_sha256 = metadata.ground_sha256 = std::string(64, '0');
  const std::string json = format_metadata(metadata);
  const auto text = std::as_bytes(std::span<const char>(json));
  const std::uint64_t hole_bytes = std::uint64_t{5} << 30U;
  {
    OutputFile file(path, {});
    ArchiveIndexBuilder contents(grid, {}, folder / ".");
    std::vector<std::byte> header;
    const auto append = [&](JournalRecord::Kind kind, const ZipMember& member, std::span<const std::byte> data) {
      header.clear();
      append_local_header(member, header);
      file.append(header);
      file.append(data);
      JournalRecord record;
      record.kind = kind;
      record.member = member;
      if (kind != JournalRecord::Kind::kEmptyTile) contents.add(record);
    };
    append(JournalRecord::Kind::kMember, {"hole", ZipMethod::kStored, 0, hole_bytes, hole_bytes, 0}, {});
    file.flush();
    file.truncate(file.position() + hole_bytes);
    append(JournalRecord::Kind::kTile,
           {tile_name({0, 0}), ZipMethod::kDeflated, encoded.payload_crc32, encoded.deflated.size(),
            encoded.payload_bytes, file.position()},
           encoded.deflated);
    const ZipMember index = contents.append_index(file);
    const ZipMember last{kMetadataName, ZipMethod::kStored, crc32(text), json.size(), json.size(), file.position()};
    append(JournalRecord::Kind::kEmptyTile, last, text);
    contents.append_directory(index, last, file);
    file.commit();
  }

  const ArchiveReader reader(path);
  EXPECT_FALSE(reader.reads_by_directory());
  EXPECT_GT(reader.tile_entry({0, 0}).offset_bytes, hole_bytes);
  EXPECT_EQ(reader.read_tile({0, 0}), tile);
  EXPECT_EQ(reader.members().size(), 3U);
}

}  // namespace
}  // namespace isohf
