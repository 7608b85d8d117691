#pragma once

#include <cstdint>
#include <string>

#include "formats/module_inside.h"
#include "formats/oiio/oiio_module.h"
#include "isohf/error.h"

/// What the source files of the module isohf_oiio.so share; not for anybody else.

namespace isohf {

/// `action` on the far side of the C boundary.
template <typename Action>
int guarded(IsohfOiioMessage* message, Action action) {
  return guarded(message, "OpenImageIO", ErrorCode::kCorrupt, action);
}

/// OpenImageIO hands out pictures: where it would deliver other numbers than the file holds, the file is refused.
/// `bits` are those of a sample as delivered, `stored_bits` those in the file. Throws Error{kUnsupported} saying why,
/// and what to do.
void require_stored_numbers(const std::string& format, int bits, int stored_bits, bool is_floating,
                            const std::string& path);

/// Whether the file says where it lies in a way that OpenImageIO does not hand on: JPEG 2000 with the box of GeoJP2.
bool states_a_place(const std::string& format, const std::string& path);

}  // namespace isohf

int isohf_oiio_open_photo(const char* path, IsohfOiioPhoto** photo, IsohfOiioPhotoInfo* info,
                          IsohfOiioMessage* message);
int isohf_oiio_read_photo(IsohfOiioPhoto* photo, int64_t column, int64_t row, int64_t columns, int64_t rows,
                          uint8_t* samples, size_t bytes, IsohfOiioMessage* message);
void isohf_oiio_bound_photo(IsohfOiioPhoto* photo, int64_t bytes);
void isohf_oiio_close_photo(IsohfOiioPhoto* photo);
