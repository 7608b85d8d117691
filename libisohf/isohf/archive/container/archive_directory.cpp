#include "isohf/archive/container/archive_directory.h"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/memory/read_ahead.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::string_view kTileFolder = "tiles/";
constexpr std::string_view kPlaneFolder = "planes/";

/// Of the entry that stands at a byte of the directory.
ZipEntry entry_at(const ByteSource& file, const ZipEnd& end, std::uint64_t offset) {
  ZipEnd rest = end;
  rest.directory_bytes -= offset - end.directory_offset;
  rest.directory_offset = offset;
  return *ZipEntries(file, rest).next();
}

}  // namespace

std::string why_bad_tile(const ZipEntry& entry, std::span<const TileGrid> grids) {
  const auto tile = tile_from_name(entry.name);
  if (!tile) return "has no tile's name, tiles/ROW/COLUMN.tile or planes/PLANE/ROW/COLUMN.tile";
  const auto plane = static_cast<std::size_t>(tile->plane);
  if (plane >= grids.size()) return fmt::format("is of plane {}, and there are {}", plane, grids.size());
  const TileGrid& grid = grids[plane];
  if (!grid.contains(tile->tile))
    return fmt::format("lies outside the grid of {}x{} tiles", grid.tile_columns(), grid.tile_rows());
  if (entry.bytes == 0) return "is empty";
  if (entry.bytes > 0xffffffffU || entry.compressed_bytes > 0xffffffffU) return "is larger than any tile";
  return {};
}

std::string tile_name(TileIndex tile, int plane) {
  return plane == 0 ? fmt::format(FMT_COMPILE("tiles/{}/{}.tile"), tile.row, tile.column)
                    : fmt::format(FMT_COMPILE("planes/{}/{}/{}.tile"), plane, tile.row, tile.column);
}

std::optional<PlaneTile> tile_from_name(std::string_view name) {
  PlaneTile found;
  const char* at = name.data();
  const char* const end = name.data() + name.size();
  const auto take = [&](auto& value) {
    const auto [behind, error] = std::from_chars(at, end, value);
    at = behind;
    return error == std::errc{} && value >= 0;
  };
  if (name.starts_with(kTileFolder)) {
    at += kTileFolder.size();
  } else if (name.starts_with(kPlaneFolder)) {
    at += kPlaneFolder.size();
    if (!take(found.plane) || found.plane == 0 || at == end) return std::nullopt;
    ++at;
  } else {
    return std::nullopt;
  }
  if (!take(found.tile.row) || at == end) return std::nullopt;
  ++at;
  if (!take(found.tile.column)) return std::nullopt;
  if (tile_name(found.tile, found.plane) != name) return std::nullopt;  // leading zeros, another ending
  return found;
}

bool is_in_tile_folder(std::string_view name) {
  return name.starts_with(kTileFolder) || name.starts_with(kPlaneFolder);
}

std::vector<TileGrid> plane_grids(const Metadata& metadata) {
  std::vector<TileGrid> grids;
  for (int plane = 0; plane <= metadata.planes.count; ++plane) grids.push_back(metadata.plane_grid(plane));
  return grids;
}

std::string why_bad_name(std::string_view name) {
  if (name.empty()) return "it is empty";
  if (name.size() > 65535) return "it is longer than 65535 bytes";
  if (name.front() == '/') return "it is absolute";
  if (name.back() == '/') return "it is a folder's";
  for (const char c : name) {
    if (c == '\\' || c == ':') return fmt::format("it holds '{}'", c);
    if (static_cast<unsigned char>(c) < 32 || c == 127) return "it holds a control character";
  }
  for (std::size_t start = 0; start <= name.size();) {
    const std::size_t end = std::min(name.find('/', start), name.size());
    const std::string_view part = name.substr(start, end - start);
    if (part.empty() || part == "." || part == "..") return fmt::format("it holds the part \"{}\"", part);
    start = end + 1;
  }
  return {};
}

std::string describe(const ZipEntry& entry) {
  return fmt::format("member \"{}\" at byte {}", entry.name, entry.header_offset);
}

ZipEnd find_archive_end(const ByteSource& file) {
  const auto end = find_zip_end(file);
  if (!end || end->end_offset != file.size_bytes()) {
    throw Error(
        ErrorCode::kCorrupt,
        fmt::format("is no isohf archive, or is cut off: no ZIP end record in its {} bytes", file.size_bytes()));
  }
  if (end->directory_offset + end->directory_bytes != end->records_offset) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("at byte {}: {} bytes of directory at byte {} do not end where the end records begin",
                            end->records_offset, end->directory_bytes, end->directory_offset));
  }
  return *end;
}

