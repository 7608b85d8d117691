#include "isohf/archive/tile/simd/single_decoder.h"

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/simd/residual_expander.h"
#include "isohf/archive/tile/simd/slanted_rows.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/bytes.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::ptrdiff_t kLanes = SlantedRows::kLanes;

/// A tile's payload, its residuals put together.
struct Payload {
  PayloadHeader header;
  std::vector<std::uint8_t> is_void;                            ///< in row order; empty where nothing is void
  std::unique_ptr<std::uint16_t[]> zigzagged;                   ///< context by context, and a row's worth of zeros
  std::array<const std::uint16_t*, kMaxContexts + 1> starts{};  ///< of the contexts; all past the last one end there

  /// False where the payload is not for this decoder. Throws Error where it is broken.
  [[nodiscard]] bool open(const TileShape& shape, CodeType type, std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    header = read_payload_header(shape, type, reader);
    if (header.is_constant) return false;
    const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
    std::size_t voids = 0;
    if (header.has_voids) {
      is_void = unpack_void_mask(reader.read_bytes(header.mask_bytes), samples);
      for (const std::uint8_t value : is_void) voids += value;
    }
    const SymbolStreams symbols(header, reader);
    const auto extra = reader.read_bytes(header.extra_bytes);
    std::size_t count = 0;
    for (const std::uint32_t of_context : header.symbol_counts) count += of_context;
    return reader.remaining() == 0 && count == samples - voids && expand(shape.columns(), symbols, extra, count);
  }

 private:
  [[nodiscard]] bool expand(int columns, const SymbolStreams& symbols, std::span<const std::byte> extra,
                            std::size_t count) {
    std::vector<std::byte> padded(extra.size() + kExpanderSlack);
    std::copy(extra.begin(), extra.end(), padded.begin());
    // A row may run past a context's last residual, and past the last of all; that is told when it is done.
    const auto spare = static_cast<std::size_t>(columns) + 2;
    zigzagged = std::make_unique_for_overwrite<std::uint16_t[]>(count + spare);
    std::fill_n(zigzagged.get() + count, spare, std::uint16_t{0});
    std::uint16_t* to = zigzagged.get();
    std::uint64_t position = 0;
    for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
      position = expand_residuals(symbols[i], std::span(padded).first(extra.size()), position, to);
      if (position == kNotExpanded) return false;
      starts[i] = to;
      to += symbols[i].size();
    }
    std::fill(starts.begin() + static_cast<std::ptrdiff_t>(header.symbol_counts.size()), starts.end(), to);
    if ((position + 7) / 8 != extra.size()) return false;
    return position % 8 == 0 || (std::to_integer<unsigned>(extra[position / 8]) >> (position % 8)) == 0;
  }
};

ISOHF_KERNEL void find_magnitudes(const std::uint16_t* zigzagged, int begin, int end, unsigned shift,
                                  std::uint8_t* __restrict magnitudes) {
  for (int i = begin; i < end; ++i) magnitudes[i] = magnitude(zigzagged[i], shift);
}

/// The residuals of a tile, row by row: what a row's are follows from those of the rows above, not from samples.
class Residuals {
 public:
  Residuals(int columns, const Payload& payload)
      : columns_(columns),
        payload_(payload),
        table_(context_table(payload.header.thresholds)),
        magnitudes_(columns),
        energies_(static_cast<std::size_t>(columns)),
        row_(static_cast<std::size_t>(columns)) {
    std::copy_n(payload.starts.begin(), kMaxContexts, next_.begin());
  }

