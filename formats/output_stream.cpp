#include "formats/output_stream.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "isohf/base/error.h"

namespace isohf {
namespace {

[[noreturn]] void fail() {
  const int error = errno;
  throw Error(ErrorCode::kIo, fmt::format("cannot be written: {}", std::strerror(error)));
}

}  // namespace

OutputStream::OutputStream(const std::string& path) : file_(std::fopen(path.c_str(), "wb")) {
  if (file_ == nullptr) fail();
}

OutputStream::~OutputStream() {
  if (file_ != nullptr) std::fclose(file_);
}

void OutputStream::write(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
}

void OutputStream::close() {
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) fail();
}

}  // namespace isohf
