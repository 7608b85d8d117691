#include "isohf/archive/codec/simd/batch_decoder.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/archive/codec/simd/batch_codes.h"
#include "isohf/archive/codec/simd/batch_floats.h"
#include "isohf/archive/codec/simd/batch_residuals.h"
#include "isohf/archive/codec/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

template <typename Stored>
std::vector<Stored>& vector_of(TileCodes& tile) {
  if constexpr (std::is_same_v<Stored, float>) {
    return tile.heights;
  } else {
    return tile.codes;
  }
}

template <typename Stored>
Stored void_of(CodeType type) {
  if constexpr (std::is_same_v<Stored, float>) {
    return std::numeric_limits<float>::quiet_NaN();
  } else {
    return static_cast<Stored>(Quantisation{type, 0.0, 1.0}.void_code());
  }
}

/// Tiles on their way: payloads, residuals, samples (BatchCodes or BatchFloats), what is stored.
template <typename Samples>
class BatchDecoder {
  using Zigzagged = typename Samples::Zigzagged;
  using Stored = typename Samples::Stored;

 public:
  BatchDecoder(const TileShape& shape, CodeType type)
      : shape_(shape),
        type_(type),
        void_(void_of<Stored>(type)),
        residuals_(shape.columns()),
        samples_(shape),
        spare_row_(static_cast<std::size_t>(shape.columns())) {}

  /// False where the payload is not for this decoder, or broken.
  bool open(std::span<const std::byte> bytes, TileCodes& tile) {
    auto payload = std::make_unique<BatchPayload<Zigzagged>>();
    try {
      if (!payload->open(shape_, type_, bytes)) return false;
    } catch (const Error&) {
      return false;  // decode_tile says what is wrong
    }
    std::vector<Stored>& stored = vector_of<Stored>(tile);
    stored.resize(static_cast<std::size_t>(shape_.stored_vertex_count()));
    residuals_.open(*payload);
    samples_.open(payload->header);
    stored_.push_back(stored.data());
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
    PerLane<Stored*> rows{};
    rows.fill(spare_row_.data());
    for (std::size_t lane = 0; lane < stored_.size(); ++lane) {
      rows[lane] = stored_[lane] + static_cast<std::ptrdiff_t>(r) * columns;
    }
    samples_.write_row(r, rows);
    for (std::size_t lane = 0; lane < stored_.size(); ++lane) {
      bool is_good = residuals_.is_good(lane) && samples_.is_in_range(lane);
      Stored* const row = rows[lane];
      if (r % 2 == 0) {
        row[0] = row[1];
        row[columns - 1] = row[columns - 2];
        is_good &= restore_slid(r, lane, row);
      }
      const std::uint8_t* const void_row = residuals_.void_row(lane);
      for (int column = 0; void_row != nullptr && column < columns; ++column) {
        if (void_row[column] != 0) row[column] = void_;
      }
      is_good_[lane] = is_good_[lane] && is_good;
    }
  }

  /// The slid vertices of one lane; false where one lies outside the range.
  bool restore_slid(int r, std::size_t lane, Stored* row) const {
    const PayloadHeader& header = payloads_[lane]->header;
    const int columns = shape_.columns();
    bool is_good = true;
    for (int side = 0; side < 2; ++side) {
      const int column = column_of_slid(columns, side);
      if (residuals_.void_row(lane) != nullptr && residuals_.void_row(lane)[column] != 0) continue;
      const int at = side == 0 ? 1 : columns - 3;
      const std::int64_t both = std::int64_t{samples_.sample(r, at, lane)} + samples_.sample(r, at + 1, lane);
      const auto prediction = static_cast<std::uint32_t>(both >> 1);
      const std::int32_t sample = Samples::wrapped(prediction - unzigzag(residuals_.slid(lane, side)));
      row[column] = samples_.stored(sample, lane);
      is_good &= sample >= header.low && sample <= header.high;
    }
    return is_good;
  }

  const TileShape& shape_;
  CodeType type_;
  Stored void_;
  std::vector<std::unique_ptr<BatchPayload<Zigzagged>>> payloads_;
  std::vector<Stored*> stored_;
  std::vector<bool> is_good_;
  BatchResiduals<Zigzagged> residuals_;
  Samples samples_;
  std::vector<Stored> spare_row_;  ///< of lanes without a tile
};

template <typename Samples>
void decode_side_by_side(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                         std::span<TileCodes> tiles, std::span<bool> decoded) {
  BatchDecoder<Samples> decoder(shape, type);
  std::vector<std::size_t> opened;
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    tiles[i] = {};
    tiles[i].type = type;
    if (decoder.open(payloads[i], tiles[i])) opened.push_back(i);
  }
  decoder.run();
  for (std::size_t lane = 0; lane < opened.size(); ++lane) decoded[opened[lane]] = decoder.is_good(lane);
}

}  // namespace

void decode_batch(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded) {
  ISOHF_ASSERT(payloads.size() <= kBatchLanes && tiles.size() == payloads.size());
  std::fill(decoded.begin(), decoded.end(), false);
  if constexpr (kSwapsBytes) return;  // samples lie in vectors of both 16 and 32 bits
  if (type == CodeType::kF32) {
    decode_side_by_side<BatchFloats>(shape, type, payloads, tiles, decoded);
  } else {
    decode_side_by_side<BatchCodes>(shape, type, payloads, tiles, decoded);
  }
}

}  // namespace isohf