  /// Those of row r's places to every kLanes-th number of `zigzagged`, and those of its slid vertices to `slid`. False where
  /// a context has run out of them.
  bool take_row(int r, const std::uint8_t* is_void, std::uint16_t* zigzagged, std::array<std::uint16_t, 2>& slid) {
    const int first = first_of(r);
    const int last = last_of(r, columns_);
    find_energies(magnitudes_.above() + r % 2, magnitudes_.far_above(), first, last, energies_.data());
    for (int place = first; place <= last; ++place) {
      if (is_void != nullptr && is_void[column_of_place(columns_, r, place)] != 0) {
        row_[static_cast<std::size_t>(place)] = 0;
        continue;
      }
      const std::uint16_t residual = take(energies_[static_cast<std::size_t>(place)]);
      row_[static_cast<std::size_t>(place)] = residual;
      zigzagged[place * kLanes] = residual;
    }
    std::uint8_t* const magnitudes = magnitudes_.current();
    vectorised<find_magnitudes>(row_.data(), first, last + 1, static_cast<unsigned>(payload_.header.energy_shift),
                                magnitudes);
    for (int side = 0; r % 2 == 0 && side < 2; ++side) {
      if (is_void != nullptr && is_void[column_of_slid(columns_, side)] != 0) continue;
      const int at = side == 0 ? 1 : columns_ - 3;
      slid[static_cast<std::size_t>(side)] = take(context_energy_of_slid(magnitudes[at], magnitudes[at + 1]));
    }
    magnitudes_.close_row(first, last);
    for (std::size_t i = 0; i < payload_.header.symbol_counts.size(); ++i) {
      if (next_[i] > payload_.starts[i + 1]) return false;
    }
    return true;
  }

 private:
  std::uint16_t take(std::uint16_t energy) { return *next_[table_[energy]]++; }

  int columns_;
  const Payload& payload_;
  std::array<std::uint8_t, kEnergyLimit> table_;
  std::array<const std::uint16_t*, kMaxContexts> next_{};
  MagnitudeRows magnitudes_;
  std::vector<std::uint16_t> energies_;
  std::vector<std::uint16_t> row_;
};

/// Samples less 2^15 in halves, in whole numbers, and the weights of eight rows.
struct Constants {
  std::array<Words, kSlantedTerms.size()> weights{};
  Ints least;
  Ints most;
  Ints low;
  Ints high;
};

struct Band : SlantedBand {
  const Constants& constants;
  const std::uint16_t* zigzagged;  ///< of all lanes, time by time
};

/// Predictions completed by residuals. Sums modulo 2^32, as the plain decoder has them.
template <bool kIsWide>
ISOHF_KERNEL void restore_time(const Band& band, SlantedRows::Time* now, int t, Ints active, bool is_full,
                               Recent& recent) {
  const Constants& by = band.constants;
  const auto pairs = [&](int lane, int back) { return unaligned<Words>(&now[-back].pair(lane)).value; };
  Words sum{};
#pragma GCC unroll 10
  for (std::size_t i = 0; i < kSlantedTerms.size() - kNearestPairs; ++i) {
    sum += multiply_pairs<kIsWide>(by.weights[i], pairs(kSlantedTerms[i].lane, kSlantedTerms[i].back));
  }
  sum += multiply_pairs<kIsWide>(by.weights[kSlantedTerms.size() - 2], (Words)recent.north);
  const Words zigzagged = from_shorts<kIsWide>(band.zigzagged + t * kLanes);
  const Ints residual = (Ints)((zigzagged >> 1U) ^ -(zigzagged & 1U));
  // Shifted samples are predicted as samples are: 2^27 more in the sum are 2^16 more in the halves, an even number.
  Ints halves = (Ints)(sum + multiply_pairs<kIsWide>(by.weights[kSlantedTerms.size() - 1], (Words)recent.own)) >>
                (kWeightBits - 1);
  halves = halves < by.least ? by.least : halves;
  halves = halves > by.most ? by.most : halves;
  Words east = (Words)(((halves + 1) >> 1) + choose_by_sign<kIsWide>((Ints)((Words)halves << 31U), residual, -residual))
               << 16U;
  Ints own = (Ints)east >> 16;
  if (!is_full) {
    if (band.is_void != nullptr)
      own = voids_at<kIsWide>(band, t) != 0 ? ((recent.own >> 16) + ((Ints)pairs(-1, 3) >> 16)) >> 1 : own;
    own = active != 0 ? own : by.low;
    east = (Words)own << 16U;
  }
  recent.lowest = own < recent.lowest ? own : recent.lowest;
  recent.highest = own > recent.highest ? own : recent.highest;
  Ints kept = (Ints)((Words)recent.own >> 16U | east);
  if (!is_full) kept = active != 0 ? kept : unaligned<Ints>(&now->pair(0)).value;
  const auto pairs_before = (Ints)pairs(-1, 0);
  unaligned<Ints>(&now->pair(0)).value = kept;
  recent.keep(kept, Ints{}, pairs_before, Ints{});
}

