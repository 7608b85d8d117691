#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "formats/oiio_module.h"
#include "isohf/base/error.h"

/// What the source files of the module isohf_oiio.so share; not for anybody else.

namespace isohf {

template <std::size_t kSize>
void put_text(char (&out)[kSize], const std::string& text) {
  std::snprintf(out, kSize, "%s", text.c_str());
  std::replace(out, out + std::strlen(out), '\n', ' ');
}

/// Runs `action` and turns what it throws into a result code and a message.
template <typename Action>
int guarded(IsohfOiioMessage* message, Action action) {
  const auto report = [&](ErrorCode code, const char* text) {
    put_text(message->text, text);
    return static_cast<int>(code) + 1;
  };
  try {
    action();
    return 0;
  } catch (const Error& error) {
    return report(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return report(ErrorCode::kOutOfMemory, "OpenImageIO ran out of memory");
  } catch (const std::exception& error) {
    return report(ErrorCode::kCorrupt, error.what());
  } catch (...) {
    return report(ErrorCode::kCorrupt, "OpenImageIO failed without saying why");
  }
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
