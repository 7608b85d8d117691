#include "isohf/archive/tile/tile_payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/residuals/pair_coding.h"
#include "isohf/error.h"

namespace isohf {
namespace {

enum : std::uint8_t { kHasVoids = 1, kIsConstant = 2 };

std::uint8_t byte_of(CodeType type) {
  switch (type) {
    case CodeType::kU16:
      return 0;
    case CodeType::kU8:
      return 1;
    case CodeType::kF32:
      return 2;
  }
  return 0;
}

[[noreturn]] void refuse_payload(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, "tile header: " + why);
}

void check_range(const PayloadHeader& header) {
  std::int64_t least = 0;
  std::int64_t most = header.type == CodeType::kU8 ? 254 : 65534;
  if (header.type == CodeType::kF32) {
    most = ordered_from_float(std::bit_cast<float>(0x7f800000U), header.dropped_bits);  // infinity, both signs
    least = -most - 1;
  }
  if (header.low < least || header.high > most || header.low > header.high) {
    refuse_payload(fmt::format("its range {}..{} is none within {}..{}", header.low, header.high, least, most));
  }
  if (header.is_constant != (header.low == header.high))
    refuse_payload("its range contradicts its flag for equal samples");
}

void check_predictor(const PayloadHeader& header) {
  if (header.base < header.low || header.base > header.high) {
    refuse_payload(fmt::format("its base {} lies outside its range {}..{}", header.base, header.low, header.high));
  }
  int sum = 0;
  for (const std::int16_t weight : header.predictors.weights) sum += std::abs(int{weight});
  if (sum >= kWeightSumLimit)
    refuse_payload(fmt::format("its weights add up to {}, must be below {}", sum, kWeightSumLimit));
  if (header.energy_shift > 31)
    refuse_payload(fmt::format("its energy shift is {}, must lie in 0..31", header.energy_shift));
  for (std::size_t i = 0; i < header.thresholds.size(); ++i) {
    const unsigned before = i == 0 ? 0 : header.thresholds[i - 1];
    if (header.thresholds[i] <= before || header.thresholds[i] >= kEnergyLimit) {
      refuse_payload(
          fmt::format("its threshold {} is {}, must ascend within 1..{}", i, header.thresholds[i], kEnergyLimit - 1));
    }
  }
}

}  // namespace

std::uint64_t max_payload_bytes(const TileShape& shape, CodeType type) {
  const auto samples = static_cast<std::uint64_t>(shape.stored_vertex_count());
  // One symbol each, a byte and a half where pairs are written apart, and its extra bits, at most 12 or 28; a run of
  // the mask takes a byte for each sample or fewer.
  const std::uint64_t extra_bits = type == CodeType::kF32 ? 28 : 12;
  const std::uint64_t header = kPredictedHeaderBytes + 2 * kWeightCount + 6 * kMaxContexts;
  return header + samples + (samples * extra_bits + 7) / 8 + samples + 8;
}

void write_payload_header(const PayloadHeader& header, std::vector<std::byte>& out) {
  ByteWriter writer(out);
  writer.write(kCodecVersion);
  writer.write(byte_of(header.type));
  writer.write(static_cast<std::uint8_t>((header.has_voids ? kHasVoids : 0) | (header.is_constant ? kIsConstant : 0)));
  writer.write(header.dropped_bits);
  writer.write(header.low);
  writer.write(header.high);
  writer.write(header.mask_bytes);
  if (header.is_constant) return;
  writer.write(header.base);
  writer.write(header.extra_bytes);
  writer.write(header.energy_shift);
  writer.write(static_cast<std::uint8_t>(header.symbol_counts.size()));
  writer.write(header.paired);
  const std::size_t weight_count = header.predictors.is_wide ? kWeightCount : kNearWeightCount;
  writer.write(std::uint8_t{1});  // predictors
  writer.write(static_cast<std::uint8_t>(weight_count));
  for (std::size_t i = 0; i < weight_count; ++i) writer.write(header.predictors.weights[i]);
  for (const std::uint16_t threshold : header.thresholds) writer.write(threshold);
  for (const std::uint32_t count : header.symbol_counts) writer.write(count);
}

