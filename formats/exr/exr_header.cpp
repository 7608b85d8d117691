#include "formats/exr/exr_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <vector>

#include "formats/io/text.h"
#include "formats/readers.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::array<unsigned char, 4> kMagic = {0x76, 0x2F, 0x31, 0x01};
constexpr std::uint32_t kVersionMask = 0xFF;
constexpr std::uint32_t kTiledFlag = 0x200;
constexpr std::uint32_t kMultiPartFlag = 0x1000;
constexpr std::size_t kMaxNameBytes = 255;
/// Far more than any writer makes; keeps a crafted file from being walked for hours.
constexpr int kMaxAttributes = 100000;
/// Chunks up to this size are believed whatever the size of the file; larger ones must be possible at a compression
/// twice as good as deflate's limit of 1032 : 1.
constexpr std::uint64_t kUnquestionedChunkBytes = std::uint64_t{32} << 20U;
constexpr std::uint64_t kMaxCompressionRatio = 2048;

struct Box {
  std::int32_t min_x, min_y, max_x, max_y;
};

/// What decides how much memory a part takes.
struct PartHeader {
  std::optional<Box> data_window;
  std::uint64_t bytes_per_pixel = 0;
  std::uint8_t compression = 0;
  bool has_tiles = false;
  std::uint32_t tile_width = 0;
  std::uint32_t tile_height = 0;
  std::string type;
  std::int32_t chunk_count = 0;
};

class HeaderWalk {
 public:
  explicit HeaderWalk(const std::string& path) : file_(path, std::ios::binary) {
    file_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(std::max<std::streamoff>(file_.tellg(), 0));
    file_.seekg(0);
    if (!file_) throw Error(ErrorCode::kIo, "cannot be read");
  }

  [[nodiscard]] std::uint64_t file_size() const { return size_; }

  [[nodiscard]] std::vector<std::byte> take(std::uint64_t count) {
    require(count);
    std::vector<std::byte> bytes(count);
    file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
    if (!file_) throw Error(ErrorCode::kIo, fmt::format("cannot be read at byte {}", position_));
    position_ += count;
    return bytes;
  }

  void skip(std::uint64_t count) {
    require(count);
    position_ += count;
    file_.seekg(static_cast<std::streamoff>(position_));
  }

  [[nodiscard]] std::uint32_t take_u32() {
    const auto bytes = take(4);
    return ByteReader(bytes).read<std::uint32_t>();
  }

  /// A name that ends in a zero byte.
  [[nodiscard]] std::string take_name() {
    std::string name;
    for (;;) {
      require(1);
      const int c = file_.get();
      if (c < 0) throw Error(ErrorCode::kIo, fmt::format("cannot be read at byte {}", position_));
      ++position_;
      if (c == 0) return name;
      name.push_back(static_cast<char>(c));
      if (name.size() > kMaxNameBytes) {
        throw Error(ErrorCode::kCorrupt, fmt::format("OpenEXR header: a name of more than {} bytes before byte {}",
                                                     kMaxNameBytes, position_));
      }
    }
  }

 private:
  void require(std::uint64_t count) const {
    if (count > size_ - position_) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("OpenEXR header ends early: {} bytes wanted at byte {} of {}", count, position_, size_));
    }
  }

  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
};

/// Sums the sample sizes of a channel list; subsampled channels count in full.
std::uint64_t bytes_per_pixel(std::span<const std::byte> channels) {
  ByteReader reader(channels);
  std::uint64_t bytes = 0;
  for (;;) {
    std::size_t length = 0;
    while (reader.read<char>() != '\0') ++length;
    if (length == 0) return bytes;
    constexpr std::int32_t kHalf = 1;
    bytes += reader.read<std::int32_t>() == kHalf ? 2U : 4U;
    (void)reader.read_bytes(12);  // linearity, reserved, sampling
  }
}

void take_attribute(HeaderWalk& walk, const std::string& name, std::uint32_t size, PartHeader& part) {
  const auto is = [&](const char* wanted, std::uint32_t wanted_size) { return name == wanted && size == wanted_size; };
  constexpr std::uint32_t kMaxKept = 1U << 20U;  // of a channel list or type
  if (is("dataWindow", 16)) {
    const auto bytes = walk.take(size);
    const auto side = [&](std::size_t i) { return load_little<std::int32_t>(&bytes[4 * i]); };
    part.data_window = {side(0), side(1), side(2), side(3)};
  } else if (is("compression", 1)) {
    part.compression = static_cast<std::uint8_t>(walk.take(1)[0]);
  } else if (is("tiles", 9)) {
    const auto bytes = walk.take(size);
    ByteReader reader(bytes);
    part.has_tiles = true;
    part.tile_width = reader.read<std::uint32_t>();
    part.tile_height = reader.read<std::uint32_t>();
  } else if (is("chunkCount", 4)) {
    part.chunk_count = static_cast<std::int32_t>(walk.take_u32());
  } else if (name == "channels" && size <= kMaxKept) {
    part.bytes_per_pixel = bytes_per_pixel(walk.take(size));
  } else if (name == "type" && size <= kMaxKept) {
    const auto bytes = walk.take(size);
    part.type.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  } else {
    walk.skip(size);
  }
}

