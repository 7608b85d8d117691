#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string_view>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// What to write: every combination of these is read back below.
struct ExrPicture {
  int width = 37;
  int height = 41;
  Imath::V2i origin{0, 0};
  Imf::PixelType type = Imf::FLOAT;
  Imf::Compression compression = Imf::ZIP_COMPRESSION;
  Imf::LineOrder order = Imf::INCREASING_Y;
  std::vector<std::string> channels = {"Y"};
  int tile_size = 0;  ///< 0: scan lines
  Imf::LevelMode levels = Imf::ONE_LEVEL;
};

/// Small whole numbers: exact in half, and in every compression that rounds to no fewer than 11 bits.
int value_at(int column, int row, std::size_t channel) {
  return (column * 7 + row * 13) % 1000 + static_cast<int>(channel) * 1000;
}

class Samples {
 public:
  explicit Samples(const ExrPicture& picture) : picture_(picture) {
    for (std::size_t c = 0; c < picture.channels.size(); ++c) {
      auto& plane = planes_.emplace_back(static_cast<std::size_t>(picture.width * picture.height) * size());
      for (int row = 0; row < picture.height; ++row) {
        for (int column = 0; column < picture.width; ++column) {
          store(plane.data() + static_cast<std::size_t>(row * picture.width + column) * size(),
                value_at(column, row, c));
        }
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return picture_.type == Imf::HALF ? 2 : 4; }
  [[nodiscard]] const std::vector<std::byte>& plane(std::size_t channel) const { return planes_[channel]; }

  [[nodiscard]] Imf::FrameBuffer frame() {
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < planes_.size(); ++c) {
      frame.insert(picture_.channels[c], Imf::Slice::Make(picture_.type, planes_[c].data(), picture_.origin,
                                                          picture_.width, picture_.height));
    }
    return frame;
  }

 private:
  void store(std::byte* at, int value) const {
    const auto put = [&](auto sample) { std::memcpy(at, &sample, sizeof sample); };
    if (picture_.type == Imf::HALF) put(Imath::half(static_cast<float>(value)).bits());
    if (picture_.type == Imf::FLOAT) put(static_cast<float>(value));
    if (picture_.type == Imf::UINT) put(static_cast<std::uint32_t>(value));
  }

  ExrPicture picture_;
  std::vector<std::vector<std::byte>> planes_;
};

Imf::Header header_of(const ExrPicture& picture) {
  const Imath::Box2i window(picture.origin, picture.origin + Imath::V2i(picture.width - 1, picture.height - 1));
  Imf::Header header(window, window);
  header.compression() = picture.compression;
  header.lineOrder() = picture.order;
  for (const std::string& name : picture.channels) header.channels().insert(name, Imf::Channel(picture.type));
  if (picture.tile_size > 0) {
    const auto size = static_cast<unsigned>(picture.tile_size);
    header.setTileDescription(Imf::TileDescription(size, size, picture.levels));
  }
  return header;
}

void write_tiled(const std::string& path, const ExrPicture& picture, Samples& samples) {
  Imf::TiledOutputFile file(path.c_str(), header_of(picture));
  for (int ly = 0; ly < file.numYLevels(); ++ly) {
    for (int lx = 0; lx < file.numXLevels(); ++lx) {
      if (!file.isValidLevel(lx, ly)) continue;
      // The smaller levels repeat a corner of the largest: wrong values there must never be read.
      file.setFrameBuffer(samples.frame());
      file.writeTiles(0, file.numXTiles(lx) - 1, 0, file.numYTiles(ly) - 1, lx, ly);
    }
  }
}

void write_exr(const std::string& path, const ExrPicture& picture) {
  Samples samples(picture);
  if (picture.tile_size > 0) return write_tiled(path, picture, samples);
  Imf::OutputFile file(path.c_str(), header_of(picture));
  file.setFrameBuffer(samples.frame());
  file.writePixels(picture.height);
}

void expect_reads_as(const std::string& path, const ExrPicture& picture) {
  const Samples samples(picture);
  const auto source = kExrFormat.open(path, {});
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.width, picture.width);
  ASSERT_EQ(info.height, picture.height);
  ASSERT_EQ(size_bytes(info.sample_type), samples.size());
  EXPECT_EQ(info.format, "OpenEXR");
  ASSERT_EQ(read_whole(*source), samples.plane(0));
  // Any order of windows gives the same samples: upwards, in odd rectangles.
  for (int row = picture.height - 3; row >= 0; row -= 5) {
    for (int column = 0; column + 6 <= picture.width; column += 11) {
      const auto block = read_window(*source, {column, row, 6, 3});
      for (int y = 0; y < 3; ++y) {
        const auto at = static_cast<std::size_t>((row + y) * picture.width + column) * samples.size();
        ASSERT_EQ(std::memcmp(block.data() + static_cast<std::size_t>(y * 6) * samples.size(),
                              samples.plane(0).data() + at, 6 * samples.size()),
                  0)
            << "column " << column << " row " << row + y;
      }
    }
  }
}

