#pragma once

#include <array>
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

/// Plain samples that something else describes: ENVI's header, PDS4's label and so on. Whoever derives from this
/// reads the description into info_ and layout_ and calls finish().
class DescribedSource : public PlainSource {
 protected:
  /// data, header  their paths, which may be the same
  DescribedSource(const std::string& data, const char* format, std::string header, const OpenOptions& options)
      : PlainSource(data, format, options), header_(std::move(header)) {}

  /// Throws Error naming the header.
  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const;
  /// What a text says; Error{kCorrupt} where it is no finite number.
  [[nodiscard]] double number(const std::string& text, const std::string& what) const;
  /// What a word says; `otherwise` where it is not there, which is an error without one.
  [[nodiscard]] double number(const HeaderWords& words, const char* key, std::optional<double> otherwise = {}) const;
  /// A whole number from `least` on.
  [[nodiscard]] std::int64_t count(double value, const std::string& what, double least = 1.0) const;
  void set_size(double width, double height);
  void set_void(double value);
  /// Throws Error{kCorrupt} where `scale`, which `key` gives, is 0 or one of the two is not finite.
  void set_scale(double scale, double offset, const char* key);
  /// The place of the first sample's outer corner in the North-West, and the spacing. Cells are areas.
  void place_by_corner(double west, double north, double dx, double dy);
  /// Throws Error{kCorrupt} where the file has fewer bytes than the description says.
  void require_samples() const;
  /// Requires the samples, and takes what lies beside it, of `band` as read_auxiliary_metadata has it, and what the user
  /// says.
  void finish(const OpenOptions& options, int band = 1);

  std::string header_;  ///< for messages
};

}  // namespace isohf
