#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "isohf/surface/height_source.h"
#include "isohf/surface/tile_cutter.h"

namespace isohf {

/// Whole rows of the source as heights; shared by the tiles that are cut from it.
struct Band {
  std::vector<float> heights;
  std::int64_t columns = 0;
  RowRange rows{0, -1};

  [[nodiscard]] SourceBand view() const { return {{heights.data(), columns, rows.last - rows.first + 1}, rows.first}; }
};

/// Reads a source from North to South in overlapping bands, each source row once.
class BandReader {
 public:
  /// `datum` as in heights_from_samples.
  BandReader(HeightSource& source, double datum) : source_(source), datum_(datum) {}

  /// The band that holds exactly `rows`. Rows that the last band held are copied from it.
  [[nodiscard]] std::shared_ptr<const Band> read(const RowRange& rows);

 private:
  void read_rows(std::int64_t first, std::int64_t count, float* heights);

  HeightSource& source_;
  double datum_;
  std::vector<std::byte> raw_;
  std::shared_ptr<const Band> last_;
};

}  // namespace isohf
