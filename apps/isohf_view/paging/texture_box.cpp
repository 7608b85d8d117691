#include "paging/texture_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "gl/offscreen.h"
#include "isohf/error.h"

namespace isohf::view {
namespace {

/// What a texture takes while it is on its way, in bytes of it on the GPU: these, and on the CPU its pixels as decoded
/// and as RGBA, and its member inflated.
constexpr std::uint64_t kOnTheWay = 4;
constexpr float kMostAnisotropy = 8.0F;

/// A software rasteriser would spend nearly all its time on it.
float best_anisotropy() {
  if (is_software_driver() || !epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic")) return 1.0F;
  GLfloat most = 1.0F;
  glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &most);
  return std::min(most, kMostAnisotropy);
}

Texture texture_from(const std::vector<Picture>& levels, float anisotropy) {
  Texture texture;
  glBindTexture(GL_TEXTURE_2D, texture.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  GLint level = 0;
  for (const Picture& picture : levels) {
    glTexImage2D(GL_TEXTURE_2D, level++, GL_RGBA8, picture.width, picture.height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 picture.samples.data());
  }
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, level - 1);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  if (anisotropy > 1.0F) glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAX_ANISOTROPY_EXT, anisotropy);
  glBindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace

Picture read_texels(const TileSource& source, TileIndex tile, int level) {
  Picture picture = source.read_texture(tile, level);
  for (std::size_t i = 0; i < picture.samples.size(); i += 4) {
    const unsigned alpha = picture.samples[i + 3];
    for (std::size_t c = 0; alpha != 255 && c < 3; ++c) {
      picture.samples[i + c] = static_cast<std::uint8_t>((picture.samples[i + c] * alpha + 127) / 255);
    }
  }
  return picture;
}

TextureBox::Chain TextureBox::load(const TileSource& source, const Request& request) {
  Chain chain{request, {}, {}};
  try {
    for (int level = request.finest; level < source.textures()->levels; ++level) {
      chain.levels.push_back(read_texels(source, request.tile, level));
    }
  } catch (const std::exception& error) {
    chain.error = error.what();
    chain.levels.clear();
  }
  return chain;
}

TextureBox::TextureBox(const TileSource& source, std::uint64_t memory_bytes, Workers& workers)
    : source_(source),
      levels_(source.textures()->levels),
      anisotropy_(best_anisotropy()),
      in_flight_limit_(2 * workers.count()),
      memory_bytes_(memory_bytes),
      loader_([&source](const Request& request) { return load(source, request); }, workers) {
  // Half is for what is wanted; the rest holds one texture on its way.
  while (finest_ < levels_ - 1 && 2 * kOnTheWay * bytes_from(finest_) > memory_bytes) ++finest_;
  const std::uint64_t least = 2 * kOnTheWay * bytes_from(levels_ - 1);
  if (memory_bytes < least) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("memory for textures: {} bytes, {} are required", memory_bytes, least));
  }
}

std::uint64_t TextureBox::bytes_from(int level) const {
  std::uint64_t bytes = 0;
  for (int l = level; l < levels_; ++l) {
    const auto size = static_cast<std::uint64_t>(source_.textures()->level_size(l));
    bytes += 4 * size * size;
  }
  return bytes;
}

void TextureBox::release(Entry& entry) {
  if (entry.texture) resident_bytes_ -= bytes_from(entry.finest);
  entry.texture.reset();
}

void TextureBox::enter(const TileRange& range) {
  for (auto at = entries_.begin(); at != entries_.end();) {
    // What is on its way stays until it has arrived: it counts.
    if (range.contains(at->second.tile) || at->second.requested) {
      ++at;
    } else {
      release(at->second);
      at = entries_.erase(at);
    }
  }
  for_each_tile(range, [&](TileIndex tile) {
    if (source_.has_texture(tile)) entries_[source_.grid().flat_index(tile)].tile = tile;
  });
}

