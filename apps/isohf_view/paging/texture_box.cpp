#include "paging/texture_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <thread>

#include "gl/offscreen.h"
#include "isohf/error.h"

namespace isohf::view {
namespace {

/// What a texture takes while it is on its way, in bytes of it on the GPU: these, and on the CPU its pixels as decoded
/// and as RGBA, and its member inflated.
constexpr std::uint64_t kOnTheWay = 3;
/// Levels of this size and below are loaded first.
constexpr int kCoarseSize = 32;
constexpr float kMostAnisotropy = 8.0F;

/// A software rasteriser would spend nearly all its time on it.
float best_anisotropy() {
  if (is_software_driver() || !epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic")) return 1.0F;
  GLfloat most = 1.0F;
  glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &most);
  return std::min(most, kMostAnisotropy);
}

TextureChain load_chain(const TileSource& source, const TextureRequest& request) {
  TextureChain chain{request, {}, {}};
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

TextureBox::TextureBox(const TileSource& source, std::uint64_t memory_bytes, int workers)
    : source_(source),
      levels_(source.textures()->levels),
      finest_(0),
      coarse_(levels_ - 1),
      anisotropy_(best_anisotropy()),
      resident_limit_(memory_bytes / 4 * 3),
      on_the_way_limit_(memory_bytes / 4),
      loader_([&source](const TextureRequest& request) { return load_chain(source, request); }, workers) {
  while (finest_ < levels_ - 1 &&
         (kOnTheWay * bytes_from(finest_) > on_the_way_limit_ || 2 * bytes_from(finest_) > resident_limit_)) {
    ++finest_;
  }
  const std::uint64_t least = 4 * kOnTheWay * bytes_from(levels_ - 1);
  if (memory_bytes < least) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("memory for textures: {} bytes, {} are required", memory_bytes, least));
  }
  while (coarse_ > finest_ && source.textures()->level_size(coarse_ - 1) <= kCoarseSize) --coarse_;
}

std::uint64_t TextureBox::bytes_from(int level) const {
  std::uint64_t bytes = 0;
  for (int l = level; l < levels_; ++l) {
    const auto size = static_cast<std::uint64_t>(source_.textures()->level_size(l));
    bytes += 4 * size * size;
  }
  return bytes;
}

void TextureBox::enter(const TileRange& range) {
  for (auto at = entries_.begin(); at != entries_.end();) {
    // What is on its way stays until it has arrived: it counts.
    if (range.contains(at->second.tile) || at->second.requested) {
      ++at;
      continue;
    }
    if (at->second.texture) resident_bytes_ -= bytes_from(at->second.finest);
    at = entries_.erase(at);
  }
  for (std::int64_t row = range.first_row; row <= range.last_row; ++row) {
    for (std::int64_t column = range.first_column; column <= range.last_column; ++column) {
      const TileIndex tile{column, row};
      if (!source_.has_texture(tile)) continue;
      entries_.try_emplace(source_.grid().flat_index(tile)).first->second.tile = tile;
    }
  }
}

/// The wanted levels. Where they do not fit, all texels grow by the same factor until they do; room stays for one
/// texture that replaces another.
void TextureBox::decide(const ViewState& view) {
  const TileGrid& grid = source_.grid();
  const double texel = std::max(grid.extent_x(), grid.extent_z()) / (source_.textures()->size - 1);
  for (auto& [flat, entry] : entries_) {
    entry.distance = tile_volume(grid, entry.tile, source_.bounds(entry.tile), view).distance();
  }
  const std::uint64_t room = resident_limit_ - bytes_from(finest_);
  for (double coarser = 0.0;; coarser += 0.25) {
    std::uint64_t sum = 0;
    for (auto& [flat, entry] : entries_) {
      const double pixels =
          std::max(entry.distance / view.focal_px() / texel, 1e-9);  // texels of level 0 under a pixel
      entry.wanted = static_cast<int>(std::clamp(std::floor(std::log2(pixels) + coarser), static_cast<double>(finest_),
                                                 static_cast<double>(levels_ - 1)));
      sum += bytes_from(entry.wanted);
    }
    if (sum <= room) return;
    if (sum == entries_.size() * bytes_from(levels_ - 1)) break;
  }
  // Not even the coarsest level of all: the nearest tiles get one.
  std::vector<Entry*> all;
  for (auto& [flat, entry] : entries_) all.push_back(&entry);
  std::sort(all.begin(), all.end(), nearer);
  for (std::size_t i = room / bytes_from(levels_ - 1); i < all.size(); ++i) all[i]->wanted = levels_;
}

bool TextureBox::upload_rows(Upload& work, std::uint64_t budget) {
  glBindTexture(GL_TEXTURE_2D, work.texture.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  while (work.level < work.chain.levels.size()) {
    const Picture& picture = work.chain.levels[work.level];
    const auto level = static_cast<GLint>(work.level);
    if (work.row == 0) {
      glTexImage2D(GL_TEXTURE_2D, level, GL_RGBA8, picture.width, picture.height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                   nullptr);
    }
    const std::uint64_t left = budget > figures_.upload_bytes ? budget - figures_.upload_bytes : 0;
    const auto rows = static_cast<int>(
        std::min<std::uint64_t>(left / picture.row_bytes(), static_cast<std::uint64_t>(picture.height - work.row)));
    const int now = figures_.upload_bytes == 0 ? std::max(rows, 1) : rows;
    if (now == 0) return false;
    glTexSubImage2D(GL_TEXTURE_2D, level, 0, work.row, picture.width, now, GL_RGBA, GL_UNSIGNED_BYTE,
                    picture.row(work.row));
    figures_.upload_bytes += static_cast<std::uint64_t>(now) * picture.row_bytes();
    work.row += now;
    if (work.row < picture.height) return false;
    work.row = 0;
    ++work.level;
  }
  const auto last = static_cast<GLint>(work.chain.levels.size()) - 1;
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, last);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  if (anisotropy_ > 1.0F) glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAX_ANISOTROPY_EXT, anisotropy_);
  return true;
}

