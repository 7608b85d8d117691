#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <string_view>

#include "isohf/error.h"
#include "isohf/raster.h"

/// Checks of what callers hand in, for the front doors of the library: behind these it holds.

namespace isohf {

/// The most columns, rows, and samples of a raster: their bytes are counted in 64 bits.
inline constexpr std::int64_t kMaxSide = std::int64_t{1} << 40U;
inline constexpr std::int64_t kMaxSamples = std::int64_t{1} << 59U;

/// Throws Error{kInvalidArgument} unless a raster has 1 to kMaxSide columns and rows, kMaxSamples at most. `what` has
/// them: "a grid", "mem".
void require_size(const std::string& what, std::int64_t width, std::int64_t height);

[[noreturn]] void refuse_unknown(std::string_view what, std::int64_t found, std::int64_t last);

/// A number that was cast to an enumeration need be none of its values, which count from 0 to `last`.
template <typename Enum>
void require_known(std::string_view what, Enum value, Enum last) {
  const auto found = static_cast<std::int64_t>(value);
  if (found < 0 || value > last) refuse_unknown(what, found, static_cast<std::int64_t>(last));
}

/// Throws Error{kInvalidArgument} where a window reaches beyond its raster, or the room for its samples is not theirs.
void require_window(const std::string& path, std::int64_t width, std::int64_t height, const Window& window,
                    std::size_t sample_bytes, std::size_t room_bytes);

/// Throws Error{kInvalidArgument} for what no source can say of itself: it need not be a reader of ours.
void require_source(const SourceInfo& info);

/// What a user must hear of rows beyond a pole, one line; empty where there are none.
[[nodiscard]] std::string latitude_warning(const SourceInfo& info);

/// Throws Error{kInvalidArgument} where there is no function to hand rows to.
template <typename Take>
void require_callback(const Take& take) {
  if (!take) throw Error(ErrorCode::kInvalidArgument, "there is no function to hand rows to");
}

/// Does what allocates by a caller's numbers, for `what`: memory that the system does not have is an Error{kOutOfMemory}.
template <typename Act>
decltype(auto) or_out_of_memory(const std::string& what, Act act) {
  try {
    return act();
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, {what, "out of memory", "", ""});
  }
}

}  // namespace isohf
