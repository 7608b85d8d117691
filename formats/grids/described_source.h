#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/grids/plain_samples.h"
#include "isohf/raster.h"

namespace isohf {

/// The lines of a header, "key = value", by their keys in lower case.
using HeaderWords = std::map<std::string, std::string, std::less<>>;

/// Reads a header; a value in braces goes on over lines, and of a key that comes twice the first counts. Throws
/// Error{kCorrupt} for more than 1 MiB.
[[nodiscard]] HeaderWords read_header_words(const std::string& path);

/// The whole of a small file that describes another: at most 1 MiB, else Error{kCorrupt}.
[[nodiscard]] std::string read_header_text(const std::string& path);

/// The items of a list, "{a, b}" or "a, b", without the blanks around them.
[[nodiscard]] std::vector<std::string> list_of(std::string_view text);

/// Throws Error{kUnsupported} where the label that lies beside `path` describes other samples: those of `data`.
void require_described(const std::string& path, const std::string& label, const std::string& data);

/// Plain samples that something else describes: ENVI's header, PDS4's label and so on. Whoever derives from this
/// reads the description into info_ and layout_ and calls finish().
class DescribedSource : public PlainSource {
 protected:
  /// data, header  their paths, which may be the same
  DescribedSource(const std::string& data, const char* format, std::string header)
      : PlainSource(data, format), header_(std::move(header)) {}

  /// Throws Error naming the header.
  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const;
  /// What a text says; Error{kCorrupt} where it is no finite number.
  [[nodiscard]] double number(const std::string& text, const std::string& what) const;
  /// What a word says; `otherwise` where it is not there, which is an error without one.
  [[nodiscard]] double number(const HeaderWords& words, const char* key, std::optional<double> otherwise = {}) const;
  /// A whole number from `least` on.
  [[nodiscard]] std::int64_t count(double value, const std::string& what, double least = 1.0) const;
  void set_size(double width, double height);
  /// What a label gives as a value of a sample: a number, or the bits of one ("16#FF7FFFFB#", "0xFF7FFFFB"), once type and
  /// layout are known; nullopt for other texts ("N/A").
  [[nodiscard]] std::optional<double> constant(const std::string& text) const;
  /// Leaves aside what no sample can hold.
  void set_void(double value);
  /// The unit of elevations.
  void set_unit(const std::string& unit);
  /// Throws Error{kCorrupt} where `scale`, which `key` gives, is 0 or one of the two is not finite.
  void set_scale(double scale, double offset, const char* key);
  /// The place of the first sample's outer corner in the North-West, and the spacing. Cells are areas.
  void place_by_corner(double west, double north, double dx, double dy);
  /// Leaves the place out, with a warning that says why.
  void lose_place(const char* why);
  /// Throws Error{kCorrupt} where the file has fewer bytes than the description says.
  void require_samples() const;
  /// Requires the samples, and takes what lies beside it, of `band` as read_sidecars has it, and what the user
  /// says.
  void finish(const OpenOptions& options, int band = 1);

  std::string header_;  ///< for messages
};

}  // namespace isohf