std::uint64_t checked_data_offset(const ByteSource& file, const ZipEntry& entry) {
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorCode::kCorrupt, {fmt::format("at byte {}", entry.header_offset),
                                      fmt::format("member \"{}\": {}", entry.name, why), "", ""});
  };
  const auto [local, sizes_follow, data_offset] = read_local_header(file, entry);
  if (local.method != entry.method) {
    fail(fmt::format("its local header says method {}, the directory {}", static_cast<int>(local.method),
                     static_cast<int>(entry.method)));
  }
  if (local.name != entry.name) fail("its local header has another name than the directory");
  // Archivers that write a stream leave the local sizes out; isohf never does.
  if (!sizes_follow &&
      (local.crc32 != entry.crc32 || local.compressed_bytes != entry.compressed_bytes || local.bytes != entry.bytes)) {
    fail(fmt::format("its local header states {} of {} bytes and CRC {:08x}, the directory {} of {} and {:08x}",
                     local.compressed_bytes, local.bytes, local.crc32, entry.compressed_bytes, entry.bytes,
                     entry.crc32));
  }
  return data_offset;
}

void MemberPlaces::add(const ZipEntry& entry, std::uint64_t data_offset) {
  places_.push_back({std::hash<std::string>()(entry.name), entry.header_offset, data_offset + entry.compressed_bytes,
                     entry.entry_offset});
}

void MemberPlaces::check(const ByteSource& file, const ZipEnd& end, const Complain& complain) {
  const auto entry_of = [&](const Place& place) { return entry_at(file, end, place.entry_offset); };
  std::ranges::sort(places_, {}, [](const Place& place) { return std::pair(place.begin, place.end); });
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& place = places_[i];
    if (place.end > end.directory_offset) {
      complain(
          fmt::format("{} reaches into the directory at byte {}", describe(entry_of(place)), end.directory_offset));
    }
    if (i > 0 && places_[i - 1].end > place.begin) {
      complain(fmt::format("{} overlaps \"{}\", which ends at byte {}", describe(entry_of(place)),
                           entry_of(places_[i - 1]).name, places_[i - 1].end));
    }
  }
  std::ranges::sort(places_, {}, [](const Place& place) { return std::pair(place.name_hash, place.entry_offset); });
  for (std::size_t i = 1; i < places_.size(); ++i) {
    if (places_[i].name_hash != places_[i - 1].name_hash) continue;
    const ZipEntry first = entry_of(places_[i - 1]);
    const ZipEntry second = entry_of(places_[i]);
    if (first.name != second.name) continue;
    complain(fmt::format("member \"{}\" is there twice, at bytes {} and {}", first.name, first.header_offset,
                         second.header_offset));
  }
}

bool is_folder(const ZipEntry& entry) {
  return entry.name.size() > 1 && entry.name.back() == '/' && entry.bytes == 0;
}

std::optional<std::uint64_t> check_entry(const ByteSource& file, const ZipEntry& entry, const Complain& complain) {
  const std::string_view name = std::string_view(entry.name).substr(0, entry.name.size() - (is_folder(entry) ? 1 : 0));
  if (const std::string why = why_bad_name(name); !why.empty()) {
    complain(fmt::format("{}: its name is not allowed: {}", describe(entry), why));
    return std::nullopt;
  }
  try {
    return checked_data_offset(file, entry);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kIo) throw;
    complain(error.what());
    return std::nullopt;
  }
}

void for_each_member(const ByteSource& file, const ZipEnd& end, Tiles tiles,
                     const std::function<void(const ZipEntry& entry, std::uint64_t data_offset)>& visit) {
  const Complain refuse = [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); };
  MemberPlaces places;
  ZipEntry entry;
  for (ZipEntries entries(file, end); entries.read(entry);) {
    if (tiles == Tiles::kPassedBy && is_in_tile_folder(entry.name)) continue;
    const std::uint64_t data_offset = *check_entry(file, entry, refuse);
    places.add(entry, data_offset);
    if (!is_folder(entry)) visit(entry, data_offset);
  }
  places.check(file, end, refuse);
}

OwnEntries find_own_entries(const ByteSource& file, const ZipEnd& end) {
  OwnEntries found;
  const auto entry_at_end = [&](std::uint64_t behind, std::string_view name) -> std::optional<ZipEntry> {
    for (const std::uint64_t extra : {0U, 12U, 20U, 28U}) {
      const std::uint64_t bytes = 46 + name.size() + extra;
      if (bytes > behind) break;
      const ZipEnd one{1, end.directory_offset + behind - bytes, bytes, 0, 0};
      try {
        ZipEntries entries(file, one);
        if (auto entry = entries.next(); entry->name == name && !entries.next()) return entry;
      } catch (const Error& error) {
        if (error.code() != ErrorCode::kCorrupt) throw;
      }
    }
    return std::nullopt;
  };
  if (auto metadata = entry_at_end(end.directory_bytes, kMetadataName)) {
    found.index = entry_at_end(metadata->entry_offset - end.directory_offset, kIndexName);
    found.metadata = *std::move(metadata);
    found.are_last = found.index.has_value();
    if (found.are_last) return found;
  }
  bool has_metadata = false;
  for (ZipEntries all(file, end); const auto entry = all.next();) {
    if (entry->name == kIndexName) found.index = *entry;
    if (entry->name != kMetadataName || has_metadata) continue;
    found.metadata = *entry;
    has_metadata = true;
  }
  if (!has_metadata) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("is a ZIP file, but no isohf archive: it has no member \"{}\"", kMetadataName));
  }
  return found;
}

