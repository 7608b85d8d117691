#include "isohf/archive/codec/simd/batch_residuals.h"

#include <algorithm>

#include "isohf/archive/codec/adaptive/adaptive_payload.h"
#include "isohf/archive/codec/predict/context_energy.h"
#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/simd/residual_expander.h"
#include "isohf/archive/codec/tile_payload.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr std::ptrdiff_t kStep = kBatchLanes;
/// Between two lanes' tables: not a power of two, or what they all use most would fall into the same sets of the cache.
constexpr std::size_t kTableStride = kEnergyLimit + 576;

ISOHF_KERNEL void find_lane_energies(const std::uint8_t* north, const std::uint8_t* far, std::ptrdiff_t begin,
                                     std::ptrdiff_t end, std::uint16_t* __restrict energies) {
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const std::uint8_t* const n = north + i;
    const std::uint8_t* const f = far + i;
    energies[i] = static_cast<std::uint16_t>(4 * (n[0] + n[-kStep] + f[0]) + 3 * n[kStep] +
                                             2 * (n[2 * kStep] + n[-2 * kStep] + f[kStep] + f[-kStep]) + n[-3 * kStep] +
                                             f[2 * kStep] + f[-2 * kStep]);
  }
}

/// Each lane's residuals, shifted as its energies want them.
ISOHF_KERNEL void shift_lanes(const std::uint16_t* zigzagged, std::ptrdiff_t begin, std::ptrdiff_t end,
                              const PerLane<std::int32_t>& shifts, std::uint16_t* __restrict shifted) {
  using Ints = std::int32_t __attribute__((vector_size(4 * kBatchLanes)));
  using Shorts = std::uint16_t __attribute__((vector_size(2 * kBatchLanes)));
  const Ints shift = unaligned<Ints>(shifts.data()).value;
  for (std::ptrdiff_t at = begin; at < end; at += kStep) {
    const Ints wide = __builtin_convertvector(unaligned<Shorts>(zigzagged + at).value, Ints) >> shift;
    unaligned<Shorts>(shifted + at).value = __builtin_convertvector(wide, Shorts);
  }
}

/// Those of floats, as far as they fit 16 bits.
ISOHF_KERNEL void shift_float_lanes(const std::uint32_t* zigzagged, std::ptrdiff_t begin, std::ptrdiff_t end,
                                    const PerLane<std::int32_t>& shifts, std::uint16_t* __restrict shifted) {
  using Words = std::uint32_t __attribute__((vector_size(4 * kBatchLanes)));
  using Shorts = std::uint16_t __attribute__((vector_size(2 * kBatchLanes)));
  const Words shift = unaligned<Words>(shifts.data()).value;
  for (std::ptrdiff_t at = begin; at < end; at += kStep) {
    const Words wide = unaligned<Words>(zigzagged + at).value >> shift;
    unaligned<Shorts>(shifted + at).value = __builtin_convertvector(wide < 0xffffU ? wide : Words{} + 0xffffU, Shorts);
  }
}

ISOHF_KERNEL void limit_magnitudes(const std::uint16_t* __restrict shifted, std::ptrdiff_t begin, std::ptrdiff_t end,
                                   std::uint8_t* __restrict magnitudes) {
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    magnitudes[i] = static_cast<std::uint8_t>(shifted[i] < kMagnitudeLimit ? shifted[i] : kMagnitudeLimit);
  }
}

/// One residual for each of kCount lanes at each place. Lanes in turn: one alone would wait for its own pointers.
template <std::size_t kCount, typename Zigzagged>
void take_lanes(const std::uint16_t* energies, const std::uint8_t* tables,
                std::array<const Zigzagged*, kMaxContexts>* next, int first, int last, Zigzagged* zigzagged) {
  for (std::ptrdiff_t at = first * kStep; at <= last * kStep; at += kStep) {
#pragma GCC unroll 8
    for (std::size_t lane = 0; lane < kCount; ++lane) {
      const auto i = at + static_cast<std::ptrdiff_t>(lane);
      const std::size_t context = tables[lane * kTableStride + energies[i]];
      zigzagged[i] = *next[lane][context]++;
    }
  }
}

}  // namespace

