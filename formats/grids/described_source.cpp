#include "formats/grids/described_source.h"

#include <fmt/core.h>

#include <cmath>

#include "formats/georeference/files_beside.h"
#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kMostSamplesASide = 2147483647.0;
constexpr std::uint64_t kLongestDescription = std::uint64_t{1} << 20U;

}  // namespace

std::string read_header_text(const std::string& path) {
  const RawFile file(path);
  if (file.size_bytes() > kLongestDescription) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: is longer than {} bytes, which no header is", path, kLongestDescription));
  }
  std::string text(static_cast<std::size_t>(file.size_bytes()), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

HeaderWords read_header_words(const std::string& path) {
  const std::string text = read_header_text(path);
  HeaderWords words;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t equals = text.find('=', at);
    if (equals < end) {
      const std::size_t open = text.find_first_not_of(" \t", equals + 1);
      if (open < text.size() && text[open] == '{') end = std::min(text.find('}', open), text.size());
      words.emplace(
          lower_case(trimmed(text.substr(at, equals - at))),
          trimmed(text.substr(equals + 1, end - equals - 1 + (end < text.size() && text[end] == '}' ? 1 : 0))));
    }
    at = end + 1;
  }
  return words;
}

std::vector<std::string> list_of(std::string_view text) {
  if (!text.empty() && text.front() == '{') text.remove_prefix(1);
  if (!text.empty() && text.back() == '}') text.remove_suffix(1);
  std::vector<std::string> list;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    list.push_back(trimmed(text.substr(at, comma - at)));
    at = comma + 1;
  }
  return list;
}

void DescribedSource::refuse(ErrorCode code, const std::string& what) const {
  throw Error(code, header_ + ": " + what);
}

double DescribedSource::number(const std::string& text, const std::string& what) const {
  double value = 0.0;
  if (!read_decimal(text, value))
    refuse(ErrorCode::kCorrupt, fmt::format("{} is \"{}\", must be a number", what, printable(text)));
  return value;
}

double DescribedSource::number(const HeaderWords& words, const char* key, std::optional<double> otherwise) const {
  const auto found = words.find(key);
  if (found != words.end()) return number(found->second, key);
  if (!otherwise) refuse(ErrorCode::kCorrupt, fmt::format("has no \"{}\"", key));
  return *otherwise;
}

std::int64_t DescribedSource::count(double value, const std::string& what, double least) const {
  if (!(value >= least && value <= kMostSamplesASide * 65536.0) || value != std::floor(value)) {
    refuse(ErrorCode::kCorrupt, fmt::format("{} is {}, must be a whole number from {} on", what, value, least));
  }
  return static_cast<std::int64_t>(value);
}

void DescribedSource::set_size(double width, double height) {
  if (!(std::max(width, height) <= kMostSamplesASide))
    refuse(ErrorCode::kCorrupt, "gives more than 2147483647 samples a side");
  info_.width = count(width, "the number of columns");
  info_.height = count(height, "the number of rows");
}

void DescribedSource::set_void(double value) {
  if (const auto stored = void_value_as_stored(info_.sample_type, value)) info_.void_values.push_back(*stored);
}

void DescribedSource::set_scale(double scale, double offset, const char* key) {
  if (scale == 0.0 || !std::isfinite(scale) || !std::isfinite(offset)) {
    refuse(ErrorCode::kCorrupt, fmt::format("{} gives a scale of {} and an offset of {}", key, scale, offset));
  }
  info_.z_scale = scale;
  info_.z_offset = offset;
}

void DescribedSource::place_by_corner(double west, double north, double dx, double dy) {
  if (!(dx > 0.0 && dy > 0.0)) refuse(ErrorCode::kCorrupt, "gives no positive spacing");
  Georeference& place = info_.georeference;
  place.registration = Registration::kArea;
  place.spacing_x = dx;
  place.spacing_y = dy;
  place.has_origin = true;
  place.origin_x = west + dx / 2.0;
  place.origin_y = north - dy / 2.0;
}

void DescribedSource::require_samples() const {
  const double end = layout_.end_bytes(info_);
  if (!(end <= static_cast<double>(file_->size_bytes()))) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the file has {} bytes, {} x {} samples as {} says end at {:.0f}", info_.path,
                            file_->size_bytes(), info_.width, info_.height, header_, end));
  }
}

void DescribedSource::finish(const OpenOptions& options, int band) {
  require_samples();
  read_files_beside(info_, band);
  bound_undeclared_voids(info_);
  info_.block_width = info_.width;
  // The samples of a column follow each other: some rows at once cost what one does.
  constexpr std::int64_t kRowsAtOnce = 64;
  const bool by_columns = layout_.column_bytes > size_bytes(info_.sample_type) && layout_.row_bytes != 0 &&
                          layout_.row_bytes < layout_.column_bytes;
  info_.block_height = by_columns ? std::min(info_.height, kRowsAtOnce) : 1;
  apply_open_options(info_, options);
}

}  // namespace isohf
