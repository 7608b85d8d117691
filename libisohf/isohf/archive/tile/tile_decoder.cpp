#include "isohf/archive/tile/tile_decoder.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/tile/adaptive/adaptive_decoder.h"
#include "isohf/archive/tile/adaptive/adaptive_payload.h"
#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/simd/single_decoder.h"
#include "isohf/archive/tile/simd/wavefront_decoder.h"
#include "isohf/archive/tile/tile_payload.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, "tile payload: " + why);
}

/// The zigzagged residuals of all contexts: symbols and extra bits put together.
class ResidualReader {
 public:
  ResidualReader(const PayloadHeader& header, ByteReader& reader) : table_(context_table(header.thresholds)) {
    const SymbolStreams symbols(header, reader);
    BitReader extra(reader.read_bytes(header.extra_bytes));
    const unsigned limit = symbol_limit(residual_bits(header.type));
    for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
      next_[i] = zigzagged_.size();
      for (const std::byte byte : symbols[i]) {
        const auto symbol = std::to_integer<unsigned>(byte);
        if (symbol >= limit) refuse(fmt::format("symbol {} does not exist, the last is {}", symbol, limit - 1));
        const unsigned bits = extra_bits_of_symbol(symbol);
        zigzagged_.push_back(zigzagged_from(symbol, bits == 0 ? 0 : extra.take(bits)));
      }
      end_[i] = zigzagged_.size();
    }
    if (extra.ran_out()) refuse("it holds too few extra bits");
    if (!extra.is_used_up()) refuse("it holds more extra bits than its symbols ask for");
  }

  /// The zigzagged residual of a place with that energy.
  std::uint32_t take(std::uint16_t energy) {
    const std::size_t context = table_[energy];
    if (next_[context] == end_[context]) refuse(fmt::format("context {} holds too few symbols", context));
    return zigzagged_[next_[context]++];
  }

  void check_used_up(std::size_t contexts) const {
    for (std::size_t i = 0; i < contexts; ++i) {
      if (next_[i] != end_[i]) refuse(fmt::format("context {} holds {} symbols too many", i, end_[i] - next_[i]));
    }
  }

 private:
  std::array<std::uint8_t, kEnergyLimit> table_;
  std::vector<std::uint32_t> zigzagged_;
  std::array<std::size_t, kMaxContexts> next_{};
  std::array<std::size_t, kMaxContexts> end_{};
};

/// The sample that halves predict, plus or less the residual as it is turned, modulo 2^16 or 2^32.
std::int32_t restore(std::int32_t halves, std::uint32_t zigzagged) {
  const std::uint32_t residual = unzigzag(zigzagged);
  const auto prediction = static_cast<std::uint32_t>(prediction_of_halves(halves));
  return static_cast<std::int32_t>(((halves & 1) != 0 ? prediction + residual : prediction - residual) & 0xffffU);
}
std::int64_t restore(std::int64_t halves, std::uint32_t zigzagged) {
  const std::uint32_t residual = unzigzag(zigzagged);
  const auto prediction = static_cast<std::uint32_t>(prediction_of_halves(halves));
  return static_cast<std::int32_t>((halves & 1) != 0 ? prediction + residual : prediction - residual);
}

/// Sums of the weighted samples above plus W and WW, in halves, as predict_row has them (modulo 2^32 for codes).
std::int32_t complete(std::int32_t part, std::int32_t w, std::int32_t west, std::int32_t ww, std::int32_t far_west) {
  const auto u = [](std::int32_t value) { return static_cast<std::uint32_t>(value); };
  return static_cast<std::int32_t>(u(part) + u(w) * u(west) + u(ww) * u(far_west)) >> (kWeightBits - 1);
}
std::int64_t complete(std::int64_t part, std::int64_t w, std::int64_t west, std::int64_t ww, std::int64_t far_west) {
  return (part + w * west + ww * far_west) >> (kWeightBits - 1);
}

template <typename Wide>
class TileDecoder {
 public:
  TileDecoder(const TileShape& shape, const PayloadHeader& header, std::span<const std::uint8_t> is_void,
              ResidualReader& residuals)
      : header_(header),
        is_void_(is_void),
        residuals_(residuals),
        lattice_(shape),
        parts_(static_cast<std::size_t>(shape.columns())),
        magnitudes_(shape.columns()),
        energies_(parts_.size()) {
    lattice_.fill_rows_above(header.base);
  }

  /// Calls `put(index, sample)` for every sample that is not void.
  template <typename Put>
  void decode(const Put& put) {
    const int columns = lattice_.columns();
    for (int r = 0; r < lattice_.rows(); ++r) {
      const auto row_start = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
      const std::uint8_t* const void_row = is_void_.empty() ? nullptr : is_void_.data() + row_start;
      const int first = Lattice<Wide>::first(r);
      const int last = lattice_.last(r);
      lattice_.open_row(r);
      if (!(void_row == nullptr ? decode_row<false>(r, void_row) : decode_row<true>(r, void_row))) {
        refuse(fmt::format("row {} leaves the range {}..{} that the header states", r, header_.low, header_.high));
      }
      const Wide* const own = lattice_.row(r);
      for (int place = first; place <= last; ++place) {
        const int column = column_of_place(columns, r, place);
        if (void_row == nullptr || void_row[column] == 0) put(row_start + static_cast<std::size_t>(column), own[place]);
      }
      for (int side = 0; r % 2 == 0 && side < 2; ++side) {
        const int column = column_of_slid(columns, side);
        if (void_row != nullptr && void_row[column] != 0) continue;
        put(row_start + static_cast<std::size_t>(column), decode_slid(r, side));
      }
      lattice_.close_row(r);
      magnitudes_.close_row(first, last);
    }
  }

