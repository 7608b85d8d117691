#include "gl/overlay.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace isohf::view {
namespace {

// A glyph is seven digits in base 32, its rows from the top; bit 4 is the leftmost pixel. In the order of ASCII, from
// blank to '~'; a separator follows each. Drawn for isohf on squared paper.
constexpr int kGlyphWidth = 5;
constexpr int kGlyphHeight = 7;
constexpr int kFirstGlyph = 32;
constexpr int kGlyphCount = 95;
constexpr std::string_view kGlyphs =
    R"(0000000 4444404 aa00000 aavavaa 4fke5u4 pp248jj cik8lid 4400000 2488842 8422248 04lel40 044v440
0000648 000v000 00000cc 11248gg ehjlphe 4c4444e eh168gv v2421he 26aiv22 vgu11he 68guhhe v122444
ehhehhe ehhf12c 0cc0cc0 0cc0c48 248g842 00v0v00 8421248 eh12404 ehnlnge ehhvhhh uhhuhhu ehggghe
uhhhhhu vgguggv vgguggg ehgnhhf hhhvhhh e44444e 72222ic hikokih ggggggv hrllhhh hppljjh ehhhhhe
uhhuggg ehhhlid uhhukih fgge11u v444444 hhhhhhe hhhhaa4 hhhllrh hha4ahh hha4444 v1248gv e88888e
gg84211 e22222e 4ah0000 000000v 8400000 00e1fhf gguhhhu 00eggge 11fhhhf 00ehvge 688s888 00fhf1e
gguhhhh 40c444e 20622ic ggikoki c44444e 00qllll 00uhhhh 00ehhhe 00uhugg 00fhf11 00mpggg 00fge1u
88s8896 00hhhhf 00hhha4 00hllla 00ha4ah 00hhf1e 00v248v 2448442 4444444 8442448 00dm000)";

constexpr const char* kVertex = R"glsl(#version 330 core
layout(location = 0) in vec2 pixel;
layout(location = 1) in vec2 glyph;
uniform vec2 view_size;
out vec2 v_glyph;
void main() {
  v_glyph = glyph;
  gl_Position = vec4(pixel.x / view_size.x * 2.0 - 1.0, 1.0 - pixel.y / view_size.y * 2.0, 0.0, 1.0);
}
)glsl";

constexpr const char* kFragment = R"glsl(#version 330 core
in vec2 v_glyph;
out vec4 colour;
uniform sampler2D font;
void main() {
  // A negative x marks the panel behind the text.
  if (v_glyph.x < 0.0) {
    colour = vec4(0.04, 0.05, 0.08, 0.62);
    return;
  }
  if (texelFetch(font, ivec2(v_glyph), 0).r < 0.5) discard;
  colour = vec4(0.96, 0.96, 0.92, 1.0);
}
)glsl";

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

Overlay::Overlay() : program_("overlay", kVertex, kFragment) {
  constexpr int kRows = (kGlyphCount + kColumns - 1) / kColumns;
  constexpr int kWidth = kColumns * kGlyphWidth;
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(kWidth * kRows * kGlyphHeight), 0);
  for (int glyph = 0; glyph < kGlyphCount; ++glyph) {
    for (int y = 0; y < kGlyphHeight; ++y) {
      const char digit = kGlyphs[static_cast<std::size_t>(glyph * (kGlyphHeight + 1) + y)];
      const int row = digit <= '9' ? digit - '0' : digit - 'a' + 10;
      for (int x = 0; x < kGlyphWidth; ++x) {
        if ((row >> (kGlyphWidth - 1 - x) & 1) == 0) continue;
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
        const int column = glyph % kColumns;
        const int row = glyph / kColumns;
        add_quad(corners, x, y, kGlyphWidth * scale, kGlyphHeight * scale, static_cast<float>(column * kGlyphWidth),
                 static_cast<float>(row * kGlyphHeight), kGlyphWidth, kGlyphHeight);
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
