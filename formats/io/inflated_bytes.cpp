#include "formats/io/inflated_bytes.h"

#include <fmt/core.h>
#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <list>
#include <utility>
#include <vector>

#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kMostPlaces = 128;
constexpr std::uint64_t kFirstStride = std::uint64_t{1} << 20U;
constexpr std::size_t kStoredBytes = std::size_t{1} << 16U;
/// zlib copies its window of 32 KiB aside after every call: few calls, and what they fill fits the second cache.
constexpr std::size_t kScratchBytes = std::size_t{1} << 18U;
constexpr std::size_t kPieceBytes = std::size_t{1} << 20U;
/// zlib's state with its window, in blocks of the heap.
constexpr std::uint64_t kDecoderBytes = std::uint64_t{48} << 10U;
constexpr int kGzipWindow = 16 + MAX_WBITS;
constexpr int kRawWindow = -MAX_WBITS;

/// zlib's decoder between two calls: it can be copied, and carried on from the same stored byte.
class Decoder {
 public:
  explicit Decoder(int window) {
    if (inflateInit2(&stream_, window) != Z_OK) throw Error(ErrorCode::kOutOfMemory, "no memory to inflate");
  }
  Decoder(const Decoder& other) : stored_at(other.stored_at), inflated_at(other.inflated_at) {
    if (inflateCopy(&stream_, const_cast<z_stream*>(&other.stream_)) != Z_OK) {
      throw Error(ErrorCode::kOutOfMemory, "no memory to inflate");
    }
  }
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { inflateEnd(&stream_); }

  /// Feeds `in`, fills `out`; takes what it used off the front of both.
  int step(std::span<std::byte>& in, std::span<std::byte>& out) {
    stream_.next_in = reinterpret_cast<Bytef*>(in.data());
    stream_.avail_in = static_cast<uInt>(in.size());
    stream_.next_out = reinterpret_cast<Bytef*>(out.data());
    stream_.avail_out = static_cast<uInt>(std::min<std::size_t>(out.size(), std::numeric_limits<uInt>::max()));
    const std::size_t asked = stream_.avail_out;
    const int result = inflate(&stream_, Z_NO_FLUSH);
    const std::size_t used = in.size() - stream_.avail_in;
    const std::size_t made = asked - stream_.avail_out;
    in = in.subspan(used);
    out = out.subspan(made);
    stored_at += used;
    inflated_at += made;
    return result;
  }
  void begin_member() { inflateReset(&stream_); }
  /// Goes on without gzip's checksum, whose length it still verifies.
  void trust() { inflateValidate(&stream_, 0); }
  [[nodiscard]] const char* message() const { return stream_.msg != nullptr ? stream_.msg : "no valid data"; }

  std::uint64_t stored_at = 0;
  std::uint64_t inflated_at = 0;

 private:
  z_stream stream_ = {};
};

/// Where a gzip member ends with its size.
constexpr std::size_t kSizeBytes = 4;
constexpr std::size_t kLeastRoomBytes = std::size_t{1} << 16U;
/// Deflate packs no better than this: a size that says more is no size.
constexpr std::uint64_t kMostRatio = 1032;

using Decompressor = std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>;

Decompressor make_decompressor() {
  return {libdeflate_alloc_decompressor(), &libdeflate_free_decompressor};
}

/// Zero bytes behind the last member are padding.
std::span<const std::byte> without_padding(std::span<const std::byte> stored) {
  const auto first = std::find_if(stored.begin(), stored.end(), [](std::byte byte) { return byte != std::byte{0}; });
  return stored.subspan(static_cast<std::size_t>(first - stored.begin()));
}

}  // namespace

struct InflatedBytes::State {
  State(std::string given_name, ReadStored read, Kind given_kind)
      : name(std::move(given_name)), read_stored(std::move(read)), kind(given_kind), stored(kStoredBytes) {
    restart(nullptr);
  }

