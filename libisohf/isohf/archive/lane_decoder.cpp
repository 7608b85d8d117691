#include "isohf/archive/lane_decoder.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "isohf/archive/lane_residuals.h"
#include "isohf/archive/lane_samples.h"
#include "isohf/archive/residual_symbols.h"
#include "isohf/archive/sample_lattice.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

/// Tiles on their way: payloads, residuals, samples, codes.
class LaneDecoder {
 public:
  LaneDecoder(const TileShape& shape, CodeType type)
      : shape_(shape),
        type_(type),
        void_code_(static_cast<std::uint16_t>(Quantisation{type, 0.0, 1.0}.void_code())),
        residuals_(shape.columns()),
        samples_(shape),
        spare_row_(static_cast<std::size_t>(shape.columns())) {}

  /// False where the payload is not for this decoder, or broken.
  bool open(std::span<const std::byte> bytes, TileCodes& tile) {
    auto payload = std::make_unique<LanePayload>();
    try {
      if (!payload->open(shape_, type_, bytes)) return false;
    } catch (const Error&) {
      return false;  // decode_tile says what is wrong
    }
    tile.codes.resize(static_cast<std::size_t>(shape_.stored_vertex_count()));
    residuals_.open(*payload);
    samples_.open(payload->header);
    codes_.push_back(tile.codes.data());
    is_good_.push_back(true);
    payloads_.push_back(std::move(payload));
    return true;
  }

  void run() {
    for (int r = 0; r < shape_.rows() && !payloads_.empty(); ++r) {
      residuals_.take_row(r);
      samples_.restore_row(r, residuals_);
      write_row(r);
    }
  }

  [[nodiscard]] bool is_good(std::size_t lane) const { return is_good_[lane]; }

 private:
  void write_row(int r) {
    const int columns = shape_.columns();
    PerLane<std::uint16_t*> rows{};
    rows.fill(spare_row_.data());
    for (std::size_t lane = 0; lane < codes_.size(); ++lane) {
      rows[lane] = codes_[lane] + static_cast<std::ptrdiff_t>(r) * columns;
    }
    samples_.write_row(r, rows);
    for (std::size_t lane = 0; lane < codes_.size(); ++lane) {
      bool is_good = residuals_.is_good(lane) && samples_.is_in_range(lane);
      std::uint16_t* const row = rows[lane];
      if (r % 2 == 0) {
        row[0] = row[1];
        row[columns - 1] = row[columns - 2];
        is_good &= restore_slid(r, lane, row);
      }
      const std::uint8_t* const void_row = residuals_.void_row(lane);
      for (int column = 0; void_row != nullptr && column < columns; ++column) {
        if (void_row[column] != 0) row[column] = void_code_;
      }
      is_good_[lane] = is_good_[lane] && is_good;
    }
  }

  /// The slid vertices' codes of one lane; false where one lies outside the range.
  bool restore_slid(int r, std::size_t lane, std::uint16_t* row) const {
    const PayloadHeader& header = payloads_[lane]->header;
    const int columns = shape_.columns();
    bool is_good = true;
    for (int side = 0; side < 2; ++side) {
      const int column = column_of_slid(columns, side);
      if (residuals_.void_row(lane) != nullptr && residuals_.void_row(lane)[column] != 0) continue;
      const int at = side == 0 ? 1 : columns - 3;
      const std::int32_t sum = samples_.code(r, at, lane) + samples_.code(r, at + 1, lane);
      const std::uint32_t sample =
          (static_cast<std::uint32_t>(sum >> 1) - unzigzag(residuals_.slid(lane, side))) & 0xffffU;
      row[column] = static_cast<std::uint16_t>(sample);
      is_good &= static_cast<std::int32_t>(sample) >= header.low && static_cast<std::int32_t>(sample) <= header.high;
    }
    return is_good;
  }

  const TileShape& shape_;
  CodeType type_;
  std::uint16_t void_code_;
  std::vector<std::unique_ptr<LanePayload>> payloads_;
  std::vector<std::uint16_t*> codes_;
  std::vector<bool> is_good_;
  LaneResiduals residuals_;
  LaneSamples samples_;
  std::vector<std::uint16_t> spare_row_;  ///< of lanes without a tile
};

}  // namespace

void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded) {
  ISOHF_ASSERT(payloads.size() <= kDecoderLanes && tiles.size() == payloads.size());
  std::fill(decoded.begin(), decoded.end(), false);
  if (type == CodeType::kF32) return;
  LaneDecoder decoder(shape, type);
  std::vector<std::size_t> opened;
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    tiles[i] = {};
    tiles[i].type = type;
    if (decoder.open(payloads[i], tiles[i])) opened.push_back(i);
  }
  decoder.run();
  for (std::size_t lane = 0; lane < opened.size(); ++lane) decoded[opened[lane]] = decoder.is_good(lane);
}

}  // namespace isohf
