#include "gl/overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace isohf::view {
namespace {

// A glyph is seven digits in base 32, its rows from the top; bit 4 is the leftmost pixel. In the order of ASCII, from
// blank to '~'; a separator follows each. Drawn for isohf on squared paper: strokes join neighbouring pixels, straight
// before slanting, so that letters are smooth at any size.
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
gg84211 e22222e 4ah0000 000000v 8400000 00e1fhf gguhhhu 00eggge 11fhhhf 00ehvge 688s888 fhhhf1e
gguhhhh 40c444e 20622ic ggikoki c44444e 00qllll 00uhhhh 00ehhhe uhhhugg fhhhf11 00mpggg 00fge1u
88s8896 00hhhhf 00hhha4 00hllla 00ha4ah hhhhf1e 00v248v 2448442 4444444 8442448 00dm000)";
/// Letters that begin where small ones do, and end below the line.
constexpr std::string_view kDescending = "gpqy";
constexpr int kDescent = 2;

constexpr int kTexels = 4;  ///< of the font texture in a font pixel
constexpr int kCellWidth = (kGlyphWidth + 2) * kTexels;
constexpr int kCellHeight = (kGlyphHeight + kDescent + 2) * kTexels;
constexpr int kColumns = 16;  ///< glyphs a row of the font texture
constexpr int kAdvance = kGlyphWidth + 1;
constexpr int kLeading = kGlyphHeight + 4;
constexpr float kStroke = 0.48F;  ///< half a stroke's width, font pixels

constexpr const char* kOverlayVertex = R"glsl(#version 330 core
layout(location = 0) in vec2 pixel;
layout(location = 1) in vec2 glyph;
layout(location = 2) in vec4 tint;
uniform vec2 view_size;
uniform vec2 font_size;
out vec2 v_glyph;
out vec4 v_tint;
void main() {
  v_glyph = glyph.x < 0.0 ? vec2(-1.0) : glyph / font_size;
  v_tint = tint;
  gl_Position = vec4(pixel.x / view_size.x * 2.0 - 1.0, 1.0 - pixel.y / view_size.y * 2.0, 0.0, 1.0);
}
)glsl";

constexpr const char* kOverlayFragment = R"glsl(#version 330 core
in vec2 v_glyph;
in vec4 v_tint;
out vec4 colour;
uniform sampler2D font;  // 0.5 on a stroke's rim, more within
void main() {
  colour = v_tint;
  float inside = texture(font, max(v_glyph, 0.0)).r;
  float soft = max(fwidth(inside), 1e-4);
  if (v_glyph.x > -0.5) colour.a *= clamp((inside - 0.5) / soft + 0.5, 0.0, 1.0);
}
)glsl";

struct Stroke {
  float x0, y0, x1, y1;
};

std::vector<Stroke> strokes_of(int glyph) {
  const auto is_set = [glyph](int x, int y) {
    if (x < 0 || x >= kGlyphWidth || y < 0 || y >= kGlyphHeight) return false;
    const char digit = kGlyphs[static_cast<std::size_t>(glyph * (kGlyphHeight + 1) + y)];
    const int row = digit <= '9' ? digit - '0' : digit - 'a' + 10;
    return (row >> (kGlyphWidth - 1 - x) & 1) != 0;
  };
  const bool descends = kDescending.find(static_cast<char>(kFirstGlyph + glyph)) != std::string_view::npos;
  const float down = descends ? kDescent : 0;
  std::vector<Stroke> strokes;
  for (int y = 0; y < kGlyphHeight; ++y) {
    for (int x = 0; x < kGlyphWidth; ++x) {
      if (!is_set(x, y)) continue;
      const auto join = [&](int dx, int dy) {
        const auto from_x = static_cast<float>(x);
        const float from_y = static_cast<float>(y) + down;
        strokes.push_back({from_x, from_y, from_x + static_cast<float>(dx), from_y + static_cast<float>(dy)});
      };
      join(0, 0);
      if (is_set(x + 1, y)) join(1, 0);
      if (is_set(x, y + 1)) join(0, 1);
      for (const int dx : {-1, 1}) {
        if (is_set(x + dx, y + 1) && !is_set(x + dx, y) && !is_set(x, y + 1)) join(dx, 1);
      }
    }
  }
  return strokes;
}

float distance(const Stroke& stroke, float x, float y) {
  const float dx = stroke.x1 - stroke.x0;
  const float dy = stroke.y1 - stroke.y0;
  const float square = dx * dx + dy * dy;
  const float along = square > 0.0F ? ((x - stroke.x0) * dx + (y - stroke.y0) * dy) / square : 0.0F;
  const float t = std::clamp(along, 0.0F, 1.0F);
  return std::hypot(x - stroke.x0 - t * dx, y - stroke.y0 - t * dy);
}

}  // namespace

