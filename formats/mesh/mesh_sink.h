#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "isohf/mesh.h"
#include "isohf/projection.h"

namespace isohf {

/// What a mesh file states beside its triangles.
struct MeshSpec {
  std::string name;                    ///< of the archive, without folder
  std::string producer;                ///< "isohf 0.1.0"
  std::string unit;                    ///< of positions: "metre", or "unknown"
  std::string crs;                     ///< of `origin`: "EPSG:32632", a name; empty if it is not known
  std::optional<MapPoint> origin;      ///< of position (0, 0, 0) in that system
  std::optional<GeoPoint> origin_geo;  ///< the same in degrees
  double elevation_scale = 1.0;        ///< positions' y for one vertical unit
  std::int64_t pieces = 0;             ///< at most
  bool overwrite = false;
};

/// A mesh file, written piece by piece. Everything goes to NAME.part until finish(); a sink that is destroyed before
/// leaves nothing behind. One thread calls. Memory: some kilobytes for each piece.
class MeshSink {
 public:
  explicit MeshSink(std::string path) : path_(std::move(path)) {}
  MeshSink(const MeshSink&) = delete;
  MeshSink& operator=(const MeshSink&) = delete;
  virtual ~MeshSink() = default;

  /// picture  the piece's texture as a PNG or JPEG file; empty: none
  /// Throws Error naming the path: kIo, kInvalidArgument (more than the format holds).
  void write(const MeshPiece& piece, std::span<const std::byte> picture);
  /// Completes the file and gives it its name. Throws Error naming the path: kIo, kInvalidArgument (no triangle).
  void finish();

  [[nodiscard]] std::int64_t vertices() const { return vertices_; }    ///< written so far
  [[nodiscard]] std::int64_t triangles() const { return triangles_; }  ///< written so far

 private:
  /// The same of a format; errors do not name the path. vertices() and triangles() are those before the piece.
  virtual void add(const MeshPiece& piece, std::span<const std::byte> picture) = 0;
  virtual void complete() = 0;

  std::string path_;
  std::int64_t vertices_ = 0;
  std::int64_t triangles_ = 0;
};

}  // namespace isohf
