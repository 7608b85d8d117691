#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// Reads "WxH:TYPE" ("200x200:u16le"): columns, rows, and u8, i8 or u16, i16, u32, i32, f32, f64 with le or be for the
/// byte order. Throws Error{kInvalidArgument} saying what was found and what is required.
[[nodiscard]] RawLayout raw_layout_from_string(std::string_view text);

/// Opens a file of nothing but samples, row by row from the North-West one on, as options.raw says; nothing is known of
/// where they lie. Without options.raw a NAME.r16.json beside it says both, as isohf writes it. Throws Error:
/// kInvalidArgument without either, with a suggestion where the samples make a
/// square, and for a channel; kCorrupt for any other length than the layout's; kIo.
[[nodiscard]] std::unique_ptr<HeightSource> open_raw(const std::string& path, const OpenOptions& options);

}  // namespace isohf
