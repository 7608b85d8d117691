#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gl/gl_objects.h"

namespace isohf::view {

/// sRGB and opacity, 0 to 1.
struct OverlayColour {
  float red, green, blue, alpha;
};
inline constexpr OverlayColour kInk{0.96F, 0.96F, 0.92F, 1.0F};
inline constexpr OverlayColour kPanel{0.04F, 0.05F, 0.08F, 0.62F};

/// Text and plain shapes over a picture, in pixels from its top left corner. What is added between begin() and finish()
/// is drawn in that order.
class Overlay {
 public:
  Overlay();

  /// size  screen pixels of one font pixel: capitals are seven high
  void begin(int view_width, int view_height, float size);
  void box(float x, float y, float width, float height, const OverlayColour& colour);
  void line(float x0, float y0, float x1, float y1, float width, const OverlayColour& colour);
  /// x, y: the top left corner of the first glyph.
  void text(float x, float y, std::string_view text, const OverlayColour& colour = kInk);
  /// Lines on a dark panel.
  void panel(float x, float y, const std::vector<std::string>& lines);
  void finish();

  [[nodiscard]] float width_of(std::string_view text) const;
  [[nodiscard]] float line_height() const;
  [[nodiscard]] float size() const { return size_; }

 private:
  struct Corner {
    float x, y;
    float u, v;  ///< font texels; u < 0: plain
    OverlayColour colour;
  };
  void quad(const float (&xy)[8], float u, float v, float uw, float vh, const OverlayColour& colour);

  Program program_;
  Texture font_;
  VertexArray array_;
  Buffer buffer_;
  std::vector<Corner> corners_;
  int width_ = 1;
  int height_ = 1;
  float size_ = 1.0F;
};

}  // namespace isohf::view