class ExrSource : public InFolder {
 protected:
  const std::string path = folder / "picture.exr";
};

TEST_F(ExrSource, ReadsEverySampleTypeCompressionAndLayout) {
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT, Imf::UINT}) {
    for (const Imf::Compression compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                               Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION}) {
      for (const int tile_size : {0, 16}) {
        for (const Imf::LevelMode levels : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS}) {
          if (tile_size == 0 && levels != Imf::ONE_LEVEL) continue;
          for (const Imf::LineOrder order : {Imf::INCREASING_Y, Imf::DECREASING_Y, Imf::RANDOM_Y}) {
            if (tile_size == 0 && order == Imf::RANDOM_Y) continue;
            ExrPicture picture{
                .type = type, .compression = compression, .order = order, .tile_size = tile_size, .levels = levels};
            SCOPED_TRACE(fmt::format("type {} compression {} tiles {} levels {} order {}", type, compression, tile_size,
                                     levels, order));
            write_exr(path, picture);
            expect_reads_as(path, picture);
          }
        }
      }
    }
  }
}

TEST_F(ExrSource, ReadsLossyHalvesAsTheLibraryDecodesThem) {
  for (const Imf::Compression compression :
       {Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
    ExrPicture picture;
    picture.type = Imf::HALF;
    picture.compression = compression;
    picture.height = 300;  // more than the 256 lines that DWAB packs together
    write_exr(path, picture);
    const auto source = kExrFormat.open(path, {});
    const auto samples = read_whole(*source);
    // Rows one by one, from the last to the first, come out as they do all at once.
    const auto row_bytes = static_cast<std::size_t>(picture.width) * 2;
    for (int row = picture.height - 1; row >= 0; --row) {
      const auto one = read_window(*source, {0, row, picture.width, 1});
      ASSERT_EQ(std::memcmp(one.data(), samples.data() + static_cast<std::size_t>(row) * row_bytes, row_bytes), 0);
    }
  }
}

TEST_F(ExrSource, TakesTheDataWindowWhereverItLies) {
  for (const Imath::V2i& origin : {Imath::V2i(30, 40), Imath::V2i(-500, -7), Imath::V2i(-3, 1000000)}) {
    for (const int tile_size : {0, 8}) {
      write_exr(path, {.origin = origin, .tile_size = tile_size});
      expect_reads_as(path, {.origin = origin, .tile_size = tile_size});
    }
  }
  const ExrPicture picture;
  Imf::Header header = header_of(picture);
  header.displayWindow() = Imath::Box2i({0, 0}, {99, 99});
  {
    Samples samples(picture);
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(samples.frame());
    file.writePixels(picture.height);
  }
  EXPECT_THAT(kExrFormat.open(path, {})->info().warnings,
              ElementsAre(HasSubstr("(0, 0) - (36, 40) is read; the display window (0, 0) - (99, 99)")));
}

TEST_F(ExrSource, PrefersElevationChannelsAndSaysSo) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"A", "B", "G", "R"}, "R"},
      {{"R", "Y"}, "Y"},
      {{"R", "Z"}, "Z"},
      {{"mask", "height"}, "height"},
      {{"G", "A"}, "G"},
      {{"a.mask", "b.Z"}, "b.Z"},
      {{"B", "depth"}, "depth"},
      {{"N.Y", "height.Y"}, "height.Y"},
      {{"N.Z", "Z"}, "Z"},
      {{"N.Y", "N.Z", "beauty.R"}, "beauty.R"},
      {{"Y", "terrain.Height"}, "terrain.Height"},
      {{"Y", "ELEVATION"}, "ELEVATION"},
      {{"A", "displacement"}, "displacement"},
      {{"Q", "layer.R"}, "layer.R"},
      {{"A", "Q"}, "Q"},
      {{"A", "N.X"}, "N.X"}};
  for (const auto& [channels, chosen] : cases) {
    ExrPicture picture;
    picture.channels = channels;
    write_exr(path, picture);
    const auto source = kExrFormat.open(path, {});
    EXPECT_EQ(source->info().channel, chosen);
    ASSERT_EQ(source->info().warnings.size(), 1U);
    EXPECT_THAT(source->info().warnings[0],
                HasSubstr(fmt::format("channel {} is read, of {}", chosen, channels.size())));
    const bool is_guess = chosen == "Q" || chosen == "G" || chosen == "N.X";
    EXPECT_EQ(source->info().warnings[0].kind, is_guess ? Warning::Kind::kLoss : Warning::Kind::kNote) << chosen;
  }
}

