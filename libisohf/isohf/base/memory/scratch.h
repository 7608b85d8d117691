#pragma once

#include <cstddef>
#include <memory>

namespace isohf {

/// Room for `count` values that are written before they are read: a vector would set them to zero first.
template <typename T>
class Scratch {
 public:
  explicit Scratch(std::size_t count) : values_(std::make_unique_for_overwrite<T[]>(count)) {}
  [[nodiscard]] T* data() { return values_.get(); }
  [[nodiscard]] const T* data() const { return values_.get(); }

 private:
  std::unique_ptr<T[]> values_;
};

}  // namespace isohf