  [[noreturn]] void corrupt(const std::string& why) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} data: {} at byte {}", name,
                                                 kind == Kind::kGzip ? "gzip" : "deflated", why, decoder->stored_at));
  }

  /// Goes to a kept place, or to the beginning.
  void restart(const Decoder* place) {
    const int window = kind == Kind::kGzip ? kGzipWindow : kRawWindow;
    decoder = place == nullptr ? std::make_unique<Decoder>(window) : std::make_unique<Decoder>(*place);
    // All of it has been verified once.
    if (checked) decoder->trust();
    pending = {};
    ended = false;
  }

  /// Fills `out` as far as there is data; returns the number of bytes.
  std::size_t inflate_into(std::span<std::byte> out) {
    const std::size_t wanted = out.size();
    while (!out.empty() && !ended) {
      if (pending.empty()) {
        pending = std::span(stored).first(read_stored(decoder->stored_at, stored));
        if (pending.empty()) corrupt("ends early");
      }
      const int result = decoder->step(pending, out);
      if (result == Z_STREAM_END) {
        end_member();
      } else if (result != Z_OK && result != Z_BUF_ERROR) {
        corrupt(decoder->message());
      }
    }
    return wanted - out.size();
  }

  /// Keeps places as it goes; data that ended no earlier when they were checked must not now.
  void inflate_checked(std::span<std::byte> out) {
    while (!out.empty()) {
      const auto piece = out.first(std::min(out.size(), kPieceBytes));
      if (inflate_into(piece) != piece.size()) corrupt("has changed since it was opened");
      if (!ended) keep_place();
      out = out.subspan(piece.size());
    }
  }

  /// Another member may follow; zero bytes are padding.
  void end_member() {
    if (kind == Kind::kRawDeflate) {
      ended = true;
      return;
    }
    for (;;) {
      if (pending.empty()) {
        pending = std::span(stored).first(read_stored(decoder->stored_at, stored));
        if (pending.empty()) {
          ended = true;
          return;
        }
      }
      if (pending.front() != std::byte{0}) break;
      pending = pending.subspan(1);
      ++decoder->stored_at;
    }
    decoder->begin_member();
  }

  void keep_place() {
    if (decoder->inflated_at < next_place) return;
    if (places.size() == kMostPlaces) {
      for (auto at = places.begin(); at != places.end() && std::next(at) != places.end(); ++at) {
        places.erase(std::next(at));
      }
      stride *= 2;
    }
    places.push_back(*decoder);
    next_place = decoder->inflated_at + stride;
  }

  std::string name;
  ReadStored read_stored;
  Kind kind;
  std::vector<std::byte> stored;
  std::span<std::byte> pending;  ///< of `stored`, not yet used
  std::unique_ptr<Decoder> decoder;
  bool ended = false;
  bool checked = false;
  std::list<Decoder> places;  ///< by rising offset
  std::uint64_t stride = kFirstStride;
  std::uint64_t next_place = kFirstStride;
  std::uint64_t size = 0;
  uLong crc = ::crc32(0, nullptr, 0);
};

InflatedBytes::InflatedBytes(std::string name, ReadStored read_stored, Kind kind)
    : state_(std::make_unique<State>(std::move(name), std::move(read_stored), kind)) {
  std::vector<std::byte> scratch(kScratchBytes);
  while (!state_->ended) {
    const std::size_t got = state_->inflate_into(scratch);
    if (kind == Kind::kRawDeflate) {  // gzip has one of its own, which zlib verifies
      state_->crc = ::crc32_z(state_->crc, reinterpret_cast<const Bytef*>(scratch.data()), got);
    }
    state_->size += got;
    if (!state_->ended) state_->keep_place();
  }
  state_->checked = true;
}

InflatedBytes::InflatedBytes(std::string name, ReadStored read_stored, Kind kind, std::uint64_t size_bytes)
    : state_(std::make_unique<State>(std::move(name), std::move(read_stored), kind)) {
  state_->size = size_bytes;
  state_->checked = true;
  state_->restart(nullptr);
}

InflatedBytes::~InflatedBytes() = default;

std::uint64_t InflatedBytes::memory_bytes(std::uint64_t size_bytes) {
  const std::uint64_t places = std::min<std::uint64_t>(size_bytes / kFirstStride, kMostPlaces);
  return (places + 1) * kDecoderBytes + kStoredBytes + kScratchBytes;
}

std::uint64_t InflatedBytes::size_bytes() const {
  return state_->size;
}

std::uint32_t InflatedBytes::crc32() const {
  return static_cast<std::uint32_t>(state_->crc);
}

