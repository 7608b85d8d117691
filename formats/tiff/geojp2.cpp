#include "formats/tiff/geojp2.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <string_view>
#include <vector>

#include "formats/files/raw_file.h"
#include "formats/files/text.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSignature = "\0\0\0\x0CjP  \r\n\x87\n"sv;
constexpr std::string_view kGeoTiffUuid = "\xB1\x4B\xF8\xBD\x08\x3D\x4B\x43\xA5\xAE\x8C\xD7\xD5\xA6\xCE\x03"sv;
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20U;
/// Boxes of a file; what has more of them is damaged.
constexpr int kMostBoxes = 10000;

/// One directory of a TIFF in memory.
class TinyTiff {
 public:
  explicit TinyTiff(std::span<const std::byte> bytes) : bytes_(bytes), swaps_(text_of(bytes).starts_with("MM")) {}

  [[nodiscard]] GeoTags tags() const {
    GeoTags tags;
    const std::uint64_t directory = number<std::uint32_t>(4);
    const std::uint64_t entries = number<std::uint16_t>(directory);
    for (std::uint64_t i = 0; i < entries; ++i) {
      const std::uint64_t at = directory + 2 + 12 * i;
      switch (number<std::uint16_t>(at)) {
        case 33550:
          tags.pixel_scale = list<double>(at, 12);
          break;
        case 33922:
          tags.tiepoints = list<double>(at, 12);
          break;
        case 34264:
          tags.transformation = list<double>(at, 12);
          break;
        case 34735:
          tags.directory = list<std::uint16_t>(at, 3);
          break;
        case 34736:
          tags.doubles = list<double>(at, 12);
          break;
        case 34737: {
          const std::vector<char> text = list<char>(at, 2);
          tags.ascii.assign(text.begin(), text.end());
          break;
        }
        default:
          break;
      }
    }
    return tags;
  }

 private:
  /// 0 beyond the end.
  template <typename T>
  [[nodiscard]] T number(std::uint64_t at) const {
    std::array<std::byte, sizeof(T)> raw{};
    if (at > bytes_.size() || sizeof(T) > bytes_.size() - at) return T{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at), sizeof(T), raw.begin());
    if (swaps_) std::ranges::reverse(raw);
    return load_little<T>(raw.data());
  }
  /// The values of the entry at a place, of one type.
  template <typename T>
  [[nodiscard]] std::vector<T> list(std::uint64_t entry, int type) const {
    const std::uint64_t count = number<std::uint32_t>(entry + 4);
    if (number<std::uint16_t>(entry + 2) != type || count > bytes_.size() / sizeof(T)) return {};
    const std::uint64_t at = count * sizeof(T) <= 4 ? entry + 8 : number<std::uint32_t>(entry + 8);
    std::vector<T> values;
    for (std::uint64_t i = 0; i < count; ++i) values.push_back(number<T>(at + i * sizeof(T)));
    return values;
  }

  std::span<const std::byte> bytes_;
  bool swaps_;
};

std::uint64_t big_endian(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (const std::byte byte : bytes) value = value << 8U | std::to_integer<std::uint64_t>(byte);
  return value;
}

}  // namespace

GeoTags geojp2_tags(const std::string& path) {
  try {
    const RawFile file(path);
    std::array<std::byte, 32> head{};
    if (file.read_some(0, head) < head.size() || !text_of(head).starts_with(kSignature)) return {};
    std::uint64_t at = 0;
    for (int box = 0; box < kMostBoxes && at < file.size_bytes(); ++box) {
      const std::size_t there = file.read_some(at, head);
      if (there < head.size()) return {};
      const std::uint64_t length = big_endian(std::span(head).first(4));
      const std::uint64_t begin = length == 1 ? 16 : 8;  // a length of 64 bits stands behind the name
      const std::uint64_t bytes = length == 1   ? big_endian(std::span(head).subspan(8, 8))
                                  : length == 0 ? file.size_bytes() - at
                                                : length;
      if (bytes < begin || bytes > file.size_bytes() - at) return {};
      const std::string_view box_head = text_of(head);
      const std::uint64_t contents = begin + kGeoTiffUuid.size();
      if (box_head.substr(4, 4) == "uuid" && box_head.substr(begin, kGeoTiffUuid.size()) == kGeoTiffUuid &&
          bytes >= contents && bytes - contents <= kMostBytes) {
        std::vector<std::byte> tiff(static_cast<std::size_t>(bytes - contents));
        file.read(at + contents, tiff);
        return TinyTiff(tiff).tags();
      }
      at += bytes;
    }
  } catch (const Error&) {  // who decodes the picture says what is wrong with it
  }
  return {};
}

}  // namespace isohf
