#pragma once

#include <string>
#include <vector>

#include "gl/gl_objects.h"

namespace isohf::view {

/// Lines of small text over a picture.
class Overlay {
 public:
  Overlay();

  /// Draws the lines from the top left (or, where `right`, top right) corner, on a dark panel.
  /// size  screen pixels of one font pixel, >= 1
  void draw(const std::vector<std::string>& lines, int view_width, int view_height, int size, bool right = false) const;

 private:
  Program program_;
  Texture font_;
  VertexArray array_;
  Buffer corners_;
};

}  // namespace isohf::view
