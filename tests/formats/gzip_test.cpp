#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <random>

#include "formats/raw_file.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "support/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

std::string gzipped(const std::string& contents) {
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(compressBound(contents.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(contents.data()));
  stream.avail_in = static_cast<uInt>(contents.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string terrain(std::size_t bytes) {
  std::string contents(bytes, '\0');
  std::mt19937 random(4);
  for (std::size_t i = 0; i < bytes; ++i) contents[i] = static_cast<char>(i / 700 % 120 + random() % 3);
  return contents;
}

TEST(Gzip, ReadsATileOfSeveralMegabytesInAnyOrder) {
  const TemporaryFolder folder;
  const std::string plain_path = folder / "N44E006.hgt";
  const std::string contents = terrain(std::size_t{1201} * 1201 * 2);
  write_file(plain_path, contents);
  write_file(plain_path + ".gz", gzipped(contents));
  const auto plain = open_source(plain_path, {});
  const auto packed = open_source(plain_path + ".gz", {});
  EXPECT_EQ(packed->info().format, "SRTM HGT");
  EXPECT_EQ(packed->info().georeference.origin_y, 45.0);
  EXPECT_EQ(packed->info().warnings.size(), 0U);
  std::mt19937 random(9);
  for (int round = 0; round < 60; ++round) {
    const std::int64_t row = random() % 1190;
    const std::int64_t column = random() % 1000;
    const Window window{column, row, 1 + static_cast<std::int64_t>(random() % 200),
                        1 + static_cast<std::int64_t>(random() % 11)};
    ASSERT_EQ(read_window(*packed, window), read_window(*plain, window)) << column << ", " << row;
  }
  EXPECT_EQ(read_whole(*packed), read_whole(*plain));
}

TEST(Gzip, HoldsTextGridsWithTheirPrj) {
  const TemporaryFolder folder;
  write_file(folder / "a.asc.gz", gzipped("ncols 2\nnrows 2\nxllcorner 5\nyllcorner 6\ncellsize 1\n1 2\n3 4\n"));
  write_file(folder / "a.prj", R"(PROJCS["Here",GEOGCS["G",DATUM["D",SPHEROID["S",6378137,298]]],UNIT["metre",1]])");
  const auto source = open_source(folder / "a.asc.gz", {});
  EXPECT_EQ(source->info().format, "ESRI ASCII grid");
  EXPECT_EQ(source->info().georeference.system.name, "Here");
  const auto all = read_whole(*source);
  EXPECT_EQ(value_at(SampleType::kInt32, all, 3), 4.0);
  EXPECT_EQ(read_window(*source, {0, 0, 1, 1}), std::vector<std::byte>(all.begin(), all.begin() + 4));
}

TEST(Gzip, JoinsMembersAndPassesPaddingOver) {
  const TemporaryFolder folder;
  write_file(folder / "a.gz", gzipped("first ") + gzipped("") + gzipped("second") + std::string(600, '\0'));
  const RawFile file(folder / "a.gz");
  ASSERT_EQ(file.size_bytes(), 12U);
  std::string text(12, '?');
  file.read(0, std::as_writable_bytes(std::span(text)));
  EXPECT_EQ(text, "first second");
  EXPECT_EQ(error_of([&] { file.read(7, std::as_writable_bytes(std::span(text))); }).code(), ErrorCode::kCorrupt);
}

TEST(Gzip, RefusesEveryTruncationAndEveryFlippedByte) {
  const TemporaryFolder folder;
  const std::string whole = gzipped(terrain(800));
  const std::string path = folder / "4.raw.gz";
  OpenOptions options;
  options.raw = RawLayout{20, 20, SampleType::kUint16, false};
  const auto failure = [&](const std::string& bytes, ErrorCode* code) {
    write_file(path, bytes);
    return failure_of(path, code, [&] { read_corner(*open_source(path, options)); });
  };
  ErrorCode code = ErrorCode::kCancelled;
  EXPECT_EQ(failure(whole, &code), "");
  for (std::size_t length = 3; length < whole.size(); ++length) {
    EXPECT_THAT(failure(whole.substr(0, length), &code), HasSubstr("gzip data: ends early")) << length;
    EXPECT_EQ(code, ErrorCode::kCorrupt);
  }
  EXPECT_THAT(failure(whole + "garbage", &code), HasSubstr("incorrect header check"));
  for (std::size_t at = 10; at < whole.size(); ++at) {  // behind the header, whose time and system mean nothing
    if (at == whole.size() - 9) continue;               // the last bits before the checksum are filling
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    EXPECT_NE(failure(damaged, &code), "") << at;
    EXPECT_EQ(code, ErrorCode::kCorrupt) << at;
  }
}

TEST(Gzip, SaysWhichFormatsItDoesNotReadInside) {
  const TemporaryFolder folder;
  const auto says = [&](const std::string& name, const std::string& contents) {
    write_file(folder / name, gzipped(contents));
    return std::string(error_of([&] { (void)open_source(folder / name, {}); }).what());
  };
  EXPECT_THAT(says("a.tif.gz", std::string("II*\0\x08\0\0\0", 8) + std::string(90, ' ')),
              HasSubstr("is TIFF in gzip, which isohf does not read; gunzip it first"));
  EXPECT_THAT(says("a.txt.gz", "nothing that is known"), HasSubstr("is something unknown in gzip"));
  // A browser may have unpacked it already: the content decides.
  write_file(folder / "b.asc.gz", "ncols 2\nnrows 1\n1 2\n");
  EXPECT_EQ(open_source(folder / "b.asc.gz", {})->info().width, 2);
}

}  // namespace
}  // namespace isohf::test
