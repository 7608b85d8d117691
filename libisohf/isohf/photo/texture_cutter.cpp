#include "isohf/photo/texture_cutter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "isohf/base/assert.h"
#include "isohf/photo/srgb.h"

namespace isohf {
namespace {

/// Photo rows that are read at once.
constexpr std::int64_t kRowsAtOnce = 32;
/// Boxes narrower than this, in pixels, are points.
constexpr double kPoint = 1e-6;

/// The pixels that make texels first...first+count-1 of one axis, and their weights.
struct Taps {
  struct Texel {
    std::int64_t first_pixel;
    std::int64_t last_pixel;
    std::size_t first_weight;
  };
  std::vector<Texel> texels;
  std::vector<float> weights;
};

/// Integral of the hat function max(0, 1 - |t|) from -1 to t.
double hat_integral(double t) {
  if (t <= -1.0) return 0.0;
  if (t >= 1.0) return 1.0;
  return t < 0.0 ? 0.5 * (t + 1.0) * (t + 1.0) : 1.0 - 0.5 * (1.0 - t) * (1.0 - t);
}

/// Weight of pixel k in the mean, over a box `width` wide around `middle`, of the linearly interpolated pixels.
double weight_of(double k, double middle, double width) {
  if (width < kPoint) return std::max(0.0, 1.0 - std::abs(middle - k));
  return (hat_integral(middle + 0.5 * width - k) - hat_integral(middle - 0.5 * width - k)) / width;
}

/// The pixels below a texel at `middle`; those beyond the photo count as its border.
struct PixelRange {
  std::int64_t low;  ///< may lie outside the photo
  std::int64_t high;
  std::int64_t first;  ///< inside
  std::int64_t last;
};

PixelRange pixels_below(double middle, double width, std::int64_t pixels) {
  const auto beyond = static_cast<double>(pixels);  // all places farther out are alike
  const auto low = static_cast<std::int64_t>(std::clamp(std::floor(middle - 0.5 * width), -beyond - 2.0, 2.0 * beyond));
  const auto high =
      static_cast<std::int64_t>(std::clamp(std::floor(middle + 0.5 * width) + 1.0, -beyond - 2.0, 2.0 * beyond));
  return {low, high, std::clamp<std::int64_t>(low, 0, pixels - 1), std::clamp<std::int64_t>(high, 0, pixels - 1)};
}

/// `place(i)` is texel i's place in pixels, `step` the distance of two, `pixels` how many the photo has.
template <typename Place>
Taps make_taps(const Place& place, std::int64_t first, std::int64_t count, double step, std::int64_t pixels) {
  Taps taps;
  taps.texels.reserve(static_cast<std::size_t>(count));
  const double width = std::max(0.0, step - 1.0);
  std::vector<double> weights;
  for (std::int64_t i = 0; i < count; ++i) {
    const double middle = place(first + i);
    const PixelRange range = pixels_below(middle, width, pixels);
    taps.texels.push_back({range.first, range.last, taps.weights.size()});
    if (range.first == range.last) {
      taps.weights.push_back(1.0F);
      continue;
    }
    weights.assign(static_cast<std::size_t>(range.last - range.first + 1), 0.0);
    for (std::int64_t k = range.low; k <= range.high; ++k) {
      const std::int64_t inside = std::clamp(k, range.first, range.last);
      weights[static_cast<std::size_t>(inside - range.first)] += weight_of(static_cast<double>(k), middle, width);
    }
    for (const double weight : weights) taps.weights.push_back(static_cast<float>(weight));
  }
  return taps;
}

/// Rows of the photo, averaged along x into texels, in light. Rows are asked for from North to South.
class TexelRows {
 public:
  TexelRows(PhotoSource& photo, Taps columns, std::size_t rows_kept)
      : photo_(photo),
        channels_(static_cast<std::size_t>(photo.info().channels)),
        columns_(std::move(columns)),
        row_size_(columns_.texels.size() * channels_),
        ring_(rows_kept + static_cast<std::size_t>(kRowsAtOnce)),
        first_pixel_(columns_.texels.front().first_pixel),
        pixels_(columns_.texels.back().last_pixel - first_pixel_ + 1) {
    for (std::vector<float>& row : ring_) row.resize(row_size_);
    light_.resize(static_cast<std::size_t>(pixels_) * channels_);
  }

  /// Makes sure that the photo's rows up to `last` are there, from `first` on.
  void need(std::int64_t first, std::int64_t last) {
    next_ = std::max(next_, first);
    while (next_ <= last) {
      const std::int64_t count = std::min(kRowsAtOnce, photo_.info().height - next_);
      raw_.resize(static_cast<std::size_t>(pixels_ * count) * channels_);
      photo_.read_window({first_pixel_, next_, pixels_, count}, raw_);
      for (std::int64_t r = 0; r < count; ++r) {
        to_light(raw_.data() + static_cast<std::size_t>(r * pixels_) * channels_);
        average(slot(next_ + r));
      }
      next_ += count;
    }
  }

