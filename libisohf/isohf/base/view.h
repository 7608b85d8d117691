#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace isohf {

/// A view of a row-major block of samples, column before row. Does not own; rows lie `stride` samples apart.
template <typename T>
class View2D {
 public:
  View2D() = default;
  View2D(T* data, std::int64_t columns, std::int64_t rows, std::int64_t stride)
      : data_(data), columns_(columns), rows_(rows), stride_(stride) {}
  View2D(T* data, std::int64_t columns, std::int64_t rows) : View2D(data, columns, rows, columns) {}

  /// A mutable view reads as a constant one.
  operator View2D<const T>() const { return {data_, columns_, rows_, stride_}; }  // NOLINT(google-explicit-constructor)

  [[nodiscard]] std::int64_t columns() const { return columns_; }
  [[nodiscard]] std::int64_t rows() const { return rows_; }
  [[nodiscard]] std::int64_t stride() const { return stride_; }
  [[nodiscard]] T* data() const { return data_; }
  [[nodiscard]] T* row(std::int64_t r) const { return data_ + r * stride_; }
  [[nodiscard]] T& operator()(std::int64_t c, std::int64_t r) const { return data_[r * stride_ + c]; }

 private:
  T* data_ = nullptr;
  std::int64_t columns_ = 0;
  std::int64_t rows_ = 0;
  std::int64_t stride_ = 0;
};

}  // namespace isohf