Overlay::Overlay() : program_("overlay", kOverlayVertex, kOverlayFragment) {
  constexpr int kRows = (kGlyphCount + kColumns - 1) / kColumns;
  constexpr int kWidth = kColumns * kCellWidth;
  constexpr int kHeight = kRows * kCellHeight;
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(kWidth * kHeight), 0);
  for (int glyph = 0; glyph < kGlyphCount; ++glyph) {
    const std::vector<Stroke> strokes = strokes_of(glyph);
    for (int y = 0; y < kCellHeight; ++y) {
      for (int x = 0; x < kCellWidth; ++x) {
        const auto place = [](int texel) { return (static_cast<float>(texel) + 0.5F) / kTexels - 1.5F; };
        float nearest = 2.0F;
        for (const Stroke& stroke : strokes) nearest = std::min(nearest, distance(stroke, place(x), place(y)));
        const int at = (glyph / kColumns * kCellHeight + y) * kWidth + glyph % kColumns * kCellWidth + x;
        texels[static_cast<std::size_t>(at)] =
            static_cast<std::uint8_t>(255.0F * std::clamp(0.5F + (kStroke - nearest) * 0.5F, 0.0F, 1.0F));
      }
    }
  }
  glBindTexture(GL_TEXTURE_2D, font_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, kWidth, kHeight, 0, GL_RED, GL_UNSIGNED_BYTE, texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.get());
  for (GLuint attribute = 0, first = 0; attribute < 3; first += attribute == 2 ? 4 : 2, ++attribute) {
    glVertexAttribPointer(attribute, attribute == 2 ? 4 : 2, GL_FLOAT, GL_FALSE, sizeof(Corner),
                          reinterpret_cast<const void*>(first * sizeof(float)));
    glEnableVertexAttribArray(attribute);
  }
  glBindVertexArray(0);
  program_.use();
  glUniform2f(program_.uniform("font_size"), kWidth, kHeight);
  glUniform1i(program_.uniform("font"), 0);
}

void Overlay::begin(int view_width, int view_height, float size) {
  corners_.clear();
  width_ = view_width;
  height_ = view_height;
  size_ = size;
}

float Overlay::width_of(std::string_view text) const {
  return static_cast<float>(text.size() * kAdvance) * size_;
}

float Overlay::line_height() const {
  return kLeading * size_;
}

void Overlay::quad(const float (&xy)[8], float u, float v, float uw, float vh, const OverlayColour& colour) {
  const Corner a{xy[0], xy[1], u, v, colour};
  const Corner b{xy[2], xy[3], u + uw, v, colour};
  const Corner c{xy[4], xy[5], u, v + vh, colour};
  const Corner d{xy[6], xy[7], u + uw, v + vh, colour};
  corners_.insert(corners_.end(), {a, b, c, c, b, d});
}

void Overlay::box(float x, float y, float width, float height, const OverlayColour& colour) {
  quad({x, y, x + width, y, x, y + height, x + width, y + height}, -1.0F, -1.0F, 0.0F, 0.0F, colour);
}

void Overlay::line(float x0, float y0, float x1, float y1, float width, const OverlayColour& colour) {
  const float length = std::max(std::hypot(x1 - x0, y1 - y0), 1e-6F);
  const float dx = -(y1 - y0) / length * width / 2.0F;
  const float dy = (x1 - x0) / length * width / 2.0F;
  quad({x0 + dx, y0 + dy, x1 + dx, y1 + dy, x0 - dx, y0 - dy, x1 - dx, y1 - dy}, -1.0F, -1.0F, 0.0F, 0.0F, colour);
}

void Overlay::text(float x, float y, std::string_view text, const OverlayColour& colour) {
  // A glyph's cell reaches a font pixel beyond it on all sides.
  const float width = static_cast<float>(kCellWidth) / kTexels * size_;
  const float height = static_cast<float>(kCellHeight) / kTexels * size_;
  for (const char character : text) {
    const int glyph = character - kFirstGlyph;
    if (glyph > 0 && glyph < kGlyphCount) {
      const float left = x - size_;
      const float top = y - size_;
      quad({left, top, left + width, top, left, top + height, left + width, top + height},
           static_cast<float>(glyph % kColumns * kCellWidth), static_cast<float>(glyph / kColumns * kCellHeight),
           kCellWidth, kCellHeight, colour);
    }
    x += kAdvance * size_;
  }
}

void Overlay::panel(float x, float y, const std::vector<std::string>& lines) {
  float widest = 0.0F;
  for (const std::string& line : lines) widest = std::max(widest, width_of(line));
  const float margin = 4.0F * size_;
  const float width = widest + 2.0F * margin;
  const float height = static_cast<float>(lines.size()) * line_height() + 2.0F * margin - 3.0F * size_;
  box(x, y, width, height, kPanel);
  float at = y + margin;
  for (const std::string& line : lines) {
    text(x + margin, at, line);
    at += line_height();
  }
}

void Overlay::finish() {
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners_.size() * sizeof(Corner)), corners_.data(),
               GL_STREAM_DRAW);
  program_.use();
  glUniform2f(program_.uniform("view_size"), static_cast<float>(width_), static_cast<float>(height_));
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, font_.get());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners_.size()));
  glDisable(GL_BLEND);
  glBindTexture(GL_TEXTURE_2D, 0);
  glBindVertexArray(0);
}

}  // namespace isohf::view