void TextureBox::take(Upload& done) {
  const auto found = entries_.find(source_.grid().flat_index(done.chain.request.tile));
  on_the_way_bytes_ -= bytes_from(done.chain.request.finest);
  Entry& entry = found->second;  // requested entries stay
  entry.requested = false;
  if (done.chain.levels.empty()) {
    entry.broken = true;
    if (!error_) error_ = done.chain.error;
    return;
  }
  if (entry.texture) resident_bytes_ -= bytes_from(entry.finest);
  entry.texture = std::move(done.texture);
  entry.finest = done.chain.request.finest;
  resident_bytes_ += bytes_from(entry.finest);
}

void TextureBox::upload(std::uint64_t budget) {
  for (;;) {
    if (!upload_) {
      if (waiting_.empty()) break;
      upload_ = Upload{std::move(waiting_.front()), {}, 0, 0};
      waiting_.pop_front();
    }
    if (!upload_->chain.levels.empty() && !upload_rows(*upload_, budget)) break;
    take(*upload_);
    upload_.reset();
  }
  glBindTexture(GL_TEXTURE_2D, 0);
}

bool TextureBox::nearer(const Entry* a, const Entry* b) {
  return a->distance != b->distance ? a->distance < b->distance
                                    : std::pair(a->tile.row, a->tile.column) < std::pair(b->tile.row, b->tile.column);
}

bool TextureBox::fits(int finest) const {
  const std::uint64_t bytes = bytes_from(finest);
  return kOnTheWay * (on_the_way_bytes_ + bytes) <= on_the_way_limit_ &&
         resident_bytes_ + on_the_way_bytes_ + bytes <= resident_limit_;
}

bool TextureBox::request(Entry& entry, int finest) {
  if (!fits(finest)) return false;
  entry.requested = true;
  on_the_way_bytes_ += bytes_from(finest);
  loader_.request({entry.tile, finest});
  return true;
}

/// Takes a texture away that is finer than wanted, the one with the most to spare.
bool TextureBox::evict_one() {
  Entry* worst = nullptr;
  for (auto& [flat, entry] : entries_) {
    if (!entry.texture || entry.requested || entry.finest >= entry.wanted) continue;
    if (worst == nullptr || entry.finest < worst->finest ||
        (entry.finest == worst->finest && entry.distance > worst->distance)) {
      worst = &entry;
    }
  }
  if (worst == nullptr) return false;
  resident_bytes_ -= bytes_from(worst->finest);
  worst->texture.reset();
  return true;
}

void TextureBox::request() {
  std::vector<Entry*> bare, coarse, spare;
  for (auto& [flat, entry] : entries_) {
    if (entry.requested || entry.broken) continue;
    if (entry.wanted == levels_) {
      if (entry.texture) resident_bytes_ -= bytes_from(entry.finest);
      entry.texture.reset();
    } else if (!entry.texture) {
      bare.push_back(&entry);
    } else if (entry.finest > entry.wanted) {
      coarse.push_back(&entry);
    } else if (entry.finest + 1 < entry.wanted) {
      spare.push_back(&entry);
    }
  }
  for (std::vector<Entry*>* list : {&bare, &coarse, &spare}) std::sort(list->begin(), list->end(), nearer);
  // Where nothing is on its way that would make room, it is taken from those that have too much.
  const auto request_or_evict = [this](Entry& entry, int finest) {
    return request(entry, finest) || (on_the_way_bytes_ == 0 && evict_one());
  };
  for (Entry* entry : bare) {
    if (!request_or_evict(*entry, std::max(coarse_, entry->wanted))) return;
  }
  for (Entry* entry : coarse) {
    if (!request_or_evict(*entry, entry->wanted)) return;
  }
  for (auto entry = spare.rbegin(); entry != spare.rend(); ++entry) {
    if (!request(**entry, (*entry)->wanted)) return;
  }
}

void TextureBox::update(const TileRange& range, const ViewState& view, std::uint64_t upload_bytes) {
  figures_.upload_bytes = 0;
  enter(range);
  decide(view);
  loader_.collect(waiting_);
  upload(upload_bytes);
  request();
  count();
}

void TextureBox::count() {
  figures_.resident = 0;
  figures_.to_come = 0;
  for (const auto& [flat, entry] : entries_) {
    if (entry.texture) ++figures_.resident;
    if (entry.broken || entry.wanted == levels_) continue;
    if (!entry.texture || entry.finest > entry.wanted) ++figures_.to_come;
  }
  figures_.resident_bytes = resident_bytes_ + kOnTheWay * on_the_way_bytes_;
}

void TextureBox::finish(const TileRange& range, const ViewState& view, const std::function<void()>& poll) {
  for (;;) {
    update(range, view, std::uint64_t{64} << 20U);
    if (figures_.to_come == 0) return;
    poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

GLuint TextureBox::texture(TileIndex tile) const {
  const auto found = entries_.find(source_.grid().flat_index(tile));
  return found != entries_.end() && found->second.texture ? found->second.texture->get() : 0;
}

}  // namespace isohf::view
