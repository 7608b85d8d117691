#include "isohf/verify.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "isohf/archive/archive_index.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/planes/plane_builder.h"
#include "isohf/archive/structure_check.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"
#include "isohf/lattice/shared_vertices.h"
#include "isohf/light/normals.h"
#include "isohf/surface.h"
#include "isohf/verify/metadata_check.h"
#include "isohf/verify/plane_check.h"
#include "isohf/verify/seed_check.h"
#include "isohf/verify/texture_check.h"

namespace isohf {
namespace {

/// At most this many findings of one kind are kept for one tile: the first says where, the count says how many.
constexpr int kKeptPerTileAndKind = 1;

/// What decoding one tile gave.
struct TileState {
  bool readable = false;
  TileEntry entry;
  // Of stored tiles:
  TileCodes codes;
  std::vector<float> heights;  ///< [C*R] vertical units, NaN where void
  Digest digest{};
  SeedRow::Tile seeds;
  std::vector<Finding> findings;
  TileStatistics statistics;
};

/// What the tiles South of a tile share with it.
struct TileBorder {
  bool readable = false;
  bool stored = false;
  std::vector<float> heights;  ///< of its last rows
};

/// A tile as others are compared with it.
struct TileView {
  bool readable;
  bool stored;
  View2D<const float> heights;
};

/// Tiles in each thread that are in hand at once, beside each other, and where memory is short.
constexpr std::int64_t kTilesPerThread = 32;
constexpr std::int64_t kLeastTilesPerThread = 8;
/// Of each vertex of a tile in hand, beside its codes, and in each thread while tiles are decoded (measured).
constexpr double kHeightBytes = 4.0;
constexpr double kDecodingBytes = 40.0;
/// Of each member, while the structure is checked; a member takes so many bytes of the file at least.
constexpr double kMemberBytes = 32.0;
constexpr std::uint64_t kLeastMemberBytes = 30;

class Verification {
 public:
  Verification(const ArchiveReader& archive, const Job& job, std::size_t max_findings)
      : archive_(archive),
        job_(job),
        max_findings_(max_findings),
        grid_(archive.grid()),
        shape_(grid_.shape()),
        void_heights_(static_cast<std::size_t>(shape_.stored_vertex_count()), std::numeric_limits<float>::quiet_NaN()),
        counted_(archive.metadata()) {
    first_border_row_ = shape_.rows();
    for (std::size_t i = 0; i < shared_.size(); ++i) {
      shared_[i] = shared_vertices(shape_, kComparedNeighbours[i]);
      if (kComparedNeighbours[i].row == 0) continue;
      // Normals look at the rows beside a vertex.
      for (const SharedVertex& shared : shared_[i]) {
        first_border_row_ = std::min(first_border_row_, shared.here.row - (shared.visible ? 1 : 0));
      }
    }
    divide_memory();
  }

  VerifyReport run() {
    check_structure();
    for (std::string& problem : contradictions_in(archive_)) add(make(finding::kMetadata, {}, std::move(problem)));
    start_seeds();
    if (archive_.metadata().planes.count > 0) planes_.emplace(archive_, scratch_);
    std::vector<TileBorder> above;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      above = check_row(row, above);
      job_.report({"verify", "tiles", (row + 1) * grid_.tile_columns(), grid_.tile_count()});
    }
    above = std::vector<TileBorder>();
    planes_.reset();
    check_totals();
    if (seeds_) add_seed_problems(seeds_->check_record());
    check_lossless();
    for (std::string& problem : check_textures(archive_)) add(make(finding::kTexture, {}, std::move(problem)));
    // Where all else is well: members may hold the same in other bytes.
    if (report_.findings_total == 0) {
      if (std::string problem = why_other_data(archive_); !problem.empty()) {
        add(make(finding::kStructure, {}, std::move(problem)));
      }
    }
    return std::move(report_);
  }

 private:
  [[nodiscard]] std::size_t at(GridVertex vertex) const {
    return static_cast<std::size_t>(vertex.row) * static_cast<std::size_t>(shape_.columns()) +
           static_cast<std::size_t>(vertex.column);
  }

