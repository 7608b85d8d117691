#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <optional>
#include <vector>

#include "formats/oiio/oiio_module_inside.h"

namespace isohf {
namespace {

/// A header or a string of boxes ends within it, or the file is none that isohf judges.
constexpr std::size_t kHeaderBytes = std::size_t{1} << 20U;

std::vector<unsigned char> head_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<unsigned char> head(kHeaderBytes);
  in.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

/// The largest value of a portable any-map (P1 to P6), which stands behind width and height; 0 where there is none.
long largest_value(const std::vector<unsigned char>& head) {
  std::array<long, 3> numbers{};
  std::size_t at = 2;
  for (long& number : numbers) {
    while (at < head.size() && (std::isspace(head[at]) != 0 || head[at] == '#')) {
      if (head[at] == '#') {
        while (at < head.size() && head[at] != '\n') ++at;
      } else {
        ++at;
      }
    }
    for (; at < head.size() && std::isdigit(head[at]) != 0 && number < 1000000; ++at) {
      number = 10 * number + (head[at] - '0');
    }
  }
  return numbers[2];
}

/// Whether the first component of a JPEG 2000 codestream is signed: ISO 15444-1, A.5.1, the marker SIZ behind SOC. The
/// codestream stands in the box jp2c (I.5.4) or alone; nullopt where it was not found.
std::optional<bool> first_component_is_signed(const std::vector<unsigned char>& head) {
  constexpr std::array<unsigned char, 4> kStart = {0xFF, 0x4F, 0xFF, 0x51};  // SOC, SIZ
  constexpr std::ptrdiff_t kPrecision = 42;                                  // Ssiz of the first component, from SOC
  const auto start = std::search(head.begin(), head.end(), kStart.begin(), kStart.end());
  if (head.end() - start <= kPrecision) return std::nullopt;
  return (start[kPrecision] & 0x80U) != 0;
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::kUnsupported, what + "; store the raster as TIFF or PNG (gdal_translate does)");
}

}  // namespace

bool states_a_place(const std::string& format, const std::string& path) {
  if (format != "jpeg2000") return false;
  constexpr std::array<unsigned char, 16> kGeoJp2 = {0xB1, 0x4B, 0xF8, 0xBD, 0x08, 0x3D, 0x4B, 0x43,
                                                     0xA5, 0xAE, 0x8C, 0xD7, 0xD5, 0xA6, 0xCE, 0x03};
  const std::vector<unsigned char> head = head_of(path);
  return std::search(head.begin(), head.end(), kGeoJp2.begin(), kGeoJp2.end()) != head.end();
}

void require_stored_numbers(const std::string& format, int bits, int stored_bits, bool is_floating,
                            const std::string& path) {
  if (format == "fits") refuse("OpenImageIO displaces the rows of FITS images");
  if (format != "pnm" && stored_bits != bits) {
    refuse("the samples have " + std::to_string(stored_bits) + " bits, and OpenImageIO spreads them over " +
           std::to_string(bits));
  }
  if (format == "jpeg2000") {
    const std::optional<bool> is_signed = first_component_is_signed(head_of(path));
    if (!is_signed) refuse("there is no codestream in its first MiB, so that nothing says whether samples are signed");
    if (*is_signed) refuse("the samples are signed, which OpenImageIO reads as if they were not");
  }
  if (format == "pnm" && !is_floating) {
    const long largest = largest_value(head_of(path));
    const long range = bits == 8 ? 255 : 65535;
    if (largest != range) {
      refuse("the largest value is stated as " + std::to_string(largest) +
             ", and OpenImageIO spreads the samples over 0 to " + std::to_string(range));
    }
  }
}

}  // namespace isohf