std::size_t InflatedBytes::read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) {
  State& state = *state_;
  if (offset_bytes >= state.size) return 0;
  const Decoder* nearest = nullptr;
  for (const Decoder& place : state.places) {
    if (place.inflated_at <= offset_bytes) nearest = &place;
  }
  const std::uint64_t here = state.decoder->inflated_at;
  if (offset_bytes < here || (nearest != nullptr && nearest->inflated_at > here)) state.restart(nearest);
  try {
    std::vector<std::byte> scratch;
    while (state.decoder->inflated_at < offset_bytes) {
      scratch.resize(
          static_cast<std::size_t>(std::min<std::uint64_t>(kScratchBytes, offset_bytes - state.decoder->inflated_at)));
      state.inflate_checked(scratch);
    }
    bytes = bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), state.size - offset_bytes)));
    state.inflate_checked(bytes);
    return bytes.size();
  } catch (...) {
    state.restart(nullptr);
    throw;
  }
}

bool looks_like_gzip(std::span<const std::byte> head) {
  constexpr std::array<std::byte, 3> kMagic = {std::byte{0x1F}, std::byte{0x8B}, std::byte{8}};
  return head.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), head.begin());
}

std::size_t inflate_head(std::span<const std::byte> stored, std::span<std::byte> bytes) {
  Decoder decoder(kGzipWindow);
  std::vector<std::byte> copy(stored.begin(), stored.end());
  std::span<std::byte> in(copy);
  std::span<std::byte> out = bytes;
  while (!in.empty() && !out.empty()) {
    if (decoder.step(in, out) != Z_OK) break;
  }
  return bytes.size() - out.size();
}

bool UnpackedBytes::make_room(std::size_t bytes) {
  auto* const larger = static_cast<std::byte*>(std::realloc(room_.get(), bytes));
  if (larger == nullptr) return false;
  (void)room_.release();
  room_.reset(larger);
  room_bytes_ = bytes;
  return true;
}

std::optional<UnpackedBytes> UnpackedBytes::from_gzip(std::span<const std::byte> stored, std::uint64_t most_bytes) {
  const Decompressor decompressor = make_decompressor();
  if (!decompressor || stored.size() < kSizeBytes) return std::nullopt;
  // What the last member says of its size, modulo 2^32, is right for a file of one member, which nearly all are.
  const std::uint64_t said = ByteReader(stored.last(kSizeBytes)).read<std::uint32_t>();
  if (said > most_bytes || said > stored.size() * kMostRatio) return std::nullopt;
  UnpackedBytes unpacked;
  if (!unpacked.make_room(std::max<std::size_t>(static_cast<std::size_t>(said), 1))) return std::nullopt;
  do {
    std::size_t used = 0;
    std::size_t made = 0;
    const libdeflate_result result = libdeflate_gzip_decompress_ex(decompressor.get(), stored.data(), stored.size(),
                                                                   unpacked.room_.get() + unpacked.size_,
                                                                   unpacked.room_bytes_ - unpacked.size_, &used, &made);
    if (result == LIBDEFLATE_INSUFFICIENT_SPACE && unpacked.room_bytes_ < most_bytes) {
      const std::uint64_t more = std::max<std::uint64_t>(2 * std::uint64_t{unpacked.room_bytes_}, kLeastRoomBytes);
      if (!unpacked.make_room(static_cast<std::size_t>(std::min(more, most_bytes)))) return std::nullopt;
      continue;
    }
    if (result != LIBDEFLATE_SUCCESS) return std::nullopt;
    unpacked.size_ += made;
    stored = without_padding(stored.subspan(used));
  } while (!stored.empty());
  if (unpacked.size_ < unpacked.room_bytes_ && !unpacked.make_room(std::max<std::size_t>(unpacked.size_, 1))) {
    return std::nullopt;
  }
  return unpacked;
}

std::optional<UnpackedBytes> UnpackedBytes::from_deflated(std::span<const std::byte> stored, std::uint64_t size_bytes,
                                                          std::uint32_t crc32) {
  const Decompressor decompressor = make_decompressor();
  if (!decompressor || size_bytes > stored.size() * kMostRatio) return std::nullopt;
  UnpackedBytes unpacked;
  if (!unpacked.make_room(std::max<std::size_t>(static_cast<std::size_t>(size_bytes), 1))) return std::nullopt;
  unpacked.size_ = static_cast<std::size_t>(size_bytes);
  // Without a place for the number of bytes made, fewer than the room are an error.
  if (libdeflate_deflate_decompress_ex(decompressor.get(), stored.data(), stored.size(), unpacked.room_.get(),
                                       unpacked.size_, nullptr, nullptr) != LIBDEFLATE_SUCCESS ||
      libdeflate_crc32(0, unpacked.room_.get(), unpacked.size_) != crc32) {
    return std::nullopt;
  }
  return unpacked;
}

}  // namespace isohf