  [[nodiscard]] const std::vector<float>& row(std::int64_t r) const {
    return ring_[static_cast<std::size_t>(r) % ring_.size()];
  }
  [[nodiscard]] std::size_t row_size() const { return row_size_; }

 private:
  std::vector<float>& slot(std::int64_t r) { return ring_[static_cast<std::size_t>(r) % ring_.size()]; }

  /// Light; with alpha multiplied by it.
  void to_light(const std::uint8_t* raw) {
    const std::array<float, 256>& table = linear_from_srgb();
    if (channels_ < 4) {
      for (std::size_t i = 0; i < light_.size(); ++i) light_[i] = table[raw[i]];
      return;
    }
    for (std::size_t i = 0; i < light_.size(); i += 4) {
      const float alpha = static_cast<float>(raw[i + 3]) / 255.0F;
      for (std::size_t c = 0; c < 3; ++c) light_[i + c] = table[raw[i + c]] * alpha;
      light_[i + 3] = alpha;
    }
  }

  void average(std::vector<float>& out) const {
    if (channels_ == 1) average_channels<1>(out.data());
    if (channels_ == 3) average_channels<3>(out.data());
    if (channels_ == 4) average_channels<4>(out.data());
  }

  template <std::size_t kChannels>
  void average_channels(float* out) const {
    for (const Taps::Texel& texel : columns_.texels) {
      const float* weight = columns_.weights.data() + texel.first_weight;
      const float* in = light_.data() + static_cast<std::size_t>(texel.first_pixel - first_pixel_) * kChannels;
      std::array<float, kChannels> sum{};
      for (std::int64_t k = texel.first_pixel; k <= texel.last_pixel; ++k, in += kChannels, ++weight) {
        for (std::size_t c = 0; c < kChannels; ++c) sum[c] += *weight * in[c];
      }
      for (std::size_t c = 0; c < kChannels; ++c) *out++ = sum[c];
    }
  }

  PhotoSource& photo_;
  std::size_t channels_;
  Taps columns_;
  std::size_t row_size_;
  std::vector<std::vector<float>> ring_;
  std::int64_t first_pixel_;
  std::int64_t pixels_;
  std::int64_t next_ = 0;
  std::vector<std::uint8_t> raw_;
  std::vector<float> light_;
};

void put_row(const std::vector<float>& light, int channels, std::uint8_t* out) {
  if (channels < 4) {
    for (const float value : light) *out++ = srgb_from_linear(value);
    return;
  }
  for (std::size_t i = 0; i < light.size(); i += 4) {
    const float alpha = std::clamp(light[i + 3], 0.0F, 1.0F);
    for (std::size_t c = 0; c < 3; ++c) *out++ = srgb_from_linear(alpha > 0.0F ? light[i + c] / alpha : 0.0F);
    *out++ = static_cast<std::uint8_t>(alpha * 255.0F + 0.5F);
  }
}

/// One mip level, fed with rows of level 0 from North to South, those of the margins included.
class Level {
 public:
  Level(int finest, int level, int margin, int channels)
      : finest_(finest),
        level_(level),
        half_((1 << level) / 2),
        margin_(margin),
        size_(finest >> level),
        channels_(static_cast<std::size_t>(channels)),
        share_(1.0F / static_cast<float>(1 << level)),
        picture_(size_, size_, channels),
        row_(picture_.row_bytes()),
        north_(row_.size()),
        inner_(row_.size()),
        south_(row_.size()) {}

  /// `texels`: level 0's row `y`, -margin <= y < finest + margin, with the same margins at its ends; `finer` the same
  /// row as the next finer level has it, nullptr for level 0.
  void add(int y, const std::vector<float>& texels, const Level* finer) {
    reduce(texels, finer);
    const int last = finest_ - 1;
    if (y < -half_ || y > last + half_) return;
    if (y <= half_) add_to(north_, edge_weight(y));
    if (y >= last - half_) add_to(south_, edge_weight(y - last));
    if (y == half_) put_row(north_, picture_.channels, picture_.row(0));
    if (y == last + half_) put_row(south_, picture_.channels, picture_.row(size_ - 1));
    const int j = y < 0 ? 0 : y >> level_;
    if (j < 1 || j > size_ - 2) return;
    add_to(inner_, share_);
    if (((y + 1) >> level_) == j) return;
    put_row(inner_, picture_.channels, picture_.row(j));
    std::fill(inner_.begin(), inner_.end(), 0.0F);
  }

  [[nodiscard]] Picture take() { return std::move(picture_); }

 private:
  /// Weight in a border texel of the row or column `distance` from the edge.
  [[nodiscard]] float edge_weight(int distance) const {
    return half_ > 0 && std::abs(distance) == half_ ? 0.5F * share_ : share_;
  }

  void add_to(std::vector<float>& sum, float weight) const {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * row_[i];
  }

