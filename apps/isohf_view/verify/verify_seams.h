#pragma once

#include <memory>
#include <vector>

#include "gl/offscreen.h"
#include "gl/terrain_program.h"
#include "gl/tile_buffers.h"
#include "paging/tile_source.h"
#include "verify/verify_report.h"

namespace isohf::view {

/// Looks for cracks: draws blocks of neighbouring tiles at differing levels, slanted, and seeks background.
///
/// Seen by parallel light slanted along x, the surface over a line z = const is an unbroken curve X(x) = x + k·y. So
/// every pixel between its two ends must be drawn, whatever the terrain does between them; likewise along z. A step of
/// the ground at a seam opens a gap in one of the two directions of slant. Last, from an eye above the block whose
/// whole view meets the ground inside it, every pixel must be drawn.
class SeamVerifier {
 public:
  SeamVerifier(const TileSource& source, const SharedGeometry& shared, VerifyReport& report);

  /// All blocks. Archives of up to 16 tiles meet every pair of levels in every block; larger ones every level on both
  /// sides of each seam, the pairs changing from block to block.
  void verify();

 private:
  struct Block {
    TileIndex first{};
    int columns = 0;
    int rows = 0;
    std::vector<std::vector<std::uint16_t>> codes;  ///< voids filled: a hole is no crack
  };
  struct Slant {
    bool along_x = true;
    double px_per_code = 0.0;  ///< k, with its sign
  };

  bool load(Block& block);
  void verify_block(const Block& block, std::int64_t number);
  void slanted(const Block& block, int even_level, int odd_level, const Slant& slant);
  void from_above(const Block& block, int even_level, int odd_level);
  void draw(const Block& block, const TerrainFrame& frame, int even_level, int odd_level, const Offscreen& target);
  [[nodiscard]] double code_at(const Block& block, double x, double z) const;  ///< block's object space
  [[nodiscard]] double rough_step(const Block& block) const;
  [[nodiscard]] Finding describe(const Block& block, const Slant& slant, int even_level, int odd_level, double along_px,
                                 double across) const;

  const TileSource& source_;
  const SharedGeometry& shared_;
  VerifyReport& report_;
  TerrainProgram program_;
  std::vector<TileSlot> slots_;
  std::uint16_t fill_;
  double middle_;
  std::unique_ptr<Offscreen> target_;
};

}  // namespace isohf::view