template <typename Zigzagged>
bool BatchPayload<Zigzagged>::open(const TileShape& shape, CodeType type, std::span<const std::byte> payload) {
  if (payload.size() > max_payload_bytes(shape, type) || is_adaptive(payload)) return false;
  ByteReader reader(payload);
  header = read_payload_header(shape, type, reader);
  if (header.is_constant) return false;
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  std::size_t voids = 0;
  if (header.has_voids) {
    is_void = unpack_void_mask(reader.read_bytes(header.mask_bytes), samples);
    for (const std::uint8_t value : is_void) voids += value;
  }
  read_block_map(shape, reader, header.predictors);
  const SymbolStreams streams(header, reader);
  const auto extra = reader.read_bytes(header.extra_bytes);
  if (reader.remaining() != 0) return false;
  std::vector<std::span<const std::byte>> symbols;
  std::size_t count = 0;
  for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
    symbols.push_back(streams[i]);
    count += symbols.back().size();
  }
  return count == samples - voids && expand(shape.columns(), symbols, extra, count);
}

template <typename Zigzagged>
bool BatchPayload<Zigzagged>::expand(int columns, std::span<const std::span<const std::byte>> symbols,
                                     std::span<const std::byte> extra, std::size_t count) {
  std::vector<std::byte> padded(extra.size() + kExpanderSlack);
  std::copy(extra.begin(), extra.end(), padded.begin());
  // A row may run past a context's last residual, and past the last of all; that is told when it is done.
  const auto spare = static_cast<std::size_t>(columns) + 2;
  zigzagged = std::make_unique_for_overwrite<Zigzagged[]>(count + spare);
  std::fill_n(zigzagged.get() + count, spare, Zigzagged{0});
  Zigzagged* to = zigzagged.get();
  std::uint64_t position = 0;
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    position = expand_residuals(symbols[i], std::span(padded).first(extra.size()), position, to);
    if (position == kNotExpanded) return false;
    starts[i] = to;
    to += symbols[i].size();
  }
  std::fill(starts.begin() + static_cast<std::ptrdiff_t>(symbols.size()), starts.end(), to);
  if ((position + 7) / 8 != extra.size()) return false;
  return position % 8 == 0 || (std::to_integer<unsigned>(extra[position / 8]) >> (position % 8)) == 0;
}

template <typename Zigzagged>
const std::uint8_t* BatchPayload<Zigzagged>::void_row(int columns, int r) const {
  if (is_void.empty()) return nullptr;
  const std::uint8_t* const row = is_void.data() + static_cast<std::ptrdiff_t>(r) * columns;
  return std::find(row, row + columns, std::uint8_t{1}) == row + columns ? nullptr : row;
}

