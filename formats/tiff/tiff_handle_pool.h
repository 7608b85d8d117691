#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "formats/tiff/tiff_file.h"

namespace isohf {

/// Handles on one directory for any number of threads, opened when first needed.
class TiffHandlePool {
 public:
  TiffHandlePool(const RawFile& file, std::uint32_t directory) : file_(&file), directory_(directory) {}

  [[nodiscard]] std::unique_ptr<TiffHandle> take();
  void give_back(std::unique_ptr<TiffHandle> handle);

 private:
  const RawFile* file_;
  std::uint32_t directory_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<TiffHandle>> idle_;
};

}  // namespace isohf
