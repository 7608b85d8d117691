#include "isohf/base/memory/kept_rows.h"

#include "isohf/error.h"

namespace isohf {

void RowFile::add(std::int64_t row) {
  if (!file_.is_open()) file_ = File::scratch(folder_, 0);
  if (free_.empty()) {
    places_[row] = places_.size() * row_bytes_;
    return;
  }
  places_[row] = free_.back();
  free_.pop_back();
}

void RowFile::drop(std::int64_t row) {
  const auto found = places_.find(row);
  free_.push_back(found->second);
  places_.erase(found);
}

void RowFile::write(std::int64_t row, std::uint64_t offset_bytes, std::span<const std::byte> bytes) {
  file_.write_at(places_.find(row)->second + offset_bytes, bytes);
}

void RowFile::read(std::int64_t row, std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  if (file_.read_at(places_.find(row)->second + offset_bytes, bytes) != bytes.size()) {
    throw Error(ErrorCode::kIo, file_.path() + ": the scratch file there lost what was written to it");
  }
}

}  // namespace isohf