  /// Means along x of a row of level 0.
  void reduce(const std::vector<float>& texels, const Level* finer) {
    const std::size_t inner = row_.size() - 2 * channels_;
    float* out = row_.data() + channels_;
    if (finer == nullptr) {
      std::copy_n(texels.data() + (static_cast<std::size_t>(margin_) + 1) * channels_, inner, out);
    } else {
      const float* in = finer->row_.data() + 2 * channels_;
      for (std::size_t i = 0; i < inner; i += channels_, in += 2 * channels_) {
        for (std::size_t c = 0; c < channels_; ++c) out[i + c] = 0.5F * (in[c] + in[c + channels_]);
      }
    }
    reduce_edge(texels, 0, row_.data());
    reduce_edge(texels, finest_ - 1, row_.data() + row_.size() - channels_);
  }

  void reduce_edge(const std::vector<float>& texels, int edge, float* sum) const {
    std::fill(sum, sum + channels_, 0.0F);
    for (int distance = -half_; distance <= half_; ++distance) {
      const float weight = edge_weight(distance);
      const float* in = texels.data() + static_cast<std::size_t>(margin_ + edge + distance) * channels_;
      for (std::size_t c = 0; c < channels_; ++c) sum[c] += weight * in[c];
    }
  }

  int finest_;
  int level_;
  int half_;
  int margin_;
  int size_;
  std::size_t channels_;
  float share_;  ///< 2^-level, of a row or column
  Picture picture_;
  std::vector<float> row_;  ///< the row of level 0 last added
  std::vector<float> north_;
  std::vector<float> inner_;
  std::vector<float> south_;
};

}  // namespace

TextureCutter::TextureCutter(const TileGrid& grid, const PhotoFrame& frame, const TextureShape& shape)
    : shape_(shape),
      start_x_(-frame.first_pixel_x / frame.spacing_x),
      start_z_(-frame.first_pixel_z / frame.spacing_z),
      step_x_(grid.extent_x() / (shape.size - 1) / frame.spacing_x),
      step_z_(grid.extent_z() / (shape.size - 1) / frame.spacing_z) {
  ISOHF_ASSERT(shape.levels >= 1 && (shape.size >> (shape.levels - 1)) >= 4);
}

bool TextureCutter::touches(const PhotoInfo& photo, TileIndex tile) const {
  const std::int64_t span = shape_.size - 1;
  return pixel_x((tile.column + 1) * span) > -0.5 && pixel_z((tile.row + 1) * span) > -0.5 &&
         pixel_x(tile.column * span) < static_cast<double>(photo.width) - 0.5 &&
         pixel_z(tile.row * span) < static_cast<double>(photo.height) - 0.5;
}

std::pair<std::int64_t, std::int64_t> TextureCutter::rows_needed(const PhotoInfo& photo, std::int64_t tile_row) const {
  const int margin = (1 << (shape_.levels - 1)) / 2;
  const std::int64_t first = tile_row * (shape_.size - 1) - margin;
  const double width = std::max(0.0, step_z_ - 1.0);
  return {pixels_below(pixel_z(first), width, photo.height).first,
          pixels_below(pixel_z(first + shape_.size - 1 + 2 * margin), width, photo.height).last};
}

std::vector<Picture> TextureCutter::cut(PhotoSource& photo, TileIndex tile) const {
  const PhotoInfo& info = photo.info();
  const int margin = (1 << (shape_.levels - 1)) / 2;
  const int count = shape_.size + 2 * margin;
  const std::int64_t first_column = tile.column * (shape_.size - 1) - margin;
  const std::int64_t first_row = tile.row * (shape_.size - 1) - margin;
  Taps columns =
      make_taps([this](std::int64_t texel) { return pixel_x(texel); }, first_column, count, step_x_, info.width);
  const Taps rows =
      make_taps([this](std::int64_t texel) { return pixel_z(texel); }, first_row, count, step_z_, info.height);
  std::int64_t most = 1;
  for (const Taps::Texel& texel : rows.texels) most = std::max(most, texel.last_pixel - texel.first_pixel + 1);
  TexelRows source(photo, std::move(columns), static_cast<std::size_t>(most));

  std::vector<Level> levels;
  for (int level = 0; level < shape_.levels; ++level) levels.emplace_back(shape_.size, level, margin, info.channels);
  std::vector<float> row(source.row_size());
  for (int i = 0; i < count; ++i) {
    const Taps::Texel& texel = rows.texels[static_cast<std::size_t>(i)];
    source.need(texel.first_pixel, texel.last_pixel);
    std::fill(row.begin(), row.end(), 0.0F);
    const float* weight = rows.weights.data() + texel.first_weight;
    for (std::int64_t r = texel.first_pixel; r <= texel.last_pixel; ++r, ++weight) {
      const std::vector<float>& in = source.row(r);
      for (std::size_t k = 0; k < row.size(); ++k) row[k] += *weight * in[k];
    }
    for (std::size_t l = 0; l < levels.size(); ++l) levels[l].add(i - margin, row, l == 0 ? nullptr : &levels[l - 1]);
  }
  std::vector<Picture> pictures;
  pictures.reserve(levels.size());
  for (Level& level : levels) pictures.push_back(level.take());
  return pictures;
}

}  // namespace isohf
