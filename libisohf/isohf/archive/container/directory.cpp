#include "isohf/archive/container/directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::string_view kTileFolder = "tiles/";

/// A member's bytes in the file, local header included.
struct Extent {
  std::uint64_t begin;
  std::uint64_t end;
  std::string_view name;
};

/// Sorts by place and complains where two members share bytes.
void check_overlaps(std::vector<Extent>& extents, std::uint64_t limit, const Complain& complain) {
  std::sort(extents.begin(), extents.end(),
            [](const Extent& a, const Extent& b) { return a.begin != b.begin ? a.begin < b.begin : a.end < b.end; });
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const Extent& extent = extents[i];
    if (extent.end > limit) {
      complain(fmt::format("member \"{}\" at byte {} reaches into the directory at byte {}", extent.name, extent.begin,
                           limit));
    }
    if (i > 0 && extents[i - 1].end > extent.begin) {
      complain(fmt::format("member \"{}\" at byte {} overlaps \"{}\", which ends at byte {}", extent.name, extent.begin,
                           extents[i - 1].name, extents[i - 1].end));
    }
  }
}

void check_duplicates(std::vector<Extent> extents, const Complain& complain) {
  std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) { return a.name < b.name; });
  for (std::size_t i = 1; i < extents.size(); ++i) {
    if (extents[i].name != extents[i - 1].name) continue;
    complain(fmt::format("member \"{}\" is there twice, at bytes {} and {}", extents[i].name, extents[i - 1].begin,
                         extents[i].begin));
  }
}

/// Why a tile's entry cannot be a tile, one clause; empty where it can.
std::string why_bad_tile(const ZipEntry& entry, const TileGrid& grid) {
  const auto tile = tile_from_name(entry.name);
  if (!tile) return "has no tile's name, tiles/ROW/COLUMN.tile";
  if (!grid.contains(*tile)) {
    return fmt::format("lies outside the grid of {}x{} tiles", grid.tile_columns(), grid.tile_rows());
  }
  if (entry.bytes == 0) return "is empty";
  if (entry.bytes > 0xffffffffU || entry.compressed_bytes > 0xffffffffU) return "is larger than any tile";
  return {};
}

}  // namespace

std::string describe(const ZipEntry& entry) {
  return fmt::format("member \"{}\" at byte {}", entry.name, entry.header_offset);
}

Directory read_directory(std::span<const std::byte> file, const ZipEnd& end, const std::optional<TileGrid>& grid,
                         const Complain& complain) {
  Directory directory;
  std::vector<Extent> extents;
  for_each_entry(file, end, [&](const ZipEntry& entry) {
    if (!grid && entry.name.substr(0, kTileFolder.size()) == kTileFolder) return;
    // Archivers put in entries for folders; they hold nothing.
    const bool is_folder = entry.name.size() > 1 && entry.name.back() == '/' && entry.bytes == 0;
    const std::string_view name = is_folder ? entry.name.substr(0, entry.name.size() - 1) : entry.name;
    if (const std::string why = why_bad_name(name); !why.empty()) {
      complain(fmt::format("{}: its name is not allowed: {}", describe(entry), why));
      return;
    }
    std::uint64_t data_offset = 0;
    try {
      data_offset = checked_data_offset(file, entry);
    } catch (const Error& error) {
      complain(error.what());
      return;
    }
    extents.push_back({entry.header_offset, data_offset + entry.compressed_bytes, entry.name});
    if (is_folder) return;
    if (entry.name.substr(0, kTileFolder.size()) != kTileFolder) {
      directory.members.push_back({entry, data_offset});
    } else if (const std::string why = why_bad_tile(entry, *grid); !why.empty()) {
      complain(fmt::format("{}: {}", describe(entry), why));
    } else {
      directory.tiles.push_back({grid->flat_index(*tile_from_name(entry.name)), entry, data_offset});
    }
  });
  check_overlaps(extents, end.directory_offset, complain);
  if (!extents.empty()) directory.data_end = extents.back().end;
  check_duplicates(std::move(extents), complain);
  std::sort(directory.tiles.begin(), directory.tiles.end(),
            [](const auto& a, const auto& b) { return a.flat < b.flat; });
  std::sort(directory.members.begin(), directory.members.end(),
            [](const auto& a, const auto& b) { return a.data_offset < b.data_offset; });
  return directory;
}

