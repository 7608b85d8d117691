#pragma once

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "isohf/error.h"

/// What crosses a module's C boundary, seen from inside the modules isohf_oiio.so, isohf_proj.so and isohf_netcdf.so.

namespace isohf {

/// Cut to what `out` holds, on one line; nullptr counts as empty.
template <std::size_t kSize>
void put_text(char (&out)[kSize], const char* text) {
  std::snprintf(out, kSize, "%s", text != nullptr ? text : "");
  std::replace(out, out + std::strlen(out), '\n', ' ');
}

template <std::size_t kSize>
void put_text(char (&out)[kSize], const std::string& text) {
  put_text(out, text.c_str());
}

/// Runs `action` and turns what it throws into a result code and a message. `library` is whose exceptions these are,
/// and `otherwise` the code of those that have none.
template <typename Message, typename Action>
int guarded(Message* message, const char* library, ErrorCode otherwise, Action action) {
  const auto report = [&](ErrorCode code, const std::string& text) {
    put_text(message->text, text.c_str());
    return static_cast<int>(code) + 1;
  };
  try {
    action();
    return 0;
  } catch (const Error& error) {
    return report(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return report(ErrorCode::kOutOfMemory, std::string(library) + " ran out of memory");
  } catch (const std::exception& error) {
    return report(otherwise, error.what());
  } catch (...) {
    return report(otherwise, std::string(library) + " failed without saying why");
  }
}

}  // namespace isohf