template <typename Zigzagged>
BatchResiduals<Zigzagged>::BatchResiduals(int columns)
    : columns_(columns),
      tables_(kBatchLanes * kTableStride),
      energies_(kBatchLanes * static_cast<std::size_t>(columns)),
      zigzagged_(energies_.size()),
      nothing_(static_cast<std::size_t>(columns) + 2),
      is_void_(energies_.size()) {
  for (auto& row : magnitudes_) row.resize(kBatchLanes * (static_cast<std::size_t>(columns) + 2 * kBatchMargin));
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::open(const BatchPayload<Zigzagged>& payload) {
  const auto table = context_table(payload.header.thresholds);
  std::copy(table.begin(), table.end(), tables_.begin() + static_cast<std::ptrdiff_t>(count_ * kTableStride));
  std::copy_n(payload.starts.begin(), kMaxContexts, next_[count_].begin());
  shifts_[count_] = payload.header.energy_shift;
  payloads_[count_] = &payload;
  is_good_[count_] = true;
  ++count_;
}

template <typename Zigzagged>
std::uint8_t* BatchResiduals<Zigzagged>::magnitudes(std::size_t back) {
  return magnitudes_[back].data() + kBatchMargin * kStep;
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::take_places(int first, int last) {
  const auto take = [&](auto lanes) {
    take_lanes<lanes.value>(energies_.data(), tables_.data(), next_.data(), first, last, zigzagged_.data());
  };
  if (count_ == 1) return take(std::integral_constant<std::size_t, 1>());
  if (count_ == 2) return take(std::integral_constant<std::size_t, 2>());
  if (count_ <= 4) return take(std::integral_constant<std::size_t, 4>());
  take(std::integral_constant<std::size_t, kBatchLanes>());
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::take_around_voids(std::size_t lane, int r, int first, int last) {
  for (int place = first; place <= last; ++place) {
    const std::size_t i = static_cast<std::size_t>(place) * kBatchLanes + lane;
    const bool is_void = void_rows_[lane] != nullptr && void_rows_[lane][column_of_place(columns_, r, place)] != 0;
    is_void_[i] = is_void ? 1 : 0;
    zigzagged_[i] = is_void ? Zigzagged{0} : *next_[lane][tables_[lane * kTableStride + energies_[i]]]++;
  }
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::take_slid(std::size_t lane) {
  const std::uint8_t* const row = magnitudes(0) + lane;
  for (int side = 0; side < 2; ++side) {
    if (void_rows_[lane] != nullptr && void_rows_[lane][column_of_slid(columns_, side)] != 0) continue;
    const std::ptrdiff_t at = (side == 0 ? 1 : columns_ - 3) * kStep;
    const std::uint16_t energy = context_energy_of_slid(row[at], row[at + kStep]);
    slid_[static_cast<std::size_t>(side)][lane] = *next_[lane][tables_[lane * kTableStride + energy]]++;
  }
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::take_row(int r) {
  const int first = r % 2 == 0 ? 1 : 0;
  const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
  has_voids_ = false;
  for (std::size_t lane = 0; lane < kBatchLanes; ++lane) {
    if (!is_good_[lane]) {  // takes what it likes, but not past the end
      next_[lane].fill(nothing_.data());
      void_rows_[lane] = nullptr;
    } else {
      void_rows_[lane] = payloads_[lane]->void_row(columns_, r);
      has_voids_ |= void_rows_[lane] != nullptr;
    }
  }
  vectorised<find_lane_energies>(magnitudes(1) + r % 2 * kStep, magnitudes(2), first * kStep, (last + 1) * kStep,
                                 energies_.data());
  if (has_voids_) {
    for (std::size_t lane = 0; lane < kBatchLanes; ++lane) take_around_voids(lane, r, first, last);
  } else {
    take_places(first, last);
  }
  find_magnitudes(first * kStep, (last + 1) * kStep);
  for (std::size_t lane = 0; lane < count_; ++lane) {
    if (!is_good_[lane]) continue;
    if (r % 2 == 0) take_slid(lane);
    for (std::size_t i = 0; i < payloads_[lane]->header.symbol_counts.size(); ++i) {
      is_good_[lane] = is_good_[lane] && next_[lane][i] <= payloads_[lane]->starts[i + 1];
    }
  }
  close_row(first, last);
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::find_magnitudes(std::ptrdiff_t begin, std::ptrdiff_t end) {
  const std::uint16_t* shifted = energies_.data();
  if constexpr (sizeof(Zigzagged) == 4) {
    vectorised<shift_float_lanes>(zigzagged_.data(), begin, end, shifts_, energies_.data());
  } else {
    const bool has_shifts = std::any_of(shifts_.begin(), shifts_.end(), [](std::int32_t shift) { return shift != 0; });
    if (has_shifts) vectorised<shift_lanes>(zigzagged_.data(), begin, end, shifts_, energies_.data());
    if (!has_shifts) shifted = zigzagged_.data();
  }
  vectorised<limit_magnitudes>(shifted, begin, end, magnitudes(0));
}

template <typename Zigzagged>
void BatchResiduals<Zigzagged>::close_row(int first, int last) {
  std::uint8_t* const row = magnitudes(0);
  for (int place = -kBatchMargin; place < first; ++place) std::copy_n(row + first * kStep, kStep, row + place * kStep);
  for (int place = last + 1; place < columns_ + kBatchMargin; ++place) {
    std::copy_n(row + last * kStep, kStep, row + place * kStep);
  }
  magnitudes_[2].swap(magnitudes_[1]);
  magnitudes_[1].swap(magnitudes_[0]);
}

template struct BatchPayload<std::uint16_t>;
template struct BatchPayload<std::uint32_t>;
template class BatchResiduals<std::uint16_t>;
template class BatchResiduals<std::uint32_t>;

}  // namespace isohf