TEST_F(ExrSource, ReadsTheChannelAskedForByNameOrNumber) {
  const ExrPicture picture{.channels = {"B", "G", "R"}};
  write_exr(path, picture);
  const Samples samples(picture);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (const std::string& name : {picture.channels[channel], std::to_string(channel)}) {
      const auto source = kExrFormat.open(path, of_channel(name));
      EXPECT_EQ(read_whole(*source), samples.plane(channel));
      EXPECT_TRUE(source->info().warnings.empty());
    }
  }
  for (const char* name : {"Y", "3", "-1", "1x", "r", "R "}) {
    const Error error = error_of([&] { (void)kExrFormat.open(path, of_channel(name)); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(error.what(), fmt::format("{}: has no channel \"{}\"; it has B, G, R (or 0...2)", path, name));
  }
}

TEST_F(ExrSource, ReadsPartsOfAMultiPartFile) {
  std::vector<ExrPicture> pictures(3);
  pictures[0].channels = {"mask"};
  pictures[1].channels = {"Y", "error"};
  pictures[1].type = Imf::HALF;
  pictures[1].tile_size = 16;
  pictures[2].channels = {"Y"};
  pictures[2].width = 5;
  pictures[2].height = 9;
  const std::vector<std::string> names = {"cover", "ground", "small"};
  {
    std::vector<Imf::Header> headers;
    for (std::size_t part = 0; part < pictures.size(); ++part) {
      Imf::Header header = header_of(pictures[part]);
      header.displayWindow() = Imath::Box2i({0, 0}, {36, 40});  // shared by all parts
      header.setName(names[part]);
      header.setType(pictures[part].tile_size > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
      headers.push_back(header);
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (int part = 0; part < 3; ++part) {
      const ExrPicture& picture = pictures[static_cast<std::size_t>(part)];
      Samples samples(picture);
      if (picture.tile_size > 0) {
        Imf::TiledOutputPart out(file, part);
        out.setFrameBuffer(samples.frame());
        out.writeTiles(0, out.numXTiles() - 1, 0, out.numYTiles() - 1);
      } else {
        Imf::OutputPart out(file, part);
        out.setFrameBuffer(samples.frame());
        out.writePixels(picture.height);
      }
    }
  }
  const auto expect = [&](const std::string& channel, std::size_t number, std::size_t plane, const std::string& name,
                          const std::string& part = {}) {
    OpenOptions options = of_channel(channel);
    options.part = part;
    const auto source = open_raster(path, options);
    EXPECT_EQ(read_whole(*source), Samples(pictures[number]).plane(plane)) << part << " " << channel;
    EXPECT_EQ(source->info().channel, name);
  };
  expect("", 1, 0, "ground.Y");
  expect("mask", 0, 0, "cover.mask");
  expect("Y", 1, 0, "ground.Y");
  expect("error", 1, 1, "ground.error");
  expect("small.Y", 2, 0, "small.Y");
  expect("3", 2, 0, "small.Y");
  EXPECT_THAT(error_of([&] { (void)kExrFormat.open(path, of_channel("Z")); }).what(),
              HasSubstr("it has cover.mask, ground.Y, ground.error, small.Y"));
  expect("", 1, 0, "ground.Y", "ground");
  expect("error", 1, 1, "ground.error", "1");
  expect("", 2, 0, "small.Y", "small");
  expect("0", 2, 0, "small.Y", "2");
  OpenOptions wrong;
  wrong.part = "sky";
  EXPECT_THAT(error_of([&] { (void)kExrFormat.open(path, wrong); }).what(), HasSubstr("has no part \"sky\""));
  wrong.part = "3";
  EXPECT_THAT(error_of([&] { (void)kExrFormat.open(path, wrong); }).what(), HasSubstr("in parts 0...2"));
  write_file(folder / "a.asc", "ncols 1\nnrows 1\n1\n");
  EXPECT_THAT(error_of([&] { (void)open_raster(folder / "a.asc", wrong); }).what(),
              HasSubstr("`part` is for archives, TIFF and OpenEXR"));
}

TEST_F(ExrSource, RefusesSubsampledChannelsOnly) {
  ExrPicture picture;
  picture.width = picture.height = 8;
  Samples samples(picture);
  std::vector<float> chroma(16, 1.0F);
  Imf::Header header = header_of(picture);
  header.channels().insert("BY", Imf::Channel(Imf::FLOAT, 2, 2));
  {
    Imf::OutputFile file(path.c_str(), header);
    Imf::FrameBuffer frame = samples.frame();
    frame.insert("BY", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(chroma.data()), 4, 16, 2, 2));
    file.setFrameBuffer(frame);
    file.writePixels(8);
  }
  EXPECT_EQ(read_whole(*kExrFormat.open(path, {})), samples.plane(0));
  const Error error = error_of([&] { (void)kExrFormat.open(path, of_channel("BY")); });
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("BY is subsampled"));
}

TEST_F(ExrSource, RefusesAbsurdSizesBeforeAllocating) {
  write_exr(path, {});
  const std::string bytes = read_file(path);
  const auto refused = [&](const std::string& changed, const char* text) {
    write_file(path, changed);
    const Error error = error_of([&] { (void)kExrFormat.open(path, {}); });
    EXPECT_THAT(error.what(), AllOf(StartsWith(path + ": OpenEXR"), HasSubstr(text)));
  };
  const auto with_window = [&](std::vector<std::int32_t> box, std::size_t skip = 4) {
    constexpr std::string_view kName("dataWindow\0box2i\0", 17);
    std::string changed = bytes;
    std::memcpy(changed.data() + changed.find(kName) + kName.size() + skip, box.data(), box.size() * 4);
    return changed;
  };
  constexpr std::int32_t kHuge = 0x3FFFFFFF;
  refused(with_window({0, 0, kHuge, kHuge}), "Invalid data window");
  refused(with_window({0, 0, -1, 40}), "Invalid data window");
  refused(with_window({INT32_MIN, INT32_MIN, INT32_MAX, INT32_MAX}), "Invalid data window");
  refused(with_window({0, 0, 40, 0xFFFFFF}), "declares 41 x 16777216 pixels in 1048576 chunks, for which a file of");
  refused(with_window({0, 0, 0xFFFFFF, 40}), "larger than 32 MiB");
  refused(with_window({INT32_MAX}, 0), "Attribute 'dataWindow': Invalid size");
  // Attributes that claim more than the file has.
  for (const char* type : {"string", "made-up", "preview"}) {
    std::string changed = bytes;
    changed.insert(bytes.find("compression"),
                   std::string("comments\0", 9) + type + std::string("\0\xFF\xFF\xFF\x7F", 5));
    refused(changed, "Attribute 'comments'");
  }
}

}  // namespace
}  // namespace isohf::test
