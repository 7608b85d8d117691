#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "isohf/base/file.h"

namespace isohf {

/// Where rows are kept that memory has no room for: a folder for a scratch file; nullopt: they are in memory.
using ScratchFolder = std::optional<std::string>;

/// Places of rows in a scratch file without a name, all of one size; those of rows that are dropped are used again.
class RowFile {
 public:
  RowFile(std::uint64_t row_bytes, const std::string& folder) : row_bytes_(row_bytes), folder_(folder) {}

  void add(std::int64_t row);
  void drop(std::int64_t row);
  [[nodiscard]] bool has(std::int64_t row) const { return places_.contains(row); }
  /// From many threads at once, between add() and drop(). Throws Error{kIo}.
  void write(std::int64_t row, std::uint64_t offset_bytes, std::span<const std::byte> bytes);
  void read(std::int64_t row, std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

 private:
  std::uint64_t row_bytes_;
  std::string folder_;
  File file_;
  std::unordered_map<std::int64_t, std::uint64_t> places_;
  std::vector<std::uint64_t> free_;
};

/// Some rows of numbers, each of `width`, of a pass from North to South: in memory or in a scratch file.
template <typename T>
class KeptRows {
 public:
  KeptRows(std::size_t width, const ScratchFolder& scratch) : width_(width) {
    if (scratch) file_.emplace(width * sizeof(T), *scratch);
  }

  /// Makes room for a row that is written from now on.
  void add(std::int64_t row) {
    if (file_) return file_->add(row);
    std::vector<T>& kept = rows_[row];
    if (!free_.empty()) {
      kept = std::move(free_.back());
      free_.pop_back();
    }
    kept.resize(width_);
  }
  void drop(std::int64_t row) {
    if (file_) return file_->drop(row);
    const auto found = rows_.find(row);
    free_.push_back(std::move(found->second));
    rows_.erase(found);
  }
  /// Columns first, first + 1, ... of a row; from many threads at once, each on columns of its own.
  void write(std::int64_t row, std::size_t first, std::span<const T> values) {
    if (file_) return file_->write(row, first * sizeof(T), std::as_bytes(values));
    std::copy(values.begin(), values.end(), rows_.find(row)->second.begin() + static_cast<std::ptrdiff_t>(first));
  }
  /// What was written; `buffer` holds it where memory does not. From many threads at once.
  [[nodiscard]] std::span<const T> read(std::int64_t row, std::size_t first, std::size_t count,
                                        std::vector<T>& buffer) const {
    if (!file_) return std::span(rows_.find(row)->second).subspan(first, count);
    buffer.resize(count);
    file_->read(row, first * sizeof(T), std::as_writable_bytes(std::span(buffer)));
    return buffer;
  }

 private:
  std::size_t width_;
  std::unordered_map<std::int64_t, std::vector<T>> rows_;
  std::vector<std::vector<T>> free_;
  std::optional<RowFile> file_;
};

/// The same columns of several rows, each read once.
template <typename T>
class RowParts {
 public:
  /// Rows from `first_row` on.
  RowParts(const KeptRows<T>& rows, std::int64_t first_row, std::size_t first, std::size_t count)
      : rows_(rows), first_row_(first_row), first_(first), count_(count) {}

  [[nodiscard]] std::span<const T> row(std::int64_t row) {
    const auto i = static_cast<std::size_t>(row - first_row_);
    if (i >= parts_.size()) {
      parts_.resize(i + 1);
      buffers_.resize(i + 1);
    }
    if (parts_[i].empty()) parts_[i] = rows_.read(row, first_, count_, buffers_[i]);
    return parts_[i];
  }

 private:
  const KeptRows<T>& rows_;
  std::int64_t first_row_;
  std::size_t first_;
  std::size_t count_;
  std::vector<std::span<const T>> parts_;
  std::vector<std::vector<T>> buffers_;
};

}  // namespace isohf
