#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/convert/parts/assembly.h"
#include "isohf/restore/lossless.h"

namespace isohf {

/// The residual members of an archive that was cut: each belongs to one tile of the first column (residual_rows_at), and
/// is in the parts that hold that tile.
class ResidualMembers {
 public:
  /// tiles  that are to be there, of `tile_rows` rows
  ResidualMembers(LosslessRecord record, const std::vector<AssemblyInput>& inputs, const TileRange& tiles,
                  std::int64_t tile_rows)
      : record_(std::move(record)), inputs_(inputs), tiles_(tiles), tile_rows_(tile_rows) {}

  /// Of the whole, with the bytes that were copied.
  [[nodiscard]] const LosslessRecord& record() const { return record_; }
  /// Whether all of the whole's are there.
  [[nodiscard]] bool are_complete() const;
  /// Copies those of `tiles`, in the order in which convert() writes them.
  void copy_to(ArchiveWriter& writer);

 private:
  struct Found {
    const ArchiveReader* from;
    MemberEntry member;
  };
  [[nodiscard]] std::optional<Found> find(const std::string& name, std::int64_t member) const;
  [[nodiscard]] std::optional<Found> find(std::int64_t member) const {
    return find(residual_name(member * record_.rows_per_member), member);
  }
  [[nodiscard]] std::int64_t members() const {
    return (record_.height + record_.rows_per_member - 1) / record_.rows_per_member;
  }

  LosslessRecord record_;
  const std::vector<AssemblyInput>& inputs_;
  TileRange tiles_;
  std::int64_t tile_rows_;
};

}  // namespace isohf
