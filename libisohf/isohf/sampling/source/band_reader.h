#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "isohf/base/sample.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "isohf/sampling/source/source_rows.h"

namespace isohf {

/// A part of the source as heights; shared by the tiles that are cut from it.
struct Band {
  std::vector<float> heights;
  std::vector<char> voids;  ///< as SourceBand::voids; empty where it has no data, or there are none
  std::int64_t columns = 0;
  RowRange rows{0, -1};
  std::int64_t first_column = 0;

  [[nodiscard]] SourceBand view() const {
    const std::int64_t count = rows.last - rows.first + 1;
    return {{heights.data(), columns, count},
            rows.first,
            {voids.empty() ? nullptr : voids.data(), columns, count},
            first_column};
  }
};

/// Reads a source from North to South in overlapping bands, each source row once, and prefilters it on the way.
///
/// The bytes of a band do not depend on how the source is cut into bands: a coefficient depends on the samples within
/// the prefilter's halo, along both axes, and on nothing else.
class BandReader {
 public:
  /// `datum` as in heights_from_samples. All references outlive the reader. `wraps` as in Prefilter::filter_rows; only
  /// whole rows are read then.
  BandReader(HeightSource& source, double datum, const Prefilter& prefilter, bool wraps = false);
  BandReader(SourceRows& rows, double datum, const Prefilter& prefilter, bool wraps = false);

  /// The band that holds exactly `rows`: coefficients, or heights where the prefilter is the identity. Rows that the
  /// last band held are not read again. Works on the calling thread's task arena.
  [[nodiscard]] std::shared_ptr<const Band> read(const RowRange& rows);
  /// The same for a part of the columns. Neighbouring parts read each other's halo as well, and what a part shares with
  /// the rows before is only kept while the columns stay the same.
  [[nodiscard]] std::shared_ptr<const Band> read(const RowRange& rows, const RowRange& columns);

  /// Memory of a reader and of `bands` bands that are in use, and of what they are made from, bytes.
  [[nodiscard]] static std::uint64_t memory_bytes(const Prefilter& prefilter, std::int64_t bands, std::int64_t rows,
                                                  std::int64_t columns, const SourceInfo& info);

 private:
  [[nodiscard]] std::shared_ptr<Band> make_band(const RowRange& rows, const RowRange& columns) const;
  /// Makes band_'s heights those of `rows` and `columns`, prefiltered along rows; with voids.
  void move_heights_to(const RowRange& rows, const RowRange& columns);
  void read_rows(const RowRange& rows, Band& band);

  std::unique_ptr<SourceRows> own_rows_;
  SourceRows& rows_;
  double datum_;
  const Prefilter& prefilter_;
  bool wraps_;
  Recycled<Band> recycled_;
  Band filtered_;                     ///< heights prefiltered along rows alone, halo included
  std::shared_ptr<const Band> last_;  ///< where the prefilter is the identity
};

}  // namespace isohf
