#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>

namespace isohf {

/// Decoded blocks of one size, at most `capacity` of them; the least recently used makes room. Not thread-safe.
/// A buffer stays where it is until `capacity` other blocks were found or claimed after it.
class BlockCache {
 public:
  /// block_bytes > 0, capacity > 0. Buffers are allocated when first claimed.
  BlockCache(std::size_t block_bytes, std::size_t capacity) : block_bytes_(block_bytes), capacity_(capacity) {}

  /// The buffer of block `index`, or nullptr where it is not held.
  [[nodiscard]] std::byte* find(std::uint64_t index) {
    const auto found = places_.find(index);
    if (found == places_.end()) return nullptr;
    order_.splice(order_.end(), order_, found->second);
    return found->second->bytes.get();
  }

  /// A buffer for block `index`, which is not held; its bytes are anything.
  [[nodiscard]] std::byte* claim(std::uint64_t index) {
    if (order_.size() < capacity_) {
      order_.push_back({index, std::make_unique_for_overwrite<std::byte[]>(block_bytes_)});
    } else {
      places_.erase(order_.front().index);
      order_.front().index = index;
      order_.splice(order_.end(), order_, order_.begin());
    }
    places_[index] = std::prev(order_.end());
    return order_.back().bytes.get();
  }

  /// Forgets everything, as after a failed decode.
  void clear() {
    places_.clear();
    order_.clear();
  }

  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  [[nodiscard]] std::size_t block_bytes() const { return block_bytes_; }

 private:
  struct Slot {
    std::uint64_t index;
    std::unique_ptr<std::byte[]> bytes;
  };

  std::size_t block_bytes_;
  std::size_t capacity_;
  std::list<Slot> order_;  // least recently used first
  std::unordered_map<std::uint64_t, std::list<Slot>::iterator> places_;
};

}  // namespace isohf
