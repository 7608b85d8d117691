#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "isohf/surface/height_source.h"
#include "isohf/surface/prefilter.h"
#include "isohf/surface/tile_cutter.h"

namespace isohf {

/// Whole rows of the source as heights; shared by the tiles that are cut from it.
struct Band {
  std::vector<float> heights;
  std::vector<char> voids;  ///< as SourceBand::voids; empty where it has no data, or there are none
  std::int64_t columns = 0;
  RowRange rows{0, -1};

  [[nodiscard]] SourceBand view() const {
    const std::int64_t count = rows.last - rows.first + 1;
    return {{heights.data(), columns, count}, rows.first, {voids.empty() ? nullptr : voids.data(), columns, count}};
  }
};

/// Reads a source from North to South in overlapping bands, each source row once, and prefilters it on the way.
///
/// The bytes of a band do not depend on how the source is cut into bands: a coefficient depends on the rows within the
/// prefilter's halo and on nothing else.
class BandReader {
 public:
  /// `datum` as in heights_from_samples. Both references outlive the reader.
  BandReader(HeightSource& source, double datum, const Prefilter& prefilter);

  /// The band that holds exactly `rows`: coefficients, or heights where the prefilter is the identity. Rows that the
  /// last band held are not read again. Works on the calling thread's task arena.
  [[nodiscard]] std::shared_ptr<const Band> read(const RowRange& rows);

 private:
  /// Memory of bands that nobody reads any more, for the next ones: fresh memory would be cleared page by page.
  class Pool;

  [[nodiscard]] std::shared_ptr<Band> make_band(const RowRange& rows, bool with_voids) const;
  /// Heights, prefiltered along rows but not yet along columns; with voids, unless the prefilter is the identity.
  [[nodiscard]] std::shared_ptr<const Band> read_heights(const RowRange& rows);
  void read_rows(std::int64_t first, std::int64_t count, float* heights, char* voids);

  HeightSource& source_;
  double datum_;
  const Prefilter& prefilter_;
  std::shared_ptr<Pool> pool_;
  std::vector<std::byte> raw_;
  std::shared_ptr<const Band> last_;
};

/// Rows that one read of a pass over the whole source should take: whole blocks, about 8 MiB.
[[nodiscard]] std::int64_t rows_per_read(const SourceInfo& info);

}  // namespace isohf
