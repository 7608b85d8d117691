#include "gl/overlay.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "gl/font.h"
#include "gl/shaders.h"

namespace isohf::view {
namespace {

constexpr int kColumns = 16;  ///< glyphs a row of the font texture
constexpr int kAdvance = kGlyphWidth + 1;
constexpr int kLeading = kGlyphHeight + 3;

struct Corner {
  float x, y;  ///< pixels from the top left
  float u, v;  ///< font texels; u < 0: panel
};

void add_quad(std::vector<Corner>& out, float x, float y, float width, float height, float u, float v, float uw,
              float vh) {
  const Corner a{x, y, u, v};
  const Corner b{x + width, y, u + uw, v};
  const Corner c{x, y + height, u, v + vh};
  const Corner d{x + width, y + height, u + uw, v + vh};
  out.insert(out.end(), {a, b, c, c, b, d});
}

}  // namespace

Overlay::Overlay() : program_("overlay", overlay_vertex_shader(), overlay_fragment_shader()) {
  constexpr int kRows = (kGlyphCount + kColumns - 1) / kColumns;
  constexpr int kWidth = kColumns * kGlyphWidth;
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(kWidth * kRows * kGlyphHeight), 0);
  for (int glyph = 0; glyph < kGlyphCount; ++glyph) {
    const auto rows = glyph_rows(static_cast<char>(kFirstGlyph + glyph));
    for (int y = 0; y < kGlyphHeight; ++y) {
      for (int x = 0; x < kGlyphWidth; ++x) {
        if ((rows[static_cast<std::size_t>(y)] >> (kGlyphWidth - 1 - x) & 1) == 0) continue;
        const int at = (glyph / kColumns * kGlyphHeight + y) * kWidth + glyph % kColumns * kGlyphWidth + x;
        texels[static_cast<std::size_t>(at)] = 255;
      }
    }
  }
  glBindTexture(GL_TEXTURE_2D, font_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, kWidth, kRows * kGlyphHeight, 0, GL_RED, GL_UNSIGNED_BYTE, texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, corners_.get());
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, sizeof(Corner), nullptr);
  glVertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, sizeof(Corner), reinterpret_cast<const void*>(2 * sizeof(float)));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glBindVertexArray(0);
}

void Overlay::draw(const std::vector<std::string>& lines, int view_width, int view_height, int size, bool right) const {
  std::size_t longest = 0;
  for (const std::string& line : lines) longest = std::max(longest, line.size());
  const auto scale = static_cast<float>(size);
  const float margin = 4.0F * scale;
  const float width = static_cast<float>(longest) * kAdvance * scale + 2.0F * margin;
  const float height = static_cast<float>(lines.size()) * kLeading * scale + 2.0F * margin;
  const float left = right ? static_cast<float>(view_width) - width - margin : margin;
  std::vector<Corner> corners;
  add_quad(corners, left, margin, width, height, -1.0F, 0.0F, 0.0F, 0.0F);
  float y = 2.0F * margin;
  for (const std::string& line : lines) {
    float x = left + margin;
    for (const char character : line) {
      const int glyph = character - kFirstGlyph;
      if (glyph > 0 && glyph < kGlyphCount) {
        add_quad(corners, x, y, kGlyphWidth * scale, kGlyphHeight * scale,
                 static_cast<float>(glyph % kColumns * kGlyphWidth),
                 static_cast<float>(glyph / kColumns * kGlyphHeight), kGlyphWidth, kGlyphHeight);
      }
      x += kAdvance * scale;
    }
    y += kLeading * scale;
  }
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, corners_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(Corner)), corners.data(),
               GL_STREAM_DRAW);
  program_.use();
  glUniform2f(program_.uniform("view_size"), static_cast<float>(view_width), static_cast<float>(view_height));
  glUniform1i(program_.uniform("font"), 0);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, font_.get());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners.size()));
  glDisable(GL_BLEND);
  glBindTexture(GL_TEXTURE_2D, 0);
  glBindVertexArray(0);
}

}  // namespace isohf::view
