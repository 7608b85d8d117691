// Codes the tiles of an archive again with every effort, in turn, and decodes them; one thread, its own processor time.
// usage: levels_bench ARCHIVE [REPEATS=3]; prints a JSON array with bytes and seconds of each effort, the best of all
// repeats, and the samples that were coded. Tiles whose samples are all equal are left out.

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/error.h"

namespace {

using isohf::TileCodes;

/// Processor seconds of this thread: other work on the machine counts little.
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Cost {
  std::size_t bytes = 0;
  double encode_s = 1e9;
  double inflate_s = 1e9;
  double decode_s = 1e9;
};

std::vector<TileCodes> tiles_of(const isohf::ArchiveReader& archive) {
  std::vector<TileCodes> tiles;
  for (std::int64_t flat = 0; flat < archive.grid().tile_count(); ++flat) {
    TileCodes tile = archive.read_tile(archive.grid().tile_at(flat));
    const bool is_plain = tile.type == isohf::CodeType::kF32
                              ? std::equal(tile.heights.begin() + 1, tile.heights.end(), tile.heights.begin())
                              : std::equal(tile.codes.begin() + 1, tile.codes.end(), tile.codes.begin());
    if (!is_plain) tiles.push_back(std::move(tile));
  }
  return tiles;
}

void decode(const isohf::TileShape& shape, const std::vector<TileCodes>& tiles,
            const std::vector<std::vector<std::byte>>& payloads) {
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const TileCodes decoded = decode_tile(shape, tiles[i].type, payloads[i]);
    if (decoded.codes != tiles[i].codes) throw isohf::Error(isohf::ErrorCode::kCorrupt, "decodes wrongly");
  }
}

std::vector<isohf::EncodedTile> encode(const isohf::TileShape& shape, const std::vector<TileCodes>& tiles,
                                       isohf::Effort effort, Cost& cost) {
  const double start = now();
  std::vector<isohf::EncodedTile> encoded;
  for (const TileCodes& tile : tiles) encoded.push_back(encode_tile(shape, tile, effort));
  cost.encode_s = std::min(cost.encode_s, now() - start);
  return encoded;
}

void read(const isohf::TileShape& shape, const std::vector<TileCodes>& tiles,
          const std::vector<isohf::EncodedTile>& encoded, Cost& cost) {
  cost.bytes = 0;
  std::vector<std::vector<std::byte>> payloads;
  for (const isohf::EncodedTile& tile : encoded) {
    cost.bytes += tile.deflated.size();
    payloads.emplace_back(tile.payload_bytes);
  }
  double start = now();
  for (std::size_t i = 0; i < tiles.size(); ++i) isohf::inflate_exactly(encoded[i].deflated, payloads[i]);
  cost.inflate_s = std::min(cost.inflate_s, now() - start);
  start = now();
  decode(shape, tiles, payloads);
  cost.decode_s = std::min(cost.decode_s, now() - start);
}

int run(const std::string& path, int repeats) {
  const isohf::ArchiveReader archive(path);
  const std::vector<TileCodes> tiles = tiles_of(archive);
  const isohf::TileShape& shape = archive.grid().shape();
  constexpr std::array kEfforts = {isohf::Effort::kFast, isohf::Effort::kDefault, isohf::Effort::kBest};
  std::array<Cost, kEfforts.size()> costs{};
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < kEfforts.size(); ++i)
      read(shape, tiles, encode(shape, tiles, kEfforts[i], costs[i]), costs[i]);
  }
  const auto samples = static_cast<std::int64_t>(tiles.size()) * shape.stored_vertex_count();
  fmt::print("[");
  for (std::size_t i = 0; i < costs.size(); ++i) {
    fmt::print(
        "{}{{\"level\": {}, \"samples\": {}, \"bytes\": {}, \"encode_s\": {:.6f}, \"inflate_s\": {:.6f}, "
        "\"decode_s\": {:.6f}}}",
        i == 0 ? "" : ",\n ", level_of(kEfforts[i]), samples, costs[i].bytes, costs[i].encode_s, costs[i].inflate_s,
        costs[i].decode_s);
  }
  fmt::print("]\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "usage: levels_bench ARCHIVE [REPEATS=3]\n");
    return 2;
  }
  // As the programs do: freed memory stays, or the system would clear the pages of every tile anew.
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
  try {
    return run(argv[1], argc > 2 ? std::stoi(argv[2]) : 3);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