void check_profile(std::span<const std::byte> file, const ZipEnd& end, const Complain& complain) {
  std::uint64_t offset = 0;
  std::uint64_t entries = 0;
  for_each_entry(file, end, [&](const ZipEntry& entry) {
    const ZipMember member{
        std::string(entry.name), static_cast<ZipMethod>(entry.method), entry.crc32, entry.compressed_bytes, entry.bytes,
        entry.header_offset};
    std::vector<std::byte> ours;
    append_directory_entry(member, ours);
    const auto theirs =
        file.subspan(entry.entry_offset, std::min<std::uint64_t>(ours.size(), file.size() - entry.entry_offset));
    if (!std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end())) {
      complain(fmt::format("{}: its directory entry at byte {} is not as the profile has it", describe(entry),
                           entry.entry_offset));
    }
    if (entry.header_offset != offset) {
      complain(fmt::format("{}: the member before it ends at byte {}", describe(entry), offset));
    }
    if (entries == 0 && entry.name != kMetadataName)
      complain(fmt::format("{}: is first, where the metadata belong", describe(entry)));
    if (entries + 1 == end.entries && entry.name != kIndexName)
      complain(fmt::format("{}: is last, where the index belongs", describe(entry)));
    ours.clear();
    append_local_header(member, ours);
    const auto local = file.subspan(std::min<std::uint64_t>(entry.header_offset, file.size()));
    if (local.size() < ours.size() || !std::equal(ours.begin(), ours.end(), local.begin())) {
      complain(fmt::format("{}: its local header is not as the profile has it", describe(entry)));
    }
    offset = entry.header_offset + ours.size() + entry.compressed_bytes;
    ++entries;
  });
  std::vector<std::byte> records;
  append_end_records(end.entries, end.directory_offset, end.directory_bytes, records);
  const auto found = file.subspan(end.records_offset);
  if (!std::equal(records.begin(), records.end(), found.begin(), found.end())) {
    complain(fmt::format("the end records at byte {} are not as the profile has them", end.records_offset));
  }
  if (offset != end.directory_offset) {
    complain(
        fmt::format("the directory begins at byte {}, the last member ends at byte {}", end.directory_offset, offset));
  }
}

std::uint32_t data_crc32(const MappedFile& file, const ZipEnd& end) {
  std::uint32_t all = 0;
  std::vector<std::byte> data;
  for_each_entry(file.bytes(), end, [&](const ZipEntry& entry) {
    if (entry.name == kMetadataName || entry.name == kIndexName) return;
    std::uint64_t at = checked_data_offset(file.bytes(), entry);
    std::uint32_t crc = 0;
    for (std::uint64_t left = entry.compressed_bytes; left > 0; left -= data.size()) {
      data.resize(std::min<std::uint64_t>(left, std::uint64_t{1} << 20U));
      file.read(at, data);
      crc = crc32(data, crc);
      at += data.size();
    }
    all = crc32_of_crc32(crc, all);
  });
  return all;
}

std::vector<std::byte> member_from(const MappedFile& file, const ZipEntry& entry, std::uint64_t data_offset) {
  std::vector<std::byte> data(entry.compressed_bytes);
  file.read(data_offset, data);
  std::vector<std::byte> bytes;
  if (entry.method == static_cast<std::uint16_t>(ZipMethod::kStored)) {
    if (entry.bytes != entry.compressed_bytes) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: is stored, but states {} bytes of {}", describe(entry),
                                                   entry.compressed_bytes, entry.bytes));
    }
    bytes = std::move(data);
  } else if (entry.method == static_cast<std::uint16_t>(ZipMethod::kDeflated)) {
    // Deflate makes at most 1032 bytes of one: a larger claim is not worth the memory.
    if (entry.bytes / 1032 > entry.compressed_bytes) {
      throw Error(
          ErrorCode::kCorrupt,
          {describe(entry),
           fmt::format("states {} bytes, which {} cannot inflate to", entry.bytes, entry.compressed_bytes), "", ""});
    }
    bytes.resize(entry.bytes);
    try {
      inflate_exactly(data, bytes);
    } catch (const Error& error) {
      throw error.within(describe(entry));
    }
  } else {
    throw Error(ErrorCode::kUnsupported,
                {describe(entry), fmt::format("compression method {}, only 0 and 8 are read", entry.method), "", ""});
  }
  if (const std::uint32_t found = crc32(bytes); found != entry.crc32) {
    throw Error(ErrorCode::kCorrupt,
                {describe(entry), fmt::format("its CRC-32 is {:08x}, {:08x} is stated", found, entry.crc32), "", ""});
  }
  return bytes;
}

}  // namespace isohf
