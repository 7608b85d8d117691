#include <fmt/format.h>

#include "formats/files/raw_file.h"
#include "formats/oiio/oiio_loader.h"
#include "formats/oiio/photo.h"
#include "formats/oiio/photo_place.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

class OiioPhoto final : public PhotoSource {
 public:
  explicit OiioPhoto(const std::string& path) : module_(oiio_module()) {
    IsohfOiioPhotoInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open_photo(path.c_str(), &photo_, &found, &message);
    if (result != 0) throw Error(module_error_code(result), message.text);
    info_.path = path;
    info_.format = found.format;
    info_.width = found.width;
    info_.height = found.height;
    info_.channels = found.channels;
    info_.block_height = found.block_height;
    info_.random_access = found.random_access != 0;
    info_.pixel_bytes = static_cast<std::uint64_t>(found.pixel_bytes);
    if (found.warning[0] != '\0') info_.warnings.push_back(fmt::format("{}: {}", path, found.warning));
  }
  ~OiioPhoto() override { module_.close_photo(photo_); }

  [[nodiscard]] const PhotoInfo& info() const override { return info_; }
  [[nodiscard]] PhotoInfo& mutable_info() { return info_; }

  void set_cache_bytes(std::uint64_t bytes) override { module_.bound_photo(photo_, static_cast<std::int64_t>(bytes)); }

  void read_window(const Window& window, std::span<std::uint8_t> samples) override {
    ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0 &&
                 window.column + window.columns <= info_.width && window.row + window.rows <= info_.height);
    if (samples.empty()) return;
    IsohfOiioMessage message{};
    const int result = module_.read_photo(photo_, window.column, window.row, window.columns, window.rows,
                                          samples.data(), samples.size(), &message);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", info_.path, message.text));
  }

 private:
  const IsohfOiioModule& module_;
  IsohfOiioPhoto* photo_ = nullptr;
  PhotoInfo info_;
};

}  // namespace

std::unique_ptr<PhotoSource> open_photo(const std::string& path) {
  const RawFile is_there(path);
  try {
    auto photo = std::make_unique<OiioPhoto>(path);
    photo->mutable_info().georeference = photo_georeference(path, photo->info().height);
    return photo;
  } catch (const Error& error) {
    throw error.within(path);
  }
}

}  // namespace isohf