template <bool kIsWide>
ISOHF_KERNEL bool restore_band(const Band& band) {
  Recent recent(band.constants.low, band.constants.high);
  walk_band<kIsWide>(band, recent, [&](SlantedRows::Time* now, int t, Ints active, bool is_full) {
    restore_time<kIsWide>(band, now, t, active, is_full, recent);
    return true;
  });
  return recent.is_within<kIsWide>(band.constants.low, band.constants.high);
}

bool decode(const TileShape& shape, const Payload& payload, TileCodes& tile) {
  const PayloadHeader& header = payload.header;
  const int columns = shape.columns();
  Constants constants;
  constants.low = Ints{} + (header.low - kSampleShift);
  constants.high = Ints{} + (header.high - kSampleShift);
  constants.least = 2 * constants.low;
  constants.most = 2 * constants.high - 1;
  Residuals residuals(columns, payload);
  SlantedRows slanted(columns);
  slanted.fill_above(columns, header.base);
  BandCodes band_codes(columns, tile.type);
  std::vector<std::uint16_t> zigzagged(static_cast<std::size_t>((columns + delay(kBandRows)) * kLanes));
  std::array<std::array<std::uint16_t, 2>, kBandRows> slid{};
  for (int top = 0; top < shape.rows(); top += kBandRows) {
    const int rows = std::min(kBandRows, shape.rows() - top);
    const auto offset = static_cast<std::ptrdiff_t>(top) * columns;
    const std::uint8_t* const voids = voids_of_band(payload.is_void, top, rows, columns);
    for (int lane = 0; lane < rows; ++lane) {
      if (!residuals.take_row(top + lane, voids != nullptr ? voids + lane * columns : nullptr,
                              zigzagged.data() + delay(lane) * kLanes + lane, slid[static_cast<std::size_t>(lane)])) {
        return false;
      }
    }
    if (top <= kBandRows) constants.weights = slanted_weights(header.predictors, top);
    const Band band{{slanted, columns, rows, voids}, constants, zigzagged.data()};
    if (!vectorised<restore_band<false>, restore_band<true>>(band)) return false;
    band_codes.store(band, tile.codes.data() + offset);
    for (int lane = 0; lane < rows; ++lane) {
      std::uint16_t* const codes = tile.codes.data() + offset + lane * columns;
      const std::uint8_t* const is_void = voids != nullptr ? voids + lane * columns : nullptr;
      for (int side = 0; lane % 2 == 0 && side < 2; ++side) {
        const int column = column_of_slid(columns, side);
        if (is_void != nullptr && is_void[column] != 0) continue;
        const int at = side == 0 ? 1 : columns - 3;
        const std::uint32_t residual = unzigzag(slid[static_cast<std::size_t>(lane)][static_cast<std::size_t>(side)]);
        const auto prediction =
            static_cast<std::uint32_t>((slanted.sample(lane, at) + slanted.sample(lane, at + 1)) >> 1);
        const std::uint32_t sample = (prediction - residual) & 0xffffU;
        if (static_cast<std::int32_t>(sample) < header.low || static_cast<std::int32_t>(sample) > header.high)
          return false;
        codes[column] = static_cast<std::uint16_t>(sample);
      }
    }
    slanted.next_band(columns);
  }
  return true;
}

}  // namespace

bool decode_single(const TileShape& shape, CodeType type, std::span<const std::byte> bytes, TileCodes& tile) {
  Payload payload;
  try {
    if (!payload.open(shape, type, bytes)) return false;
  } catch (const Error&) {
    return false;
  }
  tile.type = type;
  tile.codes.resize(static_cast<std::size_t>(shape.stored_vertex_count()));
  return decode(shape, payload, tile);
}

}  // namespace isohf