/// The wanted levels. Where they do not fit, all texels grow by the same factor until they do.
void TextureBox::decide(const ViewState& view) {
  const TileGrid& grid = source_.grid();
  const double texel = std::max(grid.extent_x(), grid.extent_z()) / (source_.textures()->size - 1);
  for (auto& [flat, entry] : entries_) {
    entry.distance = tile_volume(grid, entry.tile, source_.bounds(entry.tile), view).distance();
  }
  for (double coarser = 0.0;; coarser += 0.25) {
    std::uint64_t sum = 0;
    for (auto& [flat, entry] : entries_) {
      // Texels of level 0 under a pixel.
      const double texels = std::max(entry.distance / view.focal_px() / texel, 1e-9);
      entry.wanted = static_cast<int>(std::clamp(std::floor(std::log2(texels) + coarser), static_cast<double>(finest_),
                                                 static_cast<double>(levels_ - 1)));
      sum += bytes_from(entry.wanted);
    }
    if (sum <= memory_bytes_ / 2) return;
    if (sum == entries_.size() * bytes_from(levels_ - 1)) break;
  }
  // Not even the coarsest level of all: the nearest tiles get one.
  std::vector<Entry*> all;
  for (auto& [flat, entry] : entries_) all.push_back(&entry);
  std::stable_sort(all.begin(), all.end(), [](const Entry* a, const Entry* b) { return a->distance < b->distance; });
  for (std::size_t i = memory_bytes_ / 2 / bytes_from(levels_ - 1); i < all.size(); ++i) all[i]->wanted = levels_;
}

void TextureBox::upload(std::uint64_t budget) {
  loader_.collect(waiting_);
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const Chain& chain = waiting_.front();
    const std::uint64_t bytes = bytes_from(chain.request.finest);
    if (figures_.upload_bytes > 0 && figures_.upload_bytes + bytes > budget) return;
    Entry& entry = entries_.at(source_.grid().flat_index(chain.request.tile));  // requested entries stay
    entry.requested = false;
    on_the_way_bytes_ -= bytes;
    if (chain.levels.empty()) {
      entry.broken = true;
      if (!error_) error_ = chain.error;
      continue;
    }
    release(entry);
    entry.texture = texture_from(chain.levels, anisotropy_);
    entry.finest = chain.request.finest;
    resident_bytes_ += bytes;
    figures_.upload_bytes += bytes;
  }
}

/// Requests what is due, the nearest first. What is finer than wanted makes room where it must, the farthest first.
void TextureBox::request() {
  std::vector<Entry*> due;
  std::vector<Entry*> spare;
  for (auto& [flat, entry] : entries_) {
    if (entry.requested) continue;
    if (is_due(entry)) due.push_back(&entry);
    if (entry.texture && entry.finest < entry.wanted) spare.push_back(&entry);
  }
  const auto nearer = [](const Entry* a, const Entry* b) { return a->distance < b->distance; };
  std::stable_sort(due.begin(), due.end(), nearer);
  std::stable_sort(spare.begin(), spare.end(), nearer);
  for (Entry* entry : due) {
    if (loader_.in_flight() >= in_flight_limit_) return;
    const std::uint64_t bytes = bytes_from(entry->wanted);
    const auto fits = [&] { return resident_bytes_ + kOnTheWay * (on_the_way_bytes_ + bytes) <= memory_bytes_; };
    for (; !fits() && on_the_way_bytes_ == 0 && !spare.empty(); spare.pop_back()) release(*spare.back());
    if (!fits()) return;
    entry->requested = true;
    on_the_way_bytes_ += bytes;
    loader_.request({entry->tile, entry->wanted});
  }
}

void TextureBox::update(const TileRange& range, const ViewState& view, std::uint64_t upload_bytes) {
  figures_ = {};
  enter(range);
  decide(view);
  upload(upload_bytes);
  request();
  for (const auto& [flat, entry] : entries_) {
    figures_.resident += entry.texture ? 1 : 0;
    figures_.to_come += is_due(entry) ? 1 : 0;
  }
  figures_.resident_bytes = resident_bytes_ + kOnTheWay * on_the_way_bytes_;
}

void TextureBox::finish(const TileRange& range, const ViewState& view, const std::function<void()>& poll) {
  const auto is_complete = [&] {
    update(range, view, std::uint64_t{64} << 20U);
    return figures_.to_come == 0;
  };
  update_until_complete(is_complete, poll);
}

GLuint TextureBox::texture(TileIndex tile) const {
  const auto found = entries_.find(source_.grid().flat_index(tile));
  return found != entries_.end() && found->second.texture ? found->second.texture->get() : 0;
}

}  // namespace isohf::view