  static Finding make(int id, std::optional<TileIndex> tile, std::string text) {
    return {id, severity_of(id), tile, std::move(text)};
  }

  void add(Finding found) {
    ++report_.findings_total;
    if (report_.findings.size() < max_findings_) report_.findings.push_back(std::move(found));
  }

  void check_structure() {
    if (archive_.reads_by_directory()) {
      add(make(finding::kReadByDirectory, {},
               "the index disagrees with the ZIP directory; tiles are read by the directory"));
    }
    isohf::check_structure(
        archive_.source(), archive_, [&](const std::string& problem) { add(make(finding::kStructure, {}, problem)); },
        [&](const std::string& problem) { add(make(finding::kMemberUnreadable, {}, problem)); });
  }

  void start_seeds() {
    try {
      if (const auto info = shadow_seed_info(archive_.metadata())) seeds_.emplace(archive_, *info, scratch_);
    } catch (const Error& error) {
      add(make(finding::kShadowSeeds, {}, error.what()));
    }
  }

  [[nodiscard]] bool has_seeds() const {
    const auto& extensions = archive_.metadata().extensions;
    return std::any_of(extensions.begin(), extensions.end(),
                       [](const auto& extension) { return extension.first == kShadowSeedsName; });
  }

  [[nodiscard]] double memory_bytes(std::int64_t tiles_at_once, bool in_scratch) const {
    const auto vertices = static_cast<double>(shape_.stored_vertex_count());
    const auto border = static_cast<double>((shape_.rows() - first_border_row_) * shape_.columns());
    const auto columns = static_cast<double>(grid_.tile_columns());
    double members = 0.0;
    for (const MemberTable& table : archive_.tables()) members += static_cast<double>(table.stored);
    members = std::min(members, static_cast<double>(archive_.size_bytes() / kLeastMemberBytes));
    const double seeds = has_seeds() ? static_cast<double>(SeedRow::memory_bytes(grid_, in_scratch)) : 0.0;
    const double codes =
        archive_.metadata().quantisation.type == CodeType::kF32 ? sizeof(float) : sizeof(std::uint16_t);
    return kProgramBytes + kMemberBytes * members + threads_of(job_) * (kThreadBytes + kDecodingBytes * vertices) +
           static_cast<double>(tiles_at_once) * vertices * (kHeightBytes + codes) +
           2.0 * columns * (border * sizeof(float) + sizeof(TileBorder)) + seeds +
           static_cast<double>(plane_builder_memory_bytes(planes_of(archive_.metadata()),
                                                          archive_.metadata().quantisation.type, in_scratch));
  }

  /// Throws Error{kOutOfMemory}. Where memory is short, rows of seeds and planes go to a scratch file, and then fewer
  /// tiles are in hand.
  void divide_memory() {
    const auto at_once = [&](std::int64_t tiles) { return std::min(tiles * threads_of(job_), grid_.tile_columns()); };
    tiles_at_once_ = at_once(kTilesPerThread);
    if (job_.bound_bytes() != 0 && memory_bytes(tiles_at_once_, true) > static_cast<double>(job_.bound_bytes())) {
      tiles_at_once_ = at_once(kLeastTilesPerThread);
    }
    scratch_ = scratch_for(job_, memory_bytes(tiles_at_once_, false), memory_bytes(tiles_at_once_, true), "verifying");
  }

