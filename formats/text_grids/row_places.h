#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isohf {

/// Where rows of a text begin: of every row, or of every second, fourth, ... once there are many (512 KiB at most).
class RowPlaces {
 public:
  struct Place {
    std::int64_t row = 0;
    std::uint64_t offset_bytes = 0;
  };

  /// Takes rows in their order, from 0.
  void note(std::int64_t row, std::uint64_t offset_bytes) {
    if (row % stride_ != 0) return;
    if (offsets_.size() == kMost) {
      for (std::size_t i = 0; i < kMost / 2; ++i) offsets_[i] = offsets_[2 * i];
      offsets_.resize(kMost / 2);
      stride_ *= 2;
      if (row % stride_ != 0) return;
    }
    offsets_.push_back(offset_bytes);
  }

  /// The nearest one that is known at or before `row`, which has been passed.
  [[nodiscard]] Place before(std::int64_t row) const {
    const std::int64_t place = row / stride_;
    return {place * stride_, offsets_[static_cast<std::size_t>(place)]};
  }

 private:
  static constexpr std::size_t kMost = 65536;

  std::vector<std::uint64_t> offsets_;
  std::int64_t stride_ = 1;
};

}  // namespace isohf
