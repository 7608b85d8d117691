#pragma once

#include <cstdint>
#include <vector>

#include "isohf/archive/writer.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/job.h"
#include "isohf/parts/part_file.h"
#include "isohf/restore/lossless.h"

namespace isohf {

/// A shard that is copied, and its rows of tiles: `end_row` past the last.
struct AssemblyInput {
  std::unique_ptr<PartFile> file;
  std::int64_t first_row = 0;
  std::int64_t end_row = 0;
};

/// Writes an archive of the tiles of its shards, which are not coded again, in the order in which convert() does: a
/// tile's textures, the tile; after a row, planes and seeds; then residuals. On the caller's oneTBB arena. Stage
/// "tiles".
class Assembly {
 public:
  /// metadata  of the archive that is written: grid, quantisation, seeds
  /// shards    ascending; together all rows of tiles
  /// planes    takes all tiles; nullptr: there are none
  /// has_plane_rows  the shards have the first plane's tiles; else all tiles are decoded for them
  Assembly(const Metadata& metadata, ArchiveWriter& writer, std::vector<AssemblyInput> shards, PlaneStage* planes,
           bool has_plane_rows, const Job& job);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;
  ~Assembly() { writer_.stop_copies(); }

  void add_tiles();
  /// The residual members, after the tiles. Returns their compressed bytes.
  std::uint64_t add_residuals(const LosslessRecord& record);

 private:
  [[nodiscard]] const AssemblyInput& input_of(std::int64_t row) const;
  void copy_row(std::int64_t row, const AssemblyInput& input);
  void copy_seeds(std::int64_t row, const AssemblyInput& input);
  void decode_row(std::int64_t row, const AssemblyInput& input);
  void add_plane_rows(std::int64_t row);
  std::uint64_t copy_member(const ArchiveReader& from, const std::string& name);

  const Metadata& metadata_;
  ArchiveWriter& writer_;
  std::vector<AssemblyInput> shards_;
  PlaneStage* planes_;
  bool has_plane_rows_;
  const Job& job_;
  std::int64_t next_plane_row_ = 0;
};

}  // namespace isohf