  /// Checks a row of tiles, some beside each other at a time, and what it shares with the row above. Returns what the
  /// row below shares with it.
  std::vector<TileBorder> check_row(std::int64_t row, const std::vector<TileBorder>& above) {
    const std::int64_t columns = grid_.tile_columns();
    std::vector<TileBorder> borders;
    borders.reserve(static_cast<std::size_t>(columns));
    row_is_readable_ = true;
    TileState westmost;            // where the East end is the West end
    std::vector<TileState> tiles;  // from `first` on; the last waits for its neighbour in the East
    for (std::int64_t first = 0, read = 0; read < columns;) {
      job_.throw_if_cancelled();
      const std::int64_t count = std::min(tiles_at_once_, columns - read);
      read_tiles({read, row}, count, tiles);
      if (read == 0 && archive_.metadata().wraps_x) westmost = tiles.front();
      read += count;
      const bool is_last = read == columns;
      const TileState* east = is_last && archive_.metadata().wraps_x ? &westmost : nullptr;
      const std::size_t complete = tiles.size() - (is_last ? 0 : 1);
      compare_tiles({first, row}, tiles, complete, east, above);
      for (std::size_t i = 0; i < complete; ++i) {
        ++report_.tiles_checked;
        borders.push_back(finish_tile(tiles[i]));
      }
      first += static_cast<std::int64_t>(complete);
      tiles.erase(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(complete));
    }
    // Seeds follow from the whole row: where a tile of it cannot be read, that is said already.
    if (seeds_) add_seed_problems(seeds_->end_row(row, row_is_readable_));
    if (planes_) {
      for (auto& [id, text] : planes_->problems()) add(make(id, {}, std::move(text)));
    }
    for (Finding& found : row_findings_) add(std::move(found));
    row_findings_.clear();
    return borders;
  }

  /// Adds a tile up that has been compared with all others.
  TileBorder finish_tile(TileState& tile) {
    row_is_readable_ = row_is_readable_ && tile.readable;
    if (seeds_) seeds_->add(tile.seeds);
    // Planes follow from all tiles: behind one that cannot be read, nothing is said of them.
    if (!tile.readable) planes_.reset();
    if (planes_) planes_->add(tile.entry.stored ? &tile.codes : nullptr, tile.entry.code_min, tile.entry.code_max);
    collect(tile);
    TileBorder border{tile.readable, tile.entry.stored, {}};
    if (!tile.heights.empty()) {
      border.heights.assign(tile.heights.begin() + first_border_row_ * shape_.columns(), tile.heights.end());
    }
    return border;
  }

  void add_seed_problems(const std::vector<SeedCheck::Problem>& problems) {
    for (const auto& [tile, text] : problems) add(make(finding::kShadowSeeds, tile, text));
  }

  /// Appends `count` tiles from `first` on.
  void read_tiles(TileIndex first, std::int64_t count, std::vector<TileState>& tiles) {
    const std::size_t before = tiles.size();
    tiles.resize(before + static_cast<std::size_t>(count));
    const std::span<TileState> read = std::span(tiles).subspan(before);
    oneapi::tbb::parallel_for(std::size_t{0}, read.size(), [&](std::size_t i) {
      const TileIndex index{first.column + static_cast<std::int64_t>(i), first.row};
      if (find_entry(index, read[i])) read_tile(index, read[i]);
      if (!seeds_ || !read[i].readable) return;
      read[i].seeds = seeds_->prepare(index, read[i].entry.stored ? &read[i].codes : nullptr);
    });
  }

  /// False when there is nothing to decode. Tiles that are not stored are bounded by most_tiles().
  bool find_entry(TileIndex index, TileState& tile) const {
    try {
      tile.entry = archive_.tile_entry(index);
    } catch (const Error& error) {
      tile.findings.push_back(make(finding::kTileUndecodable, index, error.what()));
      return false;
    }
    if (tile.entry.stored) return true;
    tile.readable = true;
    tile.statistics.vertices = tile.statistics.voids = counted_.of_tile(index);
    return false;
  }

  [[nodiscard]] TileView view(const std::vector<float>& heights, bool readable, bool stored) const {
    return {readable, stored, {(stored ? heights : void_heights_).data(), shape_.columns(), shape_.rows()}};
  }
  [[nodiscard]] TileView view(const TileState& tile) const {
    return view(tile.heights, tile.readable, tile.entry.stored);
  }

