#include "formats/geotiff/tiff_io.h"

#include <tiffio.h>

#include <cstdio>

namespace isohf {
namespace {

TiffIo& io_of(thandle_t handle) {
  return *static_cast<TiffIo*>(handle);
}

tmsize_t read_io(thandle_t handle, void* bytes, tmsize_t count) {
  return io_of(handle).read(bytes, count);
}

tmsize_t write_io(thandle_t handle, void* bytes, tmsize_t count) {
  return io_of(handle).write(bytes, count);
}

toff_t seek_io(thandle_t handle, toff_t offset, int whence) {
  return io_of(handle).seek(offset, whence);
}

int close_io(thandle_t /*handle*/) {
  return 0;  // whoever opened it closes it
}

toff_t size_io(thandle_t handle) {
  return io_of(handle).size_bytes();
}

}  // namespace

tiff* TiffIo::open(const char* mode, TIFFOpenOptions* options) {
  return TIFFClientOpenExt(file_.path().c_str(), mode, this, read_io, write_io, seek_io, close_io, size_io, nullptr,
                           nullptr, options);
}

std::int64_t TiffIo::read(void* bytes, std::int64_t count) {
  try {
    const std::size_t got = file_.read_at(at_, {static_cast<std::byte*>(bytes), static_cast<std::size_t>(count)});
    at_ += got;
    return static_cast<std::int64_t>(got);
  } catch (const Error& error) {
    if (!failure_) failure_ = error;
    return -1;
  }
}

std::int64_t TiffIo::write(const void* bytes, std::int64_t count) {
  try {
    file_.write_at(at_, {static_cast<const std::byte*>(bytes), static_cast<std::size_t>(count)});
    at_ += static_cast<std::uint64_t>(count);
    return count;
  } catch (const Error& error) {
    if (!failure_) failure_ = error;
    return -1;
  }
}

std::uint64_t TiffIo::seek(std::uint64_t offset, int whence) {
  at_ = whence == SEEK_SET ? offset : whence == SEEK_CUR ? at_ + offset : size_bytes() + offset;
  return at_;
}

}  // namespace isohf
