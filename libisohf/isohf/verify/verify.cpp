#include "isohf/verify/verify.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "isohf/archive/accuracy_info.h"
#include "isohf/archive/content_hash.h"
#include "isohf/archive/lane_decoder.h"
#include "isohf/base/error.h"
#include "isohf/restore/lossless.h"
#include "isohf/surface/normals.h"
#include "isohf/verify/findings.h"
#include "isohf/verify/shared_vertices.h"
#include "isohf/verify/texture_check.h"

namespace isohf {
namespace {

/// At most this many findings of one kind are kept for one tile: the first says where, the count says how many.
constexpr int kKeptPerTileAndKind = 1;

/// What decoding one tile gave.
struct TileState {
  bool readable = false;
  bool stored = false;
  TileCodes codes;
  std::vector<float> heights;  ///< [C*R] vertical units, NaN where void
  std::vector<std::byte> digest;
  std::vector<Finding> findings;
  // Over the visible vertices:
  std::int64_t vertices = 0;
  std::int64_t voids = 0;
  double sum = 0.0;
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
};

using TileRow = std::vector<TileState>;

class Verification {
 public:
  Verification(const ArchiveReader& archive, const VerifyOptions& options)
      : archive_(archive), options_(options), grid_(archive.grid()), shape_(grid_.shape()) {
    for (std::size_t i = 0; i < shared_.size(); ++i) shared_[i] = shared_vertices(shape_, kComparedNeighbours[i]);
  }

  VerifyReport run() {
    check_structure();
    check_members();
    TileRow above;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      TileRow current = read_row(row);
      compare_row(row, current, above);
      collect(current);
      above = std::move(current);
      if (options_.progress && !options_.progress((row + 1) * grid_.tile_columns(), grid_.tile_count())) {
        throw Error(ErrorCode::kCancelled, "interrupted");
      }
    }
    check_totals();
    check_lossless();
    for (std::string& problem : check_textures(archive_)) add(make(finding::kTexture, {}, std::move(problem)));
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
    if (report_.findings.size() < options_.max_findings) report_.findings.push_back(std::move(found));
  }

  void check_structure() {
    if (archive_.reads_by_directory()) {
      add(make(finding::kReadByDirectory, {},
               "the index disagrees with the ZIP directory; tiles are read by the directory"));
    }
    for (const std::string& problem : archive_.check_structure()) add(make(finding::kStructure, {}, problem));
  }

  void check_members() {
    for (const MemberEntry& member : archive_.members()) {
      try {
        (void)archive_.read_member(member);
      } catch (const Error& error) {
        add(make(finding::kMemberUnreadable, {}, error.what()));
      }
    }
  }

  TileRow read_row(std::int64_t row) {
    TileRow tiles(static_cast<std::size_t>(grid_.tile_columns()));
    const std::size_t groups = (tiles.size() + kDecoderLanes - 1) / kDecoderLanes;
    oneapi::tbb::parallel_for(std::size_t{0}, groups, [&](std::size_t group) {
      const std::size_t first = group * kDecoderLanes;
      const std::size_t count = std::min(kDecoderLanes, tiles.size() - first);
      std::array<TileIndex, kDecoderLanes> indices{};
      for (std::size_t i = 0; i < count; ++i) indices[i] = {static_cast<std::int64_t>(first + i), row};
      std::vector<TileCodes> codes;
      try {
        codes = archive_.read_tiles(std::span(indices).first(count));
      } catch (const Error&) {
        codes.clear();  // one by one, to tell which
      }
      for (std::size_t i = 0; i < count; ++i) {
        read_tile(indices[i], codes.empty() ? nullptr : &codes[i], tiles[first + i]);
      }
    });
    return tiles;
  }