 private:
  /// False where a sample leaves the stated range.
  template <bool kWithVoids>
  bool decode_row(int r, const std::uint8_t* void_row) {
    const int first = Lattice<Wide>::first(r);
    const int last = lattice_.last(r);
    predict_row_from_above<Wide>(lattice_, r, header_.predictors, parts_);
    find_energies(magnitudes_.above() + r % 2, magnitudes_.far_above(), first, last, energies_.data());
    const Wide least = 2 * Wide{header_.low};
    const Wide most = 2 * Wide{header_.high} - 1;
    Wide* const own = lattice_.row(r);
    const Wide* const north = lattice_.row(r - 1) + r % 2;
    std::uint8_t* const magnitudes = magnitudes_.current();
    bool in_range = true;
    const PredictorWeights& weights = header_.predictors.of_row(r);
    const Wide weight_w = weights[0], weight_ww = weights[2];
    for (int place = first; place <= last; ++place) {
      if (kWithVoids && void_row[column_of_place(lattice_.columns(), r, place)] != 0) {
        own[place] = void_fill(own, north, place);
        magnitudes[place] = 0;
        continue;
      }
      const auto at = static_cast<std::size_t>(place);
      const std::uint32_t residual = residuals_.take(energies_[at]);
      magnitudes[place] = magnitude(residual, header_.energy_shift);
      const Wide halves = complete(parts_[at], weight_w, own[place - 1], weight_ww, own[place - 2]);
      own[place] = restore(std::min(std::max(halves, least), most), residual);
      in_range &= own[place] >= header_.low && own[place] <= header_.high;
    }
    return in_range;
  }

  Wide decode_slid(int r, int side) {
    const int at = side == 0 ? 1 : lattice_.columns() - 3;
    const std::uint8_t* const magnitudes = magnitudes_.current();
    const Wide sample = restore(2 * lattice_.slid_prediction(r, side),
                                residuals_.take(context_energy_of_slid(magnitudes[at], magnitudes[at + 1])));
    if (sample < header_.low || sample > header_.high) {
      refuse(fmt::format("row {} leaves the range {}..{} that the header states", r, header_.low, header_.high));
    }
    return sample;
  }

  const PayloadHeader& header_;
  std::span<const std::uint8_t> is_void_;
  ResidualReader& residuals_;
  Lattice<Wide> lattice_;
  std::vector<Wide> parts_;
  MagnitudeRows magnitudes_;
  std::vector<std::uint16_t> energies_;
};

/// Reads all samples but the voids, which `put` never sees.
template <typename Wide, typename Put>
void decode_samples(const TileShape& shape, const PayloadHeader& header, std::span<const std::uint8_t> is_void,
                    ByteReader& reader, const Put& put) {
  if (header.is_constant) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(shape.stored_vertex_count()); ++i) {
      if (is_void.empty() || is_void[i] == 0) put(i, Wide{header.low});
    }
    return;
  }
  ResidualReader residuals(header, reader);
  TileDecoder<Wide>(shape, header, is_void, residuals).decode(put);
  residuals.check_used_up(header.symbol_counts.size());
}

TileCodes decode_checked(const TileShape& shape, CodeType type, std::span<const std::byte> payload) {
  if (payload.size() > max_payload_bytes(shape, type)) {
    refuse(fmt::format("{} bytes, more than a tile of this shape can have", payload.size()));
  }
  if (is_adaptive(payload)) return decode_adaptive(shape, type, payload);
  ByteReader reader(payload);
  PayloadHeader header = read_payload_header(shape, type, reader);
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  std::vector<std::uint8_t> is_void;
  if (header.has_voids) is_void = unpack_void_mask(reader.read_bytes(header.mask_bytes), samples);
  TileCodes tile = void_tile(shape, {type, 0.0, 1.0});
  if (type == CodeType::kF32) {
    decode_samples<std::int64_t>(shape, header, is_void, reader, [&](std::size_t i, std::int64_t ordered) {
      tile.heights[i] = float_from_ordered(static_cast<std::int32_t>(ordered), header.dropped_bits);
    });
  } else {
    decode_samples<std::int32_t>(shape, header, is_void, reader, [&](std::size_t i, std::int32_t code) {
      tile.codes[i] = static_cast<std::uint16_t>(code);
    });
  }
  if (reader.remaining() != 0) refuse(fmt::format("{} bytes too many at its end", reader.remaining()));
  return tile;
}

}  // namespace

TileCodes decode_tile_slowly(const TileShape& shape, CodeType type, std::span<const std::byte> payload) {
  try {
    return decode_checked(shape, type, payload);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory,
                fmt::format("no memory to decode a tile of {} samples", shape.stored_vertex_count()));
  }
}

TileCodes decode_tile(const TileShape& shape, CodeType type, std::span<const std::byte> payload) {
  if (type == CodeType::kF32 || payload.size() > max_payload_bytes(shape, type))
    return decode_tile_slowly(shape, type, payload);
  TileCodes tile;
  if (is_adaptive(payload)) {
    tile.type = type;
    tile.codes.resize(static_cast<std::size_t>(shape.stored_vertex_count()));
    if (decode_wavefront(shape, read_adaptive_payload(shape, type, payload), tile)) return tile;
    return decode_tile_slowly(shape, type, payload);
  }
  return decode_single(shape, type, payload, tile) ? tile : decode_tile_slowly(shape, type, payload);
}

}  // namespace isohf
