#include "gl/tile_buffers.h"

#include <fmt/format.h>

#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/mesh.h"

namespace isohf::view {
namespace {

template <typename T>
void upload_static(GLenum target, const std::vector<T>& values) {
  glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), GL_STATIC_DRAW);
}

constexpr GLuint kShadowAttribute = 1;
constexpr GLenum kCodesUnit = GL_TEXTURE2;

const void* offset_pointer(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);
}

}  // namespace

IndexArrays make_index_arrays(const TileShape& shape, int plane_stride) {
  const TileMesh mesh(shape, plane_stride);
  const auto copy = [](std::span<const std::uint32_t> part) { return std::vector(part.begin(), part.end()); };
  IndexArrays arrays;
  for (int level = 0; level < shape.levels(); ++level) {
    arrays.strips.push_back(copy(mesh.strip(level)));
    arrays.stitch_counts.push_back(mesh.stitch(level).size());
  }
  arrays.stitch = copy(mesh.stitch(shape.levels() - 1));
  if (plane_stride == 0) return arrays;
  for (const TileSide side : {TileSide::kWest, TileSide::kEast, TileSide::kNorth, TileSide::kSouth}) {
    arrays.sides.push_back(copy(mesh.side_stitch(side)));
  }
  return arrays;
}

SharedGeometry::SharedGeometry(const TileShape& shape, const IndexArrays& arrays) : shape_(shape) {
  constexpr std::size_t kIndexBytes = sizeof(std::uint32_t);
  std::vector<std::uint32_t> all;
  for (const auto& strip : arrays.strips) {
    strip_offsets_bytes_.push_back(all.size() * kIndexBytes);
    strip_counts_.push_back(static_cast<GLsizei>(strip.size()));
    all.insert(all.end(), strip.begin(), strip.end());
  }
  stitch_offset_bytes_ = all.size() * kIndexBytes;
  for (const std::size_t count : arrays.stitch_counts) stitch_counts_.push_back(static_cast<GLsizei>(count));
  all.insert(all.end(), arrays.stitch.begin(), arrays.stitch.end());
  for (const auto& side : arrays.sides) {
    side_offsets_bytes_.push_back(all.size() * kIndexBytes);
    side_counts_.push_back(static_cast<GLsizei>(side.size()));
    all.insert(all.end(), side.begin(), side.end());
  }

  glBindVertexArray(0);
  glBindBuffer(GL_ARRAY_BUFFER, xz_.get());
  upload_static(GL_ARRAY_BUFFER, object_positions(shape));
  // The element array belongs to a vertex array's state: fill the buffer through another target.
  glBindBuffer(GL_COPY_WRITE_BUFFER, indices_.get());
  upload_static(GL_COPY_WRITE_BUFFER, all);
  check_gl("uploading the shared vertex and index arrays");
}

void SharedGeometry::draw_strip(int level) const {
  const auto i = static_cast<std::size_t>(level);
  glDrawElements(GL_TRIANGLE_STRIP, strip_counts_[i], GL_UNSIGNED_INT, offset_pointer(strip_offsets_bytes_[i]));
}

void SharedGeometry::draw_stitch(int level) const {
  glDrawElements(GL_TRIANGLES, stitch_counts_[static_cast<std::size_t>(level)], GL_UNSIGNED_INT,
                 offset_pointer(stitch_offset_bytes_));
}

std::int64_t SharedGeometry::draw_side(int side) const {
  const auto i = static_cast<std::size_t>(side);
  glDrawElements(GL_TRIANGLES, side_counts_[i], GL_UNSIGNED_INT, offset_pointer(side_offsets_bytes_[i]));
  return side_counts_[i] / 3;
}

std::vector<std::uint32_t> SharedGeometry::read(std::size_t offset_bytes, GLsizei count) const {
  glBindBuffer(GL_COPY_READ_BUFFER, indices_.get());
  std::vector<std::uint32_t> indices(static_cast<std::size_t>(count));
  glGetBufferSubData(GL_COPY_READ_BUFFER, static_cast<GLintptr>(offset_bytes),
                     static_cast<GLsizeiptr>(indices.size() * sizeof(indices[0])), indices.data());
  return indices;
}

std::vector<std::uint32_t> SharedGeometry::read_strip(int level) const {
  const auto i = static_cast<std::size_t>(level);
  return read(strip_offsets_bytes_[i], strip_counts_[i]);
}

std::vector<std::uint32_t> SharedGeometry::read_stitch(int level) const {
  return read(stitch_offset_bytes_, stitch_counts_[static_cast<std::size_t>(level)]);
}

TileSlot::TileSlot(const SharedGeometry& shared)
    : vertices_(static_cast<std::size_t>(shared.shape().stored_vertex_count())),
      rim_(static_cast<std::size_t>(shared.shape().columns()) + 2) {
  const std::vector<std::uint16_t> nothing(vertices_ + 2 * rim_, 0);
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
  if (nothing.size() > static_cast<std::size_t>(most)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("tiles of {} vertices take a buffer texture of {} texels, the driver has {} at most",
                            vertices_, nothing.size(), most));
  }
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, shared.xz());
  glVertexAttribIPointer(0, 2, GL_SHORT, 0, nullptr);
  glEnableVertexAttribArray(0);
  glBindBuffer(GL_TEXTURE_BUFFER, codes_.get());
  glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(nothing.size() * sizeof(std::uint16_t)), nothing.data(),
               GL_DYNAMIC_DRAW);
  glActiveTexture(kCodesUnit);
  glBindTexture(GL_TEXTURE_BUFFER, fetched_.get());
  glTexBuffer(GL_TEXTURE_BUFFER, GL_R16UI, codes_.get());
  glActiveTexture(GL_TEXTURE0);
  glVertexAttrib1f(kShadowAttribute, 0.0F);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, shared.indices());
  glBindVertexArray(0);
  check_gl("making a tile's elevation buffer");
}

void TileSlot::bind() const {
  glBindVertexArray(array_.get());
  glActiveTexture(kCodesUnit);
  glBindTexture(GL_TEXTURE_BUFFER, fetched_.get());
  glActiveTexture(GL_TEXTURE0);
}

void TileSlot::upload(std::span<const std::uint16_t> codes) {
  ISOHF_ASSERT(codes.size() == vertices_);
  shadow_gain_ = 0.0F;  // what it has is of another tile
  glBindBuffer(GL_TEXTURE_BUFFER, codes_.get());
  glBufferSubData(GL_TEXTURE_BUFFER, static_cast<GLintptr>(rim_ * sizeof(std::uint16_t)),
                  static_cast<GLsizeiptr>(codes.size_bytes()), codes.data());
}

void TileSlot::upload_shadow(std::span<const std::int16_t> depths, float gain) {
  ISOHF_ASSERT(depths.size() == vertices_);
  glBindVertexArray(array_.get());
  if (!shadow_) shadow_.emplace();
  glBindBuffer(GL_ARRAY_BUFFER, shadow_->get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(depths.size_bytes()), depths.data(), GL_DYNAMIC_DRAW);
  glVertexAttribPointer(kShadowAttribute, 1, GL_SHORT, GL_TRUE, 0, nullptr);
  glEnableVertexAttribArray(kShadowAttribute);
  glBindVertexArray(0);
  shadow_gain_ = gain;
}

}  // namespace isohf::view