  /// codes: the tile as read already, or nullptr.
  void read_tile(TileIndex index, TileCodes* codes, TileState& tile) const {
    const TileEntry entry = archive_.tile_entry(index);
    tile.stored = entry.stored;
    try {
      tile.codes = codes != nullptr ? std::move(*codes) : archive_.read_tile(index);
      if (!archive_.zlib_reads(index)) {
        tile.findings.push_back(make(finding::kTileNotDeflate, index, "zlib does not inflate it to the same payload"));
      }
    } catch (const Error& error) {
      tile.findings.push_back(make(finding::kTileUndecodable, index, error.what()));
      return;
    }
    tile.readable = true;
    tile.digest = tile_content_digest(tile.codes);
    fill_heights(index, tile);
    check_entry(index, entry, tile);
    count_visible(tile);
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
      const std::uint32_t code = tile.codes.codes[i];
      tile.heights[i] = code == q.void_code() ? std::numeric_limits<float>::quiet_NaN()
                                              : static_cast<float>(q.offset + q.scale * code);
      beyond += code > q.void_code() ? 1 : 0;
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
    if (any != entry.stored) {
      tile.findings.push_back(make(
          finding::kTileEmpty, index,
          any ? "holds elevations, but the index says that it is not stored" : "is stored, but holds no elevation"));
    }
    if (!entry.stored) return;
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

  void count_visible(TileState& tile) const {
    for (int r = 1; r <= shape_.rows() - 2; ++r) {
      const int last = shape_.columns() - (r % 2 == 0 ? 2 : 3);
      for (int c = 1; c <= last; ++c) {
        ++tile.vertices;
        const std::size_t i = at({c, r});
        if (std::isnan(tile.heights[i])) {
          ++tile.voids;
          continue;
        }
        const Quantisation& q = archive_.metadata().quantisation;
        const double elevation =
            q.type == CodeType::kF32 ? double{tile.heights[i]} : q.offset + q.scale * tile.codes.codes[i];
        tile.sum += elevation;
        tile.min = std::min(tile.min, elevation);
        tile.max = std::max(tile.max, elevation);
      }
    }
  }

  void compare_row(std::int64_t row, TileRow& current, TileRow& above) {
    std::vector<std::int64_t> compared(current.size(), 0);
    oneapi::tbb::parallel_for(std::size_t{0}, current.size(), [&](std::size_t column) {
      TileState& tile = current[column];
      const TileIndex index{static_cast<std::int64_t>(column), row};
      // Each pair once: this tile with the one East of it, and as the southern partner of the row above. The finding
      // goes to this tile, so that threads never write to one tile at once.
      for (std::size_t i = 0; i < shared_.size(); ++i) {
        const TileIndex step = kComparedNeighbours[i];
        if (step.row == 0) {
          const bool joins = archive_.metadata().wraps_x;
          if (column + 1 == current.size() && !joins) continue;
          compared[column] += compare(index, tile, current[(column + 1) % current.size()], i, false);
          continue;
        }
        std::int64_t other = index.column - step.column;
        if (archive_.metadata().wraps_x) other = (other + grid_.tile_columns()) % grid_.tile_columns();
        if (above.empty() || other < 0 || other >= grid_.tile_columns()) continue;
        compared[column] += compare(index, tile, above[static_cast<std::size_t>(other)], i, true);
      }
    });
    for (const std::int64_t count : compared) report_.shared_vertices_checked += count;
  }

  /// Compares `tile` with `other`; where `tile_is_there`, `tile` plays the neighbour's part of shared_[neighbour].
  std::int64_t compare(TileIndex index, TileState& tile, const TileState& other, std::size_t neighbour,
                       bool tile_is_there) const {
    if (!tile.readable || !other.readable) return 0;
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
    const View2D<const float> here_heights(tile.heights.data(), shape_.columns(), shape_.rows());
    const View2D<const float> there_heights(other.heights.data(), shape_.columns(), shape_.rows());
    for (const SharedVertex& shared : shared_[neighbour]) {
      const GridVertex mine = tile_is_there ? shared.there : shared.here;
      const GridVertex theirs = tile_is_there ? shared.here : shared.there;
      const float a = tile.heights[at(mine)];
      const float b = other.heights[at(theirs)];
      if (std::bit_cast<std::uint32_t>(a) != std::bit_cast<std::uint32_t>(b) && !(std::isnan(a) && std::isnan(b))) {
        report(shared.visible ? finding::kSharedVertex : finding::kPadding, shared.visible ? 0 : 1, mine,
               fmt::format("is {} here, other ({})", a, b));
      }
      if (!shared.visible) continue;
      if (!(vertex_normal(grid_, here_heights, mine) == vertex_normal(grid_, there_heights, theirs))) {
        report(finding::kNormal, 2, mine, "has another normal");
      }
    }
    return static_cast<std::int64_t>(shared_[neighbour].size());
  }

  void collect(TileRow& row) {
    for (TileState& tile : row) {
      ++report_.tiles_checked;
      for (Finding& found : tile.findings) add(std::move(found));
      tile.findings.clear();
      stored_ += tile.stored ? 1 : 0;
      all_readable_ = all_readable_ && tile.readable;
      vertices_ += tile.vertices;
      voids_ += tile.voids;
      sum_ += tile.sum;
      min_ = std::min(min_, tile.min);
      max_ = std::max(max_, tile.max);
      if (tile.readable) hash_.add_tile(tile.digest);
    }
  }

  /// The source's samples, restored from tiles and residuals, against their hash.
  void check_lossless() {
    if (!all_readable_) return;
    try {
      const std::optional<LosslessRecord> record = lossless_record(archive_.metadata());
      if (!record) return;
      Sha256 hash;
      for (LosslessReader reader(archive_, *record); !reader.at_end();) hash.add(reader.read_next());
      if (const std::string found = hex(hash.finish()); found != record->sha256) {
        add(make(finding::kLossless, {},
                 fmt::format("the restored samples have the SHA-256 {}, the metadata says {}", found, record->sha256)));
      }
    } catch (const Error& error) {
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
    const Statistics& said = metadata.statistics;
    const auto differ = [&](const char* what, double found, double stated) {
      add(make(finding::kStatistics, {}, fmt::format("{} is {}, the metadata says {}", what, found, stated)));
    };
    if (vertices_ != said.vertices)
      differ("vertices", static_cast<double>(vertices_), static_cast<double>(said.vertices));
    if (voids_ != said.voids) differ("voids", static_cast<double>(voids_), static_cast<double>(said.voids));
    if (voids_ == vertices_) return;
    if (metadata.z_range && !(min_ >= metadata.z_range->first && max_ <= metadata.z_range->second)) {
      add(make(finding::kElevationRange, {},
               fmt::format("elevations run from {} to {}, the metadata allow {} to {}", min_, max_,
                           metadata.z_range->first, metadata.z_range->second)));
    }
    const double span = std::max({std::abs(min_), std::abs(max_), 1e-300});
    const auto check = [&](const char* what, double found, const std::optional<double>& stated, double tolerance) {
      if (!stated || !(std::abs(found - *stated) <= tolerance * span)) differ(what, found, stated.value_or(0.0));
    };
    check("minimum", min_, said.min, 1e-12);
    check("maximum", max_, said.max, 1e-12);
    check("mean", sum_ / static_cast<double>(vertices_ - voids_), said.mean, 1e-9);  // sums in another order
  }

  const ArchiveReader& archive_;
  const VerifyOptions& options_;
  const TileGrid& grid_;
  TileShape shape_;
  std::array<std::vector<SharedVertex>, std::size(kComparedNeighbours)> shared_;
  VerifyReport report_;
  ContentHash hash_;
  std::int64_t stored_ = 0;
  std::int64_t vertices_ = 0;
  std::int64_t voids_ = 0;
  double sum_ = 0.0;
  double min_ = std::numeric_limits<double>::infinity();
  double max_ = -std::numeric_limits<double>::infinity();
  bool all_readable_ = true;
};

}  // namespace

VerifyReport verify_archive(const std::string& path, const VerifyOptions& options) {
  std::unique_ptr<ArchiveReader> archive;
  try {
    archive = std::make_unique<ArchiveReader>(path);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kIo) throw;
    VerifyReport report;
    report.findings.push_back({finding::kNotReadable, Severity::kError, {}, error.what()});
    report.findings_total = 1;
    return report;
  }
  VerifyReport report;
  oneapi::tbb::task_arena arena(options.threads > 0 ? options.threads : oneapi::tbb::task_arena::automatic);
  arena.execute([&] { report = Verification(*archive, options).run(); });
  return report;
}

}  // namespace isohf
