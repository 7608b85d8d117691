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

/// An entry and where its bytes lie in the file, local header included.
struct Placed {
  ZipEntry entry;
  std::uint64_t data_offset;
  bool is_folder;

  [[nodiscard]] std::uint64_t begin() const { return entry.header_offset; }
  [[nodiscard]] std::uint64_t end() const { return data_offset + entry.compressed_bytes; }
};

/// Complains where two members share bytes or reach into the directory at byte `limit`.
void check_overlaps(const std::vector<Placed>& all, std::uint64_t limit, const Complain& complain) {
  std::vector<const Placed*> sorted;
  for (const Placed& placed : all) sorted.push_back(&placed);
  std::sort(sorted.begin(), sorted.end(), [](const Placed* a, const Placed* b) {
    return a->begin() != b->begin() ? a->begin() < b->begin() : a->end() < b->end();
  });
  const Placed* before = nullptr;
  for (const Placed* const placed : sorted) {
    if (placed->end() > limit)
      complain(fmt::format("{} reaches into the directory at byte {}", describe(placed->entry), limit));
    if (before != nullptr && before->end() > placed->begin()) {
      complain(fmt::format("{} overlaps \"{}\", which ends at byte {}", describe(placed->entry), before->entry.name,
                           before->end()));
    }
    before = placed;
  }
}

void check_duplicates(const std::vector<Placed>& all, const Complain& complain) {
  std::vector<const ZipEntry*> sorted;
  for (const Placed& placed : all) sorted.push_back(&placed.entry);
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) { return a->name < b->name; });
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i]->name != sorted[i - 1]->name) continue;
    complain(fmt::format("member \"{}\" is there twice, at bytes {} and {}", sorted[i]->name,
                         sorted[i - 1]->header_offset, sorted[i]->header_offset));
  }
}

/// Why a tile's entry cannot be a tile, one clause; empty where it can.
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

}  // namespace

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

ArchiveDirectory read_directory(const ByteSource& file, const ZipEnd& end, std::span<const TileGrid> grids,
                                const Complain& complain) {
  std::vector<Placed> all;
  for (ZipEntries entries(file, end); auto entry = entries.next();) {
    if (grids.empty() && is_in_tile_folder(entry->name)) continue;
    // Archivers put in entries for folders; they hold nothing.
    const bool is_folder = entry->name.size() > 1 && entry->name.back() == '/' && entry->bytes == 0;
    const std::string_view name = std::string_view(entry->name).substr(0, entry->name.size() - (is_folder ? 1 : 0));
    if (const std::string why = why_bad_name(name); !why.empty()) {
      complain(fmt::format("{}: its name is not allowed: {}", describe(*entry), why));
      continue;
    }
    try {
      const std::uint64_t data_offset = checked_data_offset(file, *entry);
      all.push_back({std::move(*entry), data_offset, is_folder});
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kIo) throw;
      complain(error.what());
    }
  }
  check_overlaps(all, end.directory_offset, complain);
  check_duplicates(all, complain);
  ArchiveDirectory directory;
  for (Placed& placed : all) {
    if (placed.is_folder) continue;
    if (!is_in_tile_folder(placed.entry.name)) {
      directory.members.push_back({std::move(placed.entry), placed.data_offset});
    } else if (const std::string why = why_bad_tile(placed.entry, grids); !why.empty()) {
      complain(fmt::format("{}: {}", describe(placed.entry), why));
    } else {
      const PlaneTile tile = *tile_from_name(placed.entry.name);
      const std::int64_t flat = grids[static_cast<std::size_t>(tile.plane)].flat_index(tile.tile);
      directory.tiles.push_back({tile.plane, flat, std::move(placed.entry), placed.data_offset});
    }
  }
  std::sort(directory.tiles.begin(), directory.tiles.end(),
            [](const auto& a, const auto& b) { return a.plane != b.plane ? a.plane < b.plane : a.flat < b.flat; });
  std::sort(directory.members.begin(), directory.members.end(),
            [](const auto& a, const auto& b) { return a.data_offset < b.data_offset; });
  return directory;
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

void check_profile(const ByteSource& file, const ZipEnd& end, const Complain& complain) {
  std::vector<std::byte> ours;
  const auto stands_at = [&](std::uint64_t offset) {
    if (offset > file.size_bytes() || ours.size() > file.size_bytes() - offset) return false;
    const SourceBytes theirs(file, offset, ours.size());
    return std::equal(ours.begin(), ours.end(), theirs.bytes().begin());
  };
  const std::uint32_t media_type_crc = crc32(std::as_bytes(std::span(kMediaType)));
  const std::array<std::pair<std::uint64_t, std::string_view>, 3> places = {
      {{0, kMediaTypeName}, {end.entries - 2, kIndexName}, {end.entries - 1, kMetadataName}}};
  std::uint64_t offset = 0;
  std::uint64_t entries = 0;
  for (ZipEntries all(file, end); const auto entry = all.next(); ++entries) {
    ours.clear();
    append_directory_entry(*entry, ours);
    if (!stands_at(entry->entry_offset)) {
      complain(fmt::format("{}: its directory entry at byte {} is not as the profile has it", describe(*entry),
                           entry->entry_offset));
    }
    if (entry->header_offset != offset)
      complain(fmt::format("{}: the member before it ends at byte {}", describe(*entry), offset));
    for (const auto& [place, name] : places) {
      if (entries == place && entry->name != name)
        complain(fmt::format("{}: stands where \"{}\" belongs", describe(*entry), name));
    }
    if (entry->name == kMediaTypeName && (entry->method != ZipMethod::kStored || entry->crc32 != media_type_crc))
      complain(fmt::format("{}: must hold \"{}\", stored", describe(*entry), kMediaType));
    ours.clear();
    append_local_header(*entry, ours);
    if (!stands_at(entry->header_offset))
      complain(fmt::format("{}: its local header is not as the profile has it", describe(*entry)));
    offset = entry->header_offset + ours.size() + entry->compressed_bytes;
  }
  ours.clear();
  append_end_records(end.entries, end.directory_offset, end.directory_bytes, ours);
  if (ours.size() != file.size_bytes() - end.records_offset || !stands_at(end.records_offset))
    complain(fmt::format("the end records at byte {} are not as the profile has them", end.records_offset));
  if (offset != end.directory_offset) {
    complain(
        fmt::format("the directory begins at byte {}, the last member ends at byte {}", end.directory_offset, offset));
  }
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
  if (entry.method != ZipMethod::kDeflated || entry.bytes <= kInflatedAtOnceBytes) {
    static_cast<void>(member_from(file, entry, data_offset));
    return;
  }
  const SourceBytes data(file, data_offset, entry.compressed_bytes);
  std::uint32_t crc = 0;
  std::uint64_t bytes = 0;
  const bool is_stream = inflate_in_pieces(data.bytes(), [&](std::span<const std::byte> piece) {
    crc = crc32(piece, crc);
    bytes += piece.size();
    return bytes <= entry.bytes;
  });
  if (is_stream && bytes == entry.bytes && crc == entry.crc32) return;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: does not inflate to {} bytes of the CRC-32 {:08x}", describe(entry),
                                               entry.bytes, entry.crc32));
}

}  // namespace isohf