  void read_tile(TileIndex index, TileState& tile) const {
    const TileEntry& entry = tile.entry;
    try {
      tile.codes = archive_.read_tile(index);
    } catch (const Error& error) {
      tile.findings.push_back(make(finding::kTileUndecodable, index, error.what()));
      return;
    }
    tile.readable = true;
    tile.digest = tile_content_digest(tile.codes);
    check_digest(index, tile);
    fill_heights(index, tile);
    check_entry(index, entry, tile);
    tile.statistics = tile_statistics(counted_, index, tile.codes, archive_.metadata().quantisation);
  }

  void check_digest(TileIndex index, TileState& tile) const {
    try {
      const auto stated = archive_.tile_digest(index);
      if (stated && *stated != tile.digest)
        tile.findings.push_back(
            make(finding::kContentHash, index,
                 fmt::format("its elevations have the digest {}, the index says {}", hex(tile.digest), hex(*stated))));
    } catch (const Error& error) {
      tile.findings.push_back(make(finding::kStructure, index, error.what()));
    }
  }

  void fill_heights(TileIndex index, TileState& tile) const {
    if (tile.codes.type == CodeType::kF32) {
      tile.heights = tile.codes.heights;
      return;
    }
    const Quantisation& q = archive_.metadata().quantisation;
    tile.heights.resize(tile.codes.codes.size());
    std::int64_t beyond = 0;
    for (std::size_t i = 0; i < tile.heights.size(); ++i) {
      tile.heights[i] = static_cast<float>(elevation_of_vertex(tile.codes, q, i));
      beyond += tile.codes.codes[i] > q.void_code() ? 1 : 0;
    }
    if (beyond > 0) {
      tile.findings.push_back(make(finding::kElevationRange, index,
                                   fmt::format("{} codes lie beyond the void code {}", beyond, q.void_code())));
    }
  }

  /// Codes of the tile, smallest and largest, void or not, against the index.
  void check_entry(TileIndex index, const TileEntry& entry, TileState& tile) const {
    bool any = false;
    bool voids = false;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    const Quantisation& q = archive_.metadata().quantisation;
    for (std::size_t i = 0; i < tile.heights.size(); ++i) {
      if (std::isnan(tile.heights[i])) {
        voids = true;
        continue;
      }
      any = true;
      const double value =
          q.type == CodeType::kF32 ? double{tile.heights[i]} : static_cast<double>(tile.codes.codes[i]);
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (!any) tile.findings.push_back(make(finding::kTileEmpty, index, "is stored, but holds no elevation"));
    if (archive_.reads_by_directory() && has_unknown_range(q, entry)) return;
    const auto number = [&](std::uint32_t code) {
      return q.type == CodeType::kF32 ? double{std::bit_cast<float>(code)} : static_cast<double>(code);
    };
    if (any && (number(entry.code_min) != low || number(entry.code_max) != high)) {
      tile.findings.push_back(make(finding::kTileCodeRange, index,
                                   fmt::format("codes run from {} to {}, the index says {} to {}", low, high,
                                               number(entry.code_min), number(entry.code_max))));
    }
    if (voids != entry.has_voids) {
      tile.findings.push_back(make(finding::kTileVoidFlag, index,
                                   voids ? "has voids, the index says none" : "has no voids, the index says some"));
    }
  }

  /// Compares the first `count` of some tiles of a row with their neighbours; east: that of the last, where it is not
  /// among them.
  void compare_tiles(TileIndex first, std::vector<TileState>& tiles, std::size_t count, const TileState* east,
                     const std::vector<TileBorder>& above) {
    std::vector<std::int64_t> compared(count, 0);
    oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t at) {
      TileState& tile = tiles[at];
      const TileIndex index{first.column + static_cast<std::int64_t>(at), first.row};
      std::vector<float> heights;
      // Each pair once: this tile with the one East of it, and as the southern partner of the row above. The finding
      // goes to this tile, so that threads never write to one tile at once.
      for (std::size_t i = 0; i < shared_.size(); ++i) {
        const TileIndex step = kComparedNeighbours[i];
        if (step.row == 0) {
          const TileState* const other = at + 1 < tiles.size() ? &tiles[at + 1] : east;
          if (other != nullptr) compared[at] += compare(index, tile, view(*other), i, false);
          continue;
        }
        std::int64_t other = index.column - step.column;
        if (archive_.metadata().wraps_x) other = (other + grid_.tile_columns()) % grid_.tile_columns();
        if (above.empty() || other < 0 || other >= grid_.tile_columns()) continue;
        const TileBorder& border = above[static_cast<std::size_t>(other)];
        if (!border.heights.empty()) {
          heights.resize(void_heights_.size());
          std::copy(border.heights.rbegin(), border.heights.rend(), heights.rbegin());
        }
        compared[at] += compare(index, tile, view(heights, border.readable, border.stored), i, true);
      }
    });
    for (const std::int64_t shared : compared) report_.shared_vertices_checked += shared;
  }

