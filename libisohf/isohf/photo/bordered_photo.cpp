#include "isohf/photo/bordered_photo.h"

#include <algorithm>
#include <vector>

namespace isohf {

BorderedPhoto::BorderedPhoto(PhotoSource& photo) : photo_(photo), info_(photo.info()) {
  info_.width += 2;
  info_.height += 2;
  info_.channels = 4;
  info_.georeference->origin_x -= info_.georeference->spacing_x;
  info_.georeference->origin_y += info_.georeference->spacing_y;
}

void BorderedPhoto::read_window(const Window& window, std::span<std::uint8_t> samples) {
  std::fill(samples.begin(), samples.end(), std::uint8_t{0});
  const PhotoInfo& inner = photo_.info();
  const std::int64_t first_column = std::max<std::int64_t>(window.column, 1);
  const std::int64_t first_row = std::max<std::int64_t>(window.row, 1);
  const std::int64_t columns = std::min(window.column + window.columns, inner.width + 1) - first_column;
  const std::int64_t rows = std::min(window.row + window.rows, inner.height + 1) - first_row;
  if (columns <= 0 || rows <= 0) return;
  const auto channels = static_cast<std::size_t>(inner.channels);
  std::vector<std::uint8_t> read(static_cast<std::size_t>(columns * rows) * channels);
  photo_.read_window({first_column - 1, first_row - 1, columns, rows}, read);
  const std::uint8_t* from = read.data();
  for (std::int64_t row = 0; row < rows; ++row) {
    const std::int64_t place = (first_row - window.row + row) * window.columns + first_column - window.column;
    std::uint8_t* to = samples.data() + 4 * place;
    for (std::int64_t i = 0; i < columns; ++i, to += 4, from += channels) {
      for (std::size_t k = 0; k < 3; ++k) to[k] = from[channels == 1 ? 0 : k];
      to[3] = channels == 4 ? from[3] : std::uint8_t{255};
    }
  }
}

}  // namespace isohf
