#pragma once

#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdio>

// Needs <cstdio> before it.
#include <jpeglib.h>

namespace isohf {

/// libjpeg's error handler: notes the message and jumps. Warnings, where libjpeg would go on with pixels that it made
/// up, are errors as well.
struct JpegErrors {
  jpeg_error_mgr base{};  // first: libjpeg hands out a pointer to it
  std::jmp_buf jump{};
  std::array<char, JMSG_LENGTH_MAX> text{};

  JpegErrors() {
    jpeg_std_error(&base);
    base.error_exit = fail;
    base.emit_message = [](j_common_ptr jpeg, int level) {
      if (level < 0) fail(jpeg);
    };
  }
  static void fail(j_common_ptr jpeg) {
    auto* const self = reinterpret_cast<JpegErrors*>(jpeg->err);
    self->base.format_message(jpeg, self->text.data());
    std::longjmp(self->jump, 1);  // NOLINT(cert-err52-cpp): libjpeg's way to return errors
  }
};

}  // namespace isohf
