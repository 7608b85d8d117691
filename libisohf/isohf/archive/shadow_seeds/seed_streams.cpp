#include "isohf/archive/shadow_seeds/seed_streams.h"

#include <fmt/format.h>

#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/error.h"

namespace isohf {

void SymbolWriter::put(std::size_t stream, std::uint32_t value) {
  const unsigned symbol = symbol_of(value);
  streams_[stream].push_back(static_cast<std::byte>(symbol));
  const unsigned count = extra_bits_of_symbol(symbol);
  bits_ |= (value & ((std::uint64_t{1} << count) - 1)) << bit_count_;
  bit_count_ += count;
  for (; bit_count_ >= 8; bit_count_ -= 8, bits_ >>= 8U) extra_.push_back(static_cast<std::byte>(bits_ & 0xffU));
}

EncodedSeeds SymbolWriter::finish(std::vector<std::byte> header) {
  if (bit_count_ > 0) extra_.push_back(static_cast<std::byte>(bits_));
  std::vector<std::byte> payload = std::move(header);
  ByteWriter writer(payload);
  for (const auto& stream : streams_) writer.write(static_cast<std::uint32_t>(stream.size()));
  writer.write(static_cast<std::uint32_t>(extra_.size()));

  EncodedSeeds out;
  DeflateWriter deflate(out.deflated);
  std::uint32_t crc = crc32(payload);
  deflate.add(payload);
  streams_.push_back(std::move(extra_));
  std::size_t bytes = payload.size();
  for (const auto& stream : streams_) {
    bytes += stream.size();
    crc = crc32(stream, crc);
    if (!stream.empty()) deflate.add(stream);
  }
  deflate.finish();
  out.payload_bytes = static_cast<std::uint32_t>(bytes);
  out.payload_crc32 = crc;
  return out;
}

SymbolReader::SymbolReader(ByteReader& reader, std::size_t streams) : next_(streams, 0) {
  std::vector<std::uint32_t> counts(streams);
  for (auto& count : counts) count = reader.read<std::uint32_t>();
  const auto extra_bytes = reader.read<std::uint32_t>();
  for (const std::uint32_t count : counts) streams_.push_back(reader.read_bytes(count));
  extra_ = reader.read_bytes(extra_bytes);
  if (reader.remaining() != 0) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{} bytes follow the last stream", reader.remaining()));
  }
}

std::uint32_t SymbolReader::get(std::size_t stream) {
  if (left(stream) == 0) throw Error(ErrorCode::kCorrupt, fmt::format("stream {} ends early", stream));
  const auto symbol = static_cast<unsigned>(streams_[stream][next_[stream]++]);
  if (symbol >= symbol_limit(32)) throw Error(ErrorCode::kCorrupt, fmt::format("{} is no symbol", symbol));
  const unsigned count = extra_bits_of_symbol(symbol);
  while (bit_count_ < count) {
    if (extra_next_ == extra_.size()) throw Error(ErrorCode::kCorrupt, "the extra bits end early");
    bits_ |= static_cast<std::uint64_t>(extra_[extra_next_++]) << bit_count_;
    bit_count_ += 8;
  }
  const auto extra = static_cast<std::uint32_t>(bits_ & ((std::uint64_t{1} << count) - 1));
  bits_ >>= count;
  bit_count_ -= count;
  return zigzagged_from(symbol, extra);
}

void SymbolReader::finish() const {
  for (std::size_t stream = 0; stream < streams_.size(); ++stream) {
    if (left(stream) != 0) {
      throw Error(ErrorCode::kCorrupt, fmt::format("stream {} has {} symbols too many", stream, left(stream)));
    }
  }
  if (extra_next_ != extra_.size() || bits_ != 0) throw Error(ErrorCode::kCorrupt, "extra bits are left");
}

}  // namespace isohf
