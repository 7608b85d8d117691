#include "isohf/archive/tile/adaptive/adaptive_payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

enum : std::uint8_t { kHasVoids = 1, kHasWeights = 2, kIsWide = 4, kHasEightStates = 8 };

[[noreturn]] void refuse_tables(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, "tile header: " + why);
}

std::size_t read_size(ByteReader& reader) {
  std::span<const std::byte> rest = reader.rest();
  const auto size = take_leb128(rest);
  if (!size) refuse_tables("a size is cut off, too long a number, or not in shortest form");
  static_cast<void>(reader.read_bytes(reader.remaining() - rest.size()));
  return *size;
}

void read_weights(AdaptivePayload& payload, bool is_wide, ByteReader& reader) {
  PredictorWeights weights{};
  int sum = 0;
  for (std::size_t i = 0; i < (is_wide ? kWeightCount : kNearWeightCount); ++i) {
    weights[i] = reader.read<std::int16_t>();
    sum += std::abs(int{weights[i]});
  }
  if (sum >= kWeightSumLimit)
    refuse_tables(fmt::format("its weights add up to {}, must be below {}", sum, kWeightSumLimit));
  payload.predictors.weights = weights;
  payload.predictors.is_wide = is_wide;
}

}  // namespace

void write_adaptive_payload(const AdaptivePayload& payload, std::span<const std::uint16_t> words,
                            std::span<const std::byte> extra, std::vector<std::byte>& out) {
  ByteWriter writer(out);
  const bool is_wide = payload.has_weights && payload.predictors.is_wide;
  writer.write(kAdaptiveVersion);
  writer.write(static_cast<std::uint8_t>(payload.type == CodeType::kU8 ? 1 : 0));
  writer.write(static_cast<std::uint8_t>((payload.is_void.empty() ? 0 : kHasVoids) |
                                         (payload.has_weights ? kHasWeights : 0) | (is_wide ? kIsWide : 0) |
                                         (payload.states.size() == kMostStates ? kHasEightStates : 0)));
  for (const std::int32_t code : {payload.low, payload.high, payload.base}) {
    writer.write(static_cast<std::uint16_t>(code));
  }
  for (std::size_t i = 0; payload.has_weights && i < (is_wide ? kWeightCount : kNearWeightCount); ++i) {
    writer.write(payload.predictors.weights[i]);
  }
  if (!payload.is_void.empty()) {
    const std::vector<std::byte> mask = pack_void_mask(payload.is_void);
    append_leb128(mask.size(), out);
    writer.write_bytes(mask);
  }
  for (const std::uint32_t state : payload.states) writer.write(state);
  append_leb128(words.size(), out);
  writer.write_bytes(std::as_bytes(words));
  writer.write_bytes(extra);
}

AdaptivePayload read_adaptive_payload(const TileShape& shape, CodeType type, std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  AdaptivePayload payload;
  payload.type = type;
  static_cast<void>(reader.read<std::uint8_t>());
  if (const auto found = reader.read<std::uint8_t>();
      type == CodeType::kF32 || found != (type == CodeType::kU8 ? 1 : 0)) {
    refuse_tables(fmt::format("its sample type is {}, the archive's is {}", found, to_string(type)));
  }
  const auto flags = reader.read<std::uint8_t>();
  if (flags > (kHasVoids | kHasWeights | kIsWide | kHasEightStates)) {
    refuse_tables(fmt::format("reserved flags are set: {:#04x}", flags));
  }
  payload.low = reader.read<std::uint16_t>();
  payload.high = reader.read<std::uint16_t>();
  payload.base = reader.read<std::uint16_t>();
  const int most = type == CodeType::kU8 ? 254 : 65534;
  if (payload.low >= payload.high || payload.high > most) {
    refuse_tables(fmt::format("its range {}..{} is none within 0..{}", payload.low, payload.high, most));
  }
  if (payload.base < payload.low || payload.base > payload.high) {
    refuse_tables(fmt::format("its base {} lies outside its range {}..{}", payload.base, payload.low, payload.high));
  }
  payload.has_weights = (flags & kHasWeights) != 0;
  if (payload.has_weights) {
    read_weights(payload, (flags & kIsWide) != 0, reader);
  } else if ((flags & kIsWide) != 0) {
    refuse_tables("its flags speak of weights that are not there");
  }
  if ((flags & kHasVoids) != 0) {
    const std::size_t size = read_size(reader);
    payload.is_void = unpack_void_mask(reader.read_bytes(size), static_cast<std::size_t>(shape.stored_vertex_count()));
  }
  payload.states.resize((flags & kHasEightStates) != 0 ? kMostStates : 1);
  for (std::uint32_t& state : payload.states) {
    state = reader.read<std::uint32_t>();
    if (state < kFirstState) refuse_tables(fmt::format("a state is {}, must be {} or more", state, kFirstState));
  }
  payload.words = reader.read_bytes(2 * read_size(reader));
  payload.extra = reader.rest();
  return payload;
}

}  // namespace isohf
