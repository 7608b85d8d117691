#include "formats/tiff/tiff_handle_pool.h"

#include <utility>

namespace isohf {

std::unique_ptr<TiffHandle> TiffHandlePool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<TiffHandle> handle = std::move(idle_.back());
      idle_.pop_back();
      return handle;
    }
  }
  return std::make_unique<TiffHandle>(*file_, directory_, false);
}

void TiffHandlePool::give_back(std::unique_ptr<TiffHandle> handle) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(handle));
}

}  // namespace isohf