namespace {

/// CRC-32 of a range, read in pieces.
std::uint32_t crc32_in(const ByteSource& file, std::uint64_t offset_bytes, std::uint64_t size_bytes) {
  std::vector<std::byte> piece(std::min(size_bytes, std::uint64_t{1} << 20U));
  std::uint32_t crc = 0;
  for (std::uint64_t done = 0; done < size_bytes; done += piece.size()) {
    piece.resize(std::min<std::uint64_t>(piece.size(), size_bytes - done));
    read_exactly(file, offset_bytes + done, piece);
    crc = crc32(piece, crc);
  }
  return crc;
}

}  // namespace

std::uint32_t data_crc32(const ByteSource& file, const std::string& name) try {
  std::uint32_t all = 0;
  ReadAhead ahead;  // members follow one another
  ZipEntry entry;
  std::vector<std::byte> header;
  for (ZipEntries entries(file, find_archive_end(file)); entries.read(entry);) {
    if (entry.name == kIndexName) break;
    if (entry.name == kMetadataName) continue;
    // Mostly it stands there as isohf writes it.
    header.clear();
    append_local_header(entry, header);
    const std::uint64_t bytes = header.size() + entry.compressed_bytes;
    std::span<const std::byte> stored;
    if (bytes <= ReadAhead::kPieceBytes && entry.header_offset + bytes <= file.size_bytes())
      stored = ahead.bytes(file, entry.header_offset, bytes);
    const bool is_known = !stored.empty() && std::equal(header.begin(), header.end(), stored.begin());
    all = crc32_of_crc32(is_known ? crc32(stored.subspan(header.size()))
                                  : crc32_in(file, checked_data_offset(file, entry), entry.compressed_bytes),
                         all);
  }
  return all;
} catch (const Error& error) {
  throw error.within(name);
}

std::vector<std::byte> member_from(const ByteSource& file, const ZipEntry& entry, std::uint64_t data_offset) {
  return member_from(SourceBytes(file, data_offset, entry.compressed_bytes).bytes(), entry);
}

std::vector<std::byte> member_from(std::span<const std::byte> data, const ZipEntry& entry) {
  std::vector<std::byte> bytes;
  if (entry.method == ZipMethod::kStored) {
    if (entry.bytes != entry.compressed_bytes) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: is stored, but states {} bytes of {}", describe(entry),
                                                   entry.compressed_bytes, entry.bytes));
    }
    bytes.assign(data.begin(), data.end());
  } else if (entry.method == ZipMethod::kDeflated) {
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
                {describe(entry),
                 fmt::format("compression method {}, only 0 and 8 are read", static_cast<int>(entry.method)), "", ""});
  }
  if (const std::uint32_t found = crc32(bytes); found != entry.crc32) {
    throw Error(ErrorCode::kCorrupt,
                {describe(entry), fmt::format("its CRC-32 is {:08x}, {:08x} is stated", found, entry.crc32), "", ""});
  }
  return bytes;
}

void check_member(const ByteSource& file, const ZipEntry& entry, std::uint64_t data_offset) {
  // A deflated member may claim a thousand times the bytes that it has, and a stored one may be large.
  constexpr std::uint64_t kAtOnceBytes = std::uint64_t{1} << 20U;
  const bool is_deflated = entry.method == ZipMethod::kDeflated;
  if (entry.bytes <= kAtOnceBytes || (!is_deflated && entry.method != ZipMethod::kStored)) {
    static_cast<void>(member_from(file, entry, data_offset));
    return;
  }
  std::uint32_t crc = 0;
  std::uint64_t bytes = 0;
  bool is_whole = true;
  if (is_deflated) {
    const SourceBytes data(file, data_offset, entry.compressed_bytes);
    is_whole = inflate_in_pieces(data.bytes(), [&](std::span<const std::byte> piece) {
      crc = crc32(piece, crc);
      bytes += piece.size();
      return bytes <= entry.bytes;
    });
  } else {
    bytes = entry.compressed_bytes;
    crc = crc32_in(file, data_offset, bytes);
  }
  if (is_whole && bytes == entry.bytes && crc == entry.crc32) return;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: has no data of {} bytes and the CRC-32 {:08x}", describe(entry),
                                               entry.bytes, entry.crc32));
}

}  // namespace isohf
