#include "isohf/verify/plane_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/archive_index.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/error.h"
#include "isohf/verify.h"

namespace isohf {
namespace {

/// What an index says of codes.
EncodedTile described_as_stored(const TileCodes& codes) {
  EncodedTile tile;
  tile.content_digest = tile_content_digest(codes);
  std::int64_t voids = 0;
  const auto void_code = codes.type == CodeType::kF32 ? 0 : Quantisation{codes.type, 0.0, 1.0}.void_code();
  for (const std::uint16_t code : codes.codes) voids += code == void_code ? 1 : 0;
  for (const float height : codes.heights) voids += height != height ? 1 : 0;
  tile.has_voids = voids > 0;
  tile.is_empty = voids == static_cast<std::int64_t>(codes.codes.size() + codes.heights.size());
  return tile;
}

}  // namespace

PlaneCheck::PlaneCheck(const ArchiveReader& archive, const ScratchFolder& scratch)
    : archive_(archive),
      builder_(
          planes_of(archive.metadata()), archive.metadata().quantisation.type, described_as_stored,
          [this](int plane, TileIndex tile, const EncodedTile& expected) { check(plane, tile, expected); }, scratch) {}

void PlaneCheck::add(const TileCodes* codes, std::uint32_t code_min, std::uint32_t code_max) {
  builder_.add(codes == nullptr ? PlaneSample() : builder_.sample(*codes, code_min, code_max));
}

void PlaneCheck::check(int plane, TileIndex tile, const EncodedTile& expected) {
  const std::string where = fmt::format("plane {} tile ({},{})", plane, tile.column, tile.row);
  const auto add = [&](int id, const std::string& what) { problems_.emplace_back(id, where + " " + what); };
  TileEntry entry;
  TileCodes codes;
  try {
    entry = archive_.tile_entry(tile, plane);
    if (entry.stored) codes = archive_.read_tile(tile, plane);
  } catch (const Error& error) {
    problems_.emplace_back(finding::kTileUndecodable, error.what());
    return;
  }
  if (!entry.stored || expected.is_empty) {
    if (entry.stored) add(finding::kPlane, "is stored, where the tiles below have no elevation for it");
    if (!expected.is_empty) add(finding::kPlane, "is missing");
    return;
  }
  if (tile_content_digest(codes) != expected.content_digest) {
    add(finding::kPlane, "holds other elevations than the tiles below");
  }
  if (archive_.reads_by_directory() && has_unknown_range(archive_.metadata().quantisation, entry)) return;
  if (entry.code_min != expected.code_min || entry.code_max != expected.code_max) {
    add(finding::kPlaneRange, fmt::format("stands for codes from {:#x} to {:#x}, the index says {:#x} to {:#x}",
                                          expected.code_min, expected.code_max, entry.code_min, entry.code_max));
  }
  if (entry.has_voids != expected.has_voids) {
    add(finding::kTileVoidFlag,
        expected.has_voids ? "has voids, the index says none" : "has no voids, the index says some");
  }
}

}  // namespace isohf