  /// Compares `tile` with `other`; where `tile_is_there`, `tile` plays the neighbour's part of shared_[neighbour].
  std::int64_t compare(TileIndex index, TileState& tile, const TileView& other, std::size_t neighbour,
                       bool tile_is_there) const {
    if (!tile.readable || !other.readable) return 0;
    const auto shared_count = static_cast<std::int64_t>(shared_[neighbour].size());
    if (!tile.entry.stored && !other.stored) return shared_count;
    const TileIndex step = kComparedNeighbours[neighbour];
    const TileIndex other_index = tile_is_there ? TileIndex{index.column - step.column, index.row - step.row}
                                                : TileIndex{index.column + step.column, index.row + step.row};
    std::array<int, 3> found{};
    const auto report = [&](int id, int kind, GridVertex vertex, const std::string& what) {
      if (found[static_cast<std::size_t>(kind)]++ < kKeptPerTileAndKind) {
        tile.findings.push_back(make(id, index,
                                     fmt::format("vertex (column {}, row {}) {} than in tile ({},{})", vertex.column,
                                                 vertex.row, what, other_index.column, other_index.row)));
      }
    };
    const View2D<const float> here_heights = view(tile).heights;
    const View2D<const float> there_heights = other.heights;
    for (const SharedVertex& shared : shared_[neighbour]) {
      const GridVertex mine = tile_is_there ? shared.there : shared.here;
      const GridVertex theirs = tile_is_there ? shared.here : shared.there;
      const float a = here_heights(mine.column, mine.row);
      const float b = there_heights(theirs.column, theirs.row);
      if (std::bit_cast<std::uint32_t>(a) != std::bit_cast<std::uint32_t>(b) && !(std::isnan(a) && std::isnan(b))) {
        report(shared.visible ? finding::kSharedVertex : finding::kPadding, shared.visible ? 0 : 1, mine,
               fmt::format("is {} here, other ({})", a, b));
      }
      if (!shared.visible) continue;
      if (!(vertex_normal(grid_, here_heights, mine) == vertex_normal(grid_, there_heights, theirs))) {
        report(finding::kNormal, 2, mine, "has another normal");
      }
    }
    return shared_count;
  }

  void collect(TileState& tile) {
    for (Finding& found : tile.findings) row_findings_.push_back(std::move(found));
    stored_ += tile.entry.stored ? 1 : 0;
    all_readable_ = all_readable_ && tile.readable;
    all_.vertices += tile.statistics.vertices;
    all_.voids += tile.statistics.voids;
    all_.sum += tile.statistics.sum;
    all_.min = std::min(all_.min, tile.statistics.min);
    all_.max = std::max(all_.max, tile.statistics.max);
    if (tile.readable && tile.entry.stored) hash_.add_tile(report_.tiles_checked - 1, tile.digest);
  }

