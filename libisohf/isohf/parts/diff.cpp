#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/base/handed_in.h"
#include "isohf/error.h"
#include "isohf/parts/parts.h"

namespace isohf {
namespace {

constexpr std::size_t kMostListed = 1000;
constexpr std::int64_t kBatch = 256;  ///< tiles that are looked at side by side

std::vector<ArchiveDifference::Member> differing_members(const ArchiveReader& first, const ArchiveReader& second) {
  const auto members = [](const ArchiveReader& archive) {
    nlohmann::json all = nlohmann::json::parse(archive.metadata_json()).flatten();
    for (const MemberEntry& member : archive.loose_members()) {
      if (member.name == kMediaTypeName || member.name == kIndexName || member.name == kMetadataName) continue;
      all[fmt::format("member \"{}\"", member.name)] = {{"bytes", member.bytes}, {"crc32", member.crc32}};
    }
    return all;
  };
  const nlohmann::json a = members(first);
  const nlohmann::json b = members(second);
  std::set<std::string> names;
  for (const nlohmann::json& side : {a, b}) {
    for (const auto& [name, value] : side.items()) names.insert(name);
  }
  std::vector<ArchiveDifference::Member> found;
  for (const std::string& name : names) {
    const auto text = [&](const nlohmann::json& side) { return side.contains(name) ? side.at(name).dump() : ""; };
    if (text(a) != text(b)) found.push_back({name, text(a), text(b)});
  }
  return found;
}

/// Stated, or found by decoding where nothing is stated.
Digest tile_digest(const ArchiveReader& archive, TileIndex tile) {
  if (const auto stated = archive.tile_digest(tile)) return *stated;
  return tile_content_digest(archive.read_tile(tile));
}

/// If equal codes are equal elevations, so that digests of codes tell tiles apart.
bool code_alike(const Metadata& a, const Metadata& b) {
  return a.quantisation.type == b.quantisation.type && a.quantisation.offset == b.quantisation.offset &&
         a.quantisation.scale == b.quantisation.scale;
}

bool have_same_elevations(const ArchiveReader& a, const ArchiveReader& b, TileIndex tile) {
  const std::vector<double> first = a.read_elevations(tile);
  const std::vector<double> second = b.read_elevations(tile);
  return std::equal(first.begin(), first.end(), second.begin(),
                    [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

/// What differs between two tiles, added up.
struct Sums {
  std::int64_t compared = 0;
  std::int64_t voids = 0;
  double sum = 0.0;
  double squares = 0.0;
  double max = 0.0;

  void add(const std::vector<double>& a, const std::vector<double>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const bool is_void = std::isnan(a[i]);
      if (is_void != std::isnan(b[i])) ++voids;
      if (is_void || std::isnan(b[i])) continue;
      const double difference = b[i] - a[i];
      ++compared;
      sum += difference;
      squares += difference * difference;
      max = std::max(max, std::abs(difference));
    }
  }
};

}  // namespace

ArchiveDifference diff_archives(const std::string& first, const std::string& second, bool surface, const Job& job) {
  const ArchiveReader a(first);
  const ArchiveReader b(second);
  ArchiveDifference found;
  found.metadata = differing_members(a, b);
  found.why_other_lattice = why_other_vertices(a.metadata(), b.metadata());
  if (!found.why_other_lattice.empty()) return found;
  Sums all;
  TileIndex worst{};
  const std::int64_t tiles = a.grid().tile_count();
  const bool by_digest = code_alike(a.metadata(), b.metadata());
  const auto are_same = [&](TileIndex tile) {
    return by_digest ? tile_digest(a, tile) == tile_digest(b, tile) : have_same_elevations(a, b, tile);
  };
  Arena(job).execute([&] {
    for (std::int64_t at = 0; at < tiles; at += kBatch) {
      job.throw_if_cancelled();
      enum class State { kSame, kDiffers, kOnlyFirst, kOnlySecond };
      std::vector<State> states(static_cast<std::size_t>(std::min(kBatch, tiles - at)));
      std::vector<Sums> sums(states.size());
      const auto tile_at = [&](std::size_t i) { return a.grid().tile_at(at + static_cast<std::int64_t>(i)); };
      oneapi::tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t i) {
        const TileIndex tile = tile_at(i);
        const bool in_a = a.tile_entry(tile).stored;
        const bool in_b = b.tile_entry(tile).stored;
        if (!in_a && !in_b) return;
        if (in_a != in_b) states[i] = in_a ? State::kOnlyFirst : State::kOnlySecond;
        if (in_a && in_b && !are_same(tile)) states[i] = State::kDiffers;
        if (surface && states[i] != State::kSame) sums[i].add(a.read_elevations(tile), b.read_elevations(tile));
      });
      for (std::size_t i = 0; i < states.size(); ++i) {
        if (states[i] == State::kSame) {
          ++found.tiles_same;
          continue;
        }
        const TileIndex tile = tile_at(i);
        const TileRange alone{tile, {tile.column + 1, tile.row + 1}};
        found.bounds = found.tiles_differing++ == 0 ? alone : around(found.bounds, alone);
        found.only_first += states[i] == State::kOnlyFirst ? 1 : 0;
        found.only_second += states[i] == State::kOnlySecond ? 1 : 0;
        if (found.first_few.size() < kMostListed) found.first_few.push_back(tile);
        if (sums[i].max > all.max) worst = tile;
        all.compared += sums[i].compared;
        all.voids += sums[i].voids;
        all.sum += sums[i].sum;
        all.squares += sums[i].squares;
        all.max = std::max(all.max, sums[i].max);
      }
      job.report({"compare", "tiles", std::min(at + kBatch, tiles), tiles});
    }
  });
  if (surface) {
    const double count = std::max(static_cast<double>(all.compared), 1.0);
    found.surface = {all.compared, all.voids, std::sqrt(all.squares / count), all.sum / count, all.max, worst};
  }
  return found;
}

void subtract_archives(const std::string& first, const std::string& second, const RowReader::Take& take,
                       const Job& job) {
  require_callback(take);
  constexpr std::int64_t kSamplesAtOnce = std::int64_t{1} << 18U;
  const ArchiveReader a(first);
  const ArchiveReader b(second);
  if (const std::string why = why_other_vertices(a.metadata(), b.metadata()); !why.empty()) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {} as {} has", second, why, first));
  }
  const SampleGrid grid = natural_grid(a.metadata());
  Job half = job;
  half.memory_bytes /= 2;
  half.machine_bytes /= 2;
  Arena(job).execute([&] {
    const auto rows_of = [&](const ArchiveReader& archive) {
      try {
        return std::make_unique<RowReader>(archive, grid, RestoreMethod::kBarycentric, half);
      } catch (const Error& error) {
        throw error.within("each of the two archives");
      }
    };
    const auto minuend = rows_of(b);
    const auto subtrahend = rows_of(a);
    const std::int64_t step = std::max<std::int64_t>(kSamplesAtOnce / grid.width, 1);
    for (std::int64_t row = 0; row < grid.height; row += step) {
      job.throw_if_cancelled();
      const std::int64_t rows = std::min(step, grid.height - row);
      std::vector<double> difference(static_cast<std::size_t>(rows * grid.width));
      std::vector<double> before(difference.size());
      minuend->read(row, rows, difference);
      subtrahend->read(row, rows, before);
      for (std::size_t i = 0; i < before.size(); ++i) difference[i] -= before[i];
      take(row, difference);
      job.report({"difference", "rows", row + rows, grid.height});
    }
  });
}

}  // namespace isohf
