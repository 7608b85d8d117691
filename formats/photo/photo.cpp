#include "formats/photo/photo.h"

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "formats/georeference/sidecars.h"
#include "formats/io/block_cache.h"
#include "formats/io/raw_file.h"
#include "formats/readers.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/photo/srgb.h"

namespace isohf {
namespace {

/// Rows that are decoded and cached together where the file has no blocks.
constexpr std::int64_t kBandRows = 64;

/// Keeps bands of whole rows.
class CachedPhoto final : public PhotoSource {
 public:
  CachedPhoto(PhotoInfo info, std::unique_ptr<PhotoRows> rows) : info_(std::move(info)), rows_(std::move(rows)) {
    set_cache_bytes(0);
  }

  [[nodiscard]] const PhotoInfo& info() const override { return info_; }

  void set_cache_bytes(std::uint64_t bytes) override {
    const std::size_t band_bytes = row_bytes() * static_cast<std::size_t>(info_.block_height);
    const std::lock_guard lock(mutex_);
    bands_.emplace(band_bytes, std::max<std::size_t>(static_cast<std::size_t>(bytes / band_bytes), 1));
  }

  void read_window(const Window& window, std::span<std::uint8_t> samples) override {
    require_window(info_.path, info_.width, info_.height, window, static_cast<std::size_t>(info_.channels),
                   samples.size());
    if (samples.empty()) return;
    const auto channels = static_cast<std::size_t>(info_.channels);
    const std::size_t out_bytes = static_cast<std::size_t>(window.columns) * channels;
    const std::lock_guard lock(mutex_);
    std::uint8_t* out = samples.data();
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row, out += out_bytes) {
      std::memcpy(out, row_of(row) + static_cast<std::size_t>(window.column) * channels, out_bytes);
    }
  }

 private:
  [[nodiscard]] std::size_t row_bytes() const {
    return static_cast<std::size_t>(info_.width) * static_cast<std::size_t>(info_.channels);
  }

  const std::byte* row_of(std::int64_t row) {
    const std::int64_t band = row / info_.block_height;
    const std::int64_t first = band * info_.block_height;
    std::byte* bytes = bands_->find(static_cast<std::uint64_t>(band));
    if (bytes == nullptr) {
      bytes = bands_->claim(static_cast<std::uint64_t>(band));
      const std::int64_t rows = std::min(info_.block_height, info_.height - first);
      try {
        // A thread that waits for its helpers must not take up work that waits for the mutex which it holds.
        oneapi::tbb::this_task_arena::isolate([&] {
          rows_->read(first, rows,
                      {reinterpret_cast<std::uint8_t*>(bytes), static_cast<std::size_t>(rows) * row_bytes()});
        });
      } catch (const Error& error) {
        bands_->clear();
        throw naming(info_.path, error);
      } catch (...) {
        bands_->clear();
        throw;
      }
    }
    return bytes + static_cast<std::size_t>(row - first) * row_bytes();
  }

  PhotoInfo info_;
  std::mutex mutex_;
  std::unique_ptr<PhotoRows> rows_;
  std::optional<BlockCache> bands_;
};

std::unique_ptr<PhotoRows> open_rows(const RawFile& file, PhotoInfo& info) {
  const std::string begin = first_bytes(file, 16);
  const auto head = std::as_bytes(std::span(begin));
  if (kPngFormat.recognises(head)) return open_png_rows(info);
  if (looks_like_webp(head)) return open_webp_rows(info);
  if (kTiffFormat.recognises(head)) return open_tiff_rows(info);
  if (head.size() > 3 && begin.starts_with("\xFF\xD8\xFF")) return open_jpeg_rows(info);
  return open_oiio_rows(info);
}

void find_georeference(PhotoInfo& info) {
  if (!info.georeference) {
    const std::optional<WorldFile> world = world_file_beside(info.path);
    if (!world) return;
    if (world->rows_from_south()) {
      throw Error(ErrorCode::kUnsupported, "its rows run from South to North; turn it first");
    }
    place_by(*world, info.height, info.georeference.emplace());
  }
  ReferenceSystem& system = info.georeference->system;
  if (system.wkt.empty() && !system.epsg) system.wkt = prj_beside(info.path);
}

}  // namespace

int photo_channels(int stored, int alpha, PhotoInfo& info) {
  if (stored == 1 || stored == 3 || (stored == 4 && alpha == 3)) return stored;
  if (stored != 4) {
    throw Error(ErrorCode::kUnsupported, fmt::format("has {} channels; photos are grey, RGB or RGBA", stored));
  }
  info.warnings.push_back(fmt::format("{}: of the photo's 4 channels the first three are read as RGB", info.path));
  return 3;
}

void read_whole_blocks(std::int64_t block_rows, PhotoInfo& info) {
  const std::int64_t blocks = std::max<std::int64_t>(info.block_height / block_rows, 1);
  info.block_height = std::min(blocks * block_rows, info.height);
}

void note_orientation(int orientation, PhotoInfo& info) {
  if (orientation <= 1 || orientation > 8) return;
  info.warnings.push_back(fmt::format(
      "{}: the photo's orientation tag is ignored: its first row is taken to be the northernmost", info.path));
}

void photo_samples(SampleType type, std::span<const std::byte> raw, int stored, int kept, bool is_light,
                   std::span<std::uint8_t> samples) {
  with_stored_type(type, [&](auto stored_type) {
    using T = decltype(stored_type);
    const std::byte* at = raw.data();
    for (std::size_t i = 0; i < samples.size(); at += sizeof(T) * static_cast<std::size_t>(stored)) {
      for (int channel = 0; channel < kept; ++channel, ++i) {
        const auto value = stored_at<T>(at + sizeof(T) * static_cast<std::size_t>(channel));
        if constexpr (sizeof(T) == 1) {
          samples[i] = static_cast<std::uint8_t>(value);
        } else if constexpr (std::is_same_v<T, std::uint16_t>) {
          samples[i] = static_cast<std::uint8_t>((value * 255U + 32767U) / 65535U);
        } else {
          const auto number = static_cast<float>(number_of(value));
          if (is_light && channel < 3) {
            samples[i] = srgb_from_linear(number);
          } else {
            samples[i] = number > 0.0F ? static_cast<std::uint8_t>(std::min(number, 1.0F) * 255.0F + 0.5F) : 0;
          }
        }
      }
    }
  });
}

std::unique_ptr<PhotoSource> open_photo(const std::string& path) {
  PhotoInfo info;
  info.path = path;
  info.block_height = kBandRows;
  const RawFile file(path);
  try {
    std::unique_ptr<PhotoRows> rows = open_rows(file, info);
    info.pixel_bytes = static_cast<std::uint64_t>(info.channels);
    find_georeference(info);
    return std::make_unique<CachedPhoto>(std::move(info), std::move(rows));
  } catch (const Error& error) {
    throw naming(path, error);
  }
}

}  // namespace isohf