  /// The source's samples, restored from tiles and residuals, against their hash.
  void check_lossless() {
    if (!all_readable_) return;
    try {
      if (!lossless_record(archive_.metadata())) return;
      Job job = job_;
      job.progress = {};
      for (SourceRowReader reader(archive_, job); !reader.at_end();) (void)reader.read_next();
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kOutOfMemory || error.code() == ErrorCode::kCancelled) throw;
      add(make(finding::kLossless, {}, error.what()));
    }
  }

  void check_totals() {
    const Metadata& metadata = archive_.metadata();
    try {
      (void)accuracy_info(metadata);
    } catch (const Error& error) {
      add(make(finding::kAccuracy, {}, error.what()));
    }
    if (stored_ != metadata.tiles_stored) {
      add(make(finding::kTileCount, {},
               fmt::format("{} tiles are stored, the metadata says {}", stored_, metadata.tiles_stored)));
    }
    if (!all_readable_) return;  // the sums below mean nothing then
    if (const std::string hash = hash_.finish(metadata); hash != metadata.content_sha256) {
      add(make(finding::kContentHash, {},
               fmt::format("content hash is {}, the metadata says {}", hash, metadata.content_sha256)));
    }
    if (const std::string hash = ground_hash(metadata); hash != metadata.ground_sha256) {
      add(make(finding::kContentHash, {},
               fmt::format("ground hash is {}, the metadata says {}", hash, metadata.ground_sha256)));
    }
    const Statistics& said = metadata.statistics;
    const auto differ = [&](const char* what, double found, double stated) {
      add(make(finding::kStatistics, {}, fmt::format("{} is {}, the metadata says {}", what, found, stated)));
    };
    const auto count = [&](const char* what, std::int64_t found, std::int64_t stated) {
      if (found != stated) differ(what, static_cast<double>(found), static_cast<double>(stated));
    };
    count("vertices", all_.vertices, said.vertices);
    count("voids", all_.voids, said.voids);
    if (all_.voids == all_.vertices) return;
    if (metadata.z_range && !(all_.min >= metadata.z_range->first && all_.max <= metadata.z_range->second)) {
      add(make(finding::kElevationRange, {},
               fmt::format("elevations run from {} to {}, the metadata allow {} to {}", all_.min, all_.max,
                           metadata.z_range->first, metadata.z_range->second)));
    }
    const double span = std::max({std::abs(all_.min), std::abs(all_.max), 1e-300});
    const auto check = [&](const char* what, double found, const std::optional<double>& stated, double tolerance) {
      if (!stated || !(std::abs(found - *stated) <= tolerance * span)) differ(what, found, stated.value_or(0.0));
    };
    check("minimum", all_.min, said.min, 1e-12);
    check("maximum", all_.max, said.max, 1e-12);
    check("mean", total_statistics(all_).mean.value_or(0.0), said.mean, 1e-9);  // sums in another order
  }

  const ArchiveReader& archive_;
  const Job& job_;
  std::size_t max_findings_;
  const TileGrid& grid_;
  TileShape shape_;
  std::vector<float> void_heights_;
  CountedVertices counted_;
  std::array<std::vector<SharedVertex>, std::size(kComparedNeighbours)> shared_;
  std::int64_t tiles_at_once_ = 0;
  ScratchFolder scratch_;
  int first_border_row_ = 0;  ///< the first that the tiles South of a tile are compared with
  VerifyReport report_;
  std::vector<Finding> row_findings_;  ///< of the tiles of the row at hand
  bool row_is_readable_ = true;
  ContentHash hash_;
  std::optional<SeedCheck> seeds_;
  std::optional<PlaneCheck> planes_;
  std::int64_t stored_ = 0;
  TileStatistics all_;
  bool all_readable_ = true;
};

}  // namespace

VerifyReport verify_archive(const std::string& path, const Job& job, std::size_t max_findings) {
  std::unique_ptr<ArchiveReader> archive;
  try {
    archive = std::make_unique<ArchiveReader>(path);
    check_statistics_of(archive->metadata());
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kIo || error.code() == ErrorCode::kInvalidArgument) throw;
    VerifyReport report;
    report.findings.push_back({finding::kNotReadable, Severity::kError, {}, error.what()});
    report.findings_total = 1;
    return report;
  }
  VerifyReport report;
  Arena(job).execute([&] { report = Verification(*archive, job, max_findings).run(); });
  return report;
}

}  // namespace isohf