PayloadHeader read_payload_header(const TileShape& shape, CodeType type, ByteReader& reader) {
  const auto version = reader.read<std::uint8_t>();
  if (version != kCodecVersion) {
    if (version == 0) refuse_payload("its codec version is 0");
    throw Error(ErrorCode::kUnsupported,
                fmt::format("tile codec version {}; this build reads versions 1 and 2", version));
  }
  PayloadHeader header;
  header.type = type;
  if (const auto found = reader.read<std::uint8_t>(); found != byte_of(type)) {
    refuse_payload(
        fmt::format("its sample type is {}, the archive's is {} ({})", found, byte_of(type), to_string(type)));
  }
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & ~(kHasVoids | kIsConstant)) != 0) refuse_payload(fmt::format("reserved flags are set: {:#04x}", flags));
  header.has_voids = (flags & kHasVoids) != 0;
  header.is_constant = (flags & kIsConstant) != 0;
  header.dropped_bits = reader.read<std::uint8_t>();
  if (header.dropped_bits > (type == CodeType::kF32 ? 30 : 0)) {
    refuse_payload(fmt::format("{} low bits are left out, too many for {}", header.dropped_bits, to_string(type)));
  }
  header.low = reader.read<std::int32_t>();
  header.high = reader.read<std::int32_t>();
  header.mask_bytes = reader.read<std::uint32_t>();
  check_range(header);
  if (header.has_voids != (header.mask_bytes != 0)) refuse_payload("its void mask contradicts its flag for voids");
  const auto samples = static_cast<std::uint64_t>(shape.stored_vertex_count());
  if (header.mask_bytes > samples + 8)
    refuse_payload(fmt::format("its void mask of {} bytes is too long", header.mask_bytes));
  if (header.is_constant) return header;

  header.base = reader.read<std::int32_t>();
  header.extra_bytes = reader.read<std::uint32_t>();
  header.energy_shift = reader.read<std::uint8_t>();
  const std::size_t contexts = reader.read<std::uint8_t>();
  if (contexts < 1 || contexts > kMaxContexts)
    refuse_payload(fmt::format("it has {} contexts, must have 1..{}", contexts, kMaxContexts));
  header.paired = reader.read<std::uint16_t>();
  if ((std::uint32_t{header.paired} >> contexts) != 0) {
    refuse_payload(
        fmt::format("it has pairs in context {}, the last is {}", std::bit_width(header.paired) - 1, contexts - 1));
  }
  if (const auto predictors = reader.read<std::uint8_t>(); predictors != 1)
    refuse_payload(fmt::format("it has {} predictors, must have 1", predictors));
  const std::size_t weight_count = reader.read<std::uint8_t>();
  if (weight_count != kNearWeightCount && weight_count != kWeightCount) {
    refuse_payload(
        fmt::format("its predictor has {} weights, must have {} or {}", weight_count, kNearWeightCount, kWeightCount));
  }
  header.predictors.is_wide = weight_count == kWeightCount;
  header.predictors.weights = {};
  for (std::size_t i = 0; i < weight_count; ++i) header.predictors.weights[i] = reader.read<std::int16_t>();
  for (std::size_t i = 1; i < contexts; ++i) header.thresholds.push_back(reader.read<std::uint16_t>());
  std::uint64_t symbols = 0;
  for (std::size_t i = 0; i < contexts; ++i) {
    header.symbol_counts.push_back(reader.read<std::uint32_t>());
    symbols += header.symbol_counts.back();
  }
  check_predictor(header);
  if (symbols > samples)
    refuse_payload(fmt::format("it has {} symbols, more than the tile's {} samples", symbols, samples));
  return header;
}

SymbolStreams::SymbolStreams(const PayloadHeader& header, ByteReader& reader) {
  const auto is_paired = [&](std::size_t context) { return ((header.paired >> context) & 1U) != 0; };
  std::size_t unpaired = 0;
  for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) unpaired += is_paired(i) ? header.symbol_counts[i] : 0;
  unpaired_ = std::make_unique_for_overwrite<std::byte[]>(unpaired);
  std::byte* to = unpaired_.get();
  for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
    const std::size_t count = header.symbol_counts[i];
    if (is_paired(i)) {
      unpair_symbols(reader, {to, count});
      streams_[i] = {to, count};
      to += count;
    } else {
      streams_[i] = reader.read_bytes(count);
    }
  }
}

std::vector<std::byte> pack_void_mask(std::span<const std::uint8_t> is_void) {
  std::vector<std::byte> packed;
  std::uint8_t of = 0;
  for (auto at = is_void.begin(); at != is_void.end(); of ^= 1U) {
    const auto end = std::find(at, is_void.end(), static_cast<std::uint8_t>(of ^ 1U));
    append_leb128(static_cast<std::size_t>(end - at), packed);
    at = end;
  }
  return packed;
}

std::vector<std::uint8_t> unpack_void_mask(std::span<const std::byte> packed, std::size_t samples) {
  const auto refuse_payload = [](const std::string& why) { throw Error(ErrorCode::kCorrupt, "void mask: " + why); };
  std::vector<std::uint8_t> is_void(samples);
  std::size_t filled = 0;
  std::size_t voids = 0;
  std::uint8_t of = 0;
  for (bool is_first = true; !packed.empty(); of ^= 1U, is_first = false) {
    const auto taken = take_leb128(packed);
    if (!taken) refuse_payload("a run is cut off, too long a number, or not in shortest form");
    const std::size_t run = *taken;
    if (run == 0 && !is_first) refuse_payload("a run behind the first is empty");
    if (run > samples - filled) refuse_payload(fmt::format("its runs add up to more than {} samples", samples));
    std::fill_n(is_void.begin() + static_cast<std::ptrdiff_t>(filled), run, of);
    filled += run;
    voids += of * run;
  }
  if (filled != samples) refuse_payload(fmt::format("its runs add up to {} of {} samples", filled, samples));
  if (voids == 0 || voids == samples)
    refuse_payload(fmt::format("{} of {} samples are void, a mask has some of each", voids, samples));
  return is_void;
}

}  // namespace isohf
