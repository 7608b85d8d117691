#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/fill/void_filler.h"
#include "isohf/job.h"
#include "isohf/raster.h"

namespace isohf {

/// Samples of the rows that have been read so far, each row counted once.
struct VoidCounts {
  std::int64_t rows = 0;            ///< whole rows counted, from the first on
  std::int64_t found = 0;           ///< voids before filling, those below included
  std::int64_t by_valid_range = 0;  ///< of these, only void because they lie outside valid_range
  std::int64_t filled = 0;
  std::int64_t left = 0;  ///< voids after filling
};

/// Another source with its voids filled.
///
/// From a void, the nearest elevation is looked up along each of 16 directions, up to fill_distance samples away. The
/// void gets their mean, weighted by distance^-1.5 and by the angle that a direction stands for; then a few passes take
/// the mean of what lies on a circle around it that stays within the hole, as harmonic surfaces have it
/// (docs/decisions/0019 compares). No value leaves the range of the elevations that it is made of. Where no ray meets
/// anything the void stays.
///
/// A filled sample depends on the samples within VoidFiller::reach() of it and on nothing else: not on windows, threads
/// or the pieces of a mosaic. It is rounded to the source's sample type, and never to one of its void values. Samples
/// that are no voids come through bit for bit.
///
/// Memory: the rows of a window and VoidFiller::reach() more on either side, or a scratch file's. Windows without voids
/// are read from the other source as they are, and looked through once. Works on the caller's oneTBB arena.
class FilledSource final : public HeightSource {
 public:
  /// Throws Error{kInvalidArgument} where valid_range leaves nothing or fill_distance is beyond kMaxFillDistance.
  FilledSource(std::unique_ptr<HeightSource> source, const VoidTreatment& treatment,
               const ScratchFolder& scratch = std::nullopt);
  ~FilledSource() override;

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override;
  [[nodiscard]] std::uint64_t buffer_bytes() const override;
  [[nodiscard]] HeightSource& as_stored() override { return source_->as_stored(); }
  [[nodiscard]] const VoidCounts& counts() const { return counts_; }

 private:
  struct Chunk;

  [[nodiscard]] std::unique_ptr<Chunk> read_chunk(std::int64_t index);
  void have_rows(std::int64_t first, std::int64_t end);
  void drop_rows_before(std::int64_t row);
  void drop_chunk(const Chunk& chunk);
  [[nodiscard]] const Chunk& chunk_of(std::int64_t row) const;
  [[nodiscard]] std::int64_t voids_in(std::int64_t row) const;
  [[nodiscard]] VoidRows rows_at(std::int64_t first, std::int64_t end, std::int64_t column,
                                 std::int64_t end_column) const;
  void read_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples);
  void make_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples);
  void treat_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples);
  void count_out_of_range(std::int64_t first, std::int64_t end);

  std::unique_ptr<HeightSource> source_;
  SourceInfo info_;
  VoidFiller filler_;
  std::int64_t chunk_rows_ = 1;
  std::optional<RowFile> file_;                ///< of the chunks' samples and voids, where they are not in memory
  std::deque<std::unique_ptr<Chunk>> chunks_;  ///< neighbouring ones, from North to South
  std::int64_t first_made_ = 0;  ///< with a file, rows that were filled together: each looks at many others
  std::vector<std::byte> made_;
  VoidCounts counts_;
};

/// The voids of a source of which every row has been read: as a FilledSource counted them, or `voids` of any other;
/// nullopt if nobody counted.
[[nodiscard]] std::optional<VoidCounts> void_counts(const HeightSource& source, std::optional<std::int64_t> voids);

/// What a FilledSource with this info() holds at most, beyond its source; 0 for an info that says nothing of treatment.
[[nodiscard]] std::uint64_t fill_memory_bytes(const SourceInfo& info, bool in_scratch);

}  // namespace isohf