/// Reads one header; nullopt at the empty one that ends the list of a multi-part file.
std::optional<PartHeader> take_header(HeaderWalk& walk) {
  PartHeader part;
  for (int count = 0; count < kMaxAttributes; ++count) {
    const std::string name = walk.take_name();
    if (name.empty()) return count == 0 ? std::nullopt : std::optional<PartHeader>(part);
    (void)walk.take_name();  // its type
    const std::uint32_t size = walk.take_u32();
    try {
      take_attribute(walk, name, size, part);
    } catch (const Error& error) {
      throw error.within(fmt::format("attribute \"{}\"", printable(name)));
    }
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("OpenEXR header has more than {} attributes", kMaxAttributes));
}

std::uint64_t divided_up(std::uint64_t value, std::uint64_t by) {
  return (value + by - 1) / by;
}

void check_part(const PartHeader& part, bool tiled_file, std::uint64_t file_size) {
  if (!part.data_window) throw Error(ErrorCode::kCorrupt, "OpenEXR header has no dataWindow");
  const Box& box = *part.data_window;
  const std::int64_t width = std::int64_t{box.max_x} - box.min_x + 1;
  const std::int64_t height = std::int64_t{box.max_y} - box.min_y + 1;
  if (width < 1 || height < 1) {
    throw Error(ErrorCode::kCorrupt, fmt::format("OpenEXR dataWindow ({}, {}) - ({}, {}) is empty", box.min_x,
                                                 box.min_y, box.max_x, box.max_y));
  }
  if (part.bytes_per_pixel == 0) throw Error(ErrorCode::kCorrupt, "OpenEXR header lists no channels");
  const bool deep = part.type.rfind("deep", 0) == 0;
  const bool tiled = part.type.empty() ? tiled_file : part.type == "tiledimage" || part.type == "deeptile";
  std::uint64_t chunk_width = static_cast<std::uint64_t>(width);
  std::uint64_t chunk_height = deep ? 1 : static_cast<std::uint64_t>(scan_lines_per_chunk(part.compression));
  if (tiled) {
    if (!part.has_tiles || part.tile_width == 0 || part.tile_height == 0) {
      throw Error(ErrorCode::kCorrupt, "OpenEXR tiled part has no tile size");
    }
    chunk_width = part.tile_width;
    chunk_height = part.tile_height;
  }
  // A chunk has 8 bytes in the table of offsets, and its own header: row and length (8), for a tile twice that.
  const std::uint64_t chunks = divided_up(static_cast<std::uint64_t>(width), chunk_width) *
                               divided_up(static_cast<std::uint64_t>(height), chunk_height);
  const std::uint64_t bytes_per_chunk = 8 + (tiled ? 20U : 8U);
  const auto stated = static_cast<std::uint64_t>(std::max(part.chunk_count, 0));
  if (std::max(chunks, stated) > file_size / 8 || chunks * bytes_per_chunk > file_size) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("OpenEXR header declares {} x {} pixels in {} chunks, for which a file "
                            "of {} bytes has no room",
                            width, height, std::max(chunks, stated), file_size));
  }
  const std::uint64_t lines =
      tiled ? chunk_height : std::min<std::uint64_t>(chunk_height, static_cast<std::uint64_t>(height));
  const std::uint64_t limit =
      std::min(std::max(kUnquestionedChunkBytes, file_size * kMaxCompressionRatio), kMaxExrChunkBytes);
  // Both sides fit in 32 bits: their product cannot overflow, its product with the pixel size might.
  if (chunk_width * lines > limit / part.bytes_per_pixel) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("OpenEXR chunks of {} x {} pixels with {} bytes each are larger than {} MiB, the most for a "
                    "file of {} bytes",
                    chunk_width, lines, part.bytes_per_pixel, limit >> 20U, file_size));
  }
}

}  // namespace

std::int64_t scan_lines_per_chunk(std::uint8_t compression) {
  switch (compression) {
    case 0:  // none
    case 1:  // RLE
    case 2:  // ZIPS
      return 1;
    case 3:  // ZIP
    case 5:  // PXR24
      return 16;
    case 4:  // PIZ
    case 6:  // B44
    case 7:  // B44A
    case 8:  // DWAA
      return 32;
    case 9:  // DWAB
      return 256;
    default:
      throw Error(ErrorCode::kUnsupported, fmt::format("OpenEXR compression {} is unknown", compression));
  }
}

bool looks_like_exr(std::span<const std::byte> head) {
  return head.size() >= kMagic.size() && std::memcmp(head.data(), kMagic.data(), kMagic.size()) == 0;
}

void check_exr_headers(const std::string& path) {
  HeaderWalk walk(path);
  walk.skip(kMagic.size());
  const std::uint32_t version = walk.take_u32();
  if ((version & kVersionMask) != 2) {
    throw Error(ErrorCode::kUnsupported, fmt::format("OpenEXR version {} is not 2", version & kVersionMask));
  }
  const bool tiled_file = (version & kTiledFlag) != 0;
  if ((version & kMultiPartFlag) == 0) {
    const auto part = take_header(walk);
    if (!part) throw Error(ErrorCode::kCorrupt, "OpenEXR header is empty");
    check_part(*part, tiled_file, walk.file_size());
    return;
  }
  while (const auto part = take_header(walk)) check_part(*part, false, walk.file_size());
}

}  // namespace isohf
