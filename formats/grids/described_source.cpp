#include "formats/grids/described_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "formats/georeference/sidecars.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"

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

void require_described(const std::string& path, const std::string& label, const std::string& data) {
  std::error_code ignored;
  if (std::filesystem::equivalent(path, data, ignored)) return;
  throw Error(ErrorCode::kUnsupported, fmt::format("{}: its label {} describes {} instead", path, label, data));
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

std::optional<double> DescribedSource::constant(const std::string& text) const {
  double value = 0.0;
  char* digits = nullptr;
  const bool is_hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  const auto base = is_hexadecimal ? 16 : static_cast<int>(std::strtoul(text.c_str(), &digits, 10));
  if (!is_hexadecimal && (*digits != '#' || base < 2 || base > 16)) {
    return read_decimal(text, value) && std::isfinite(value) ? std::optional(value) : std::nullopt;
  }
  const std::uint64_t bits = std::strtoull(is_hexadecimal ? text.c_str() : digits + 1, nullptr, base);
  const auto low = static_cast<std::uint32_t>(bits);
  switch (info_.sample_type) {
    case SampleType::kFloat32:
      return layout_.stored_as == StoredAs::kVaxFloat ? float_from_vax(low) : std::bit_cast<float>(low);
    case SampleType::kFloat64:
      return layout_.stored_as == StoredAs::kItself ? std::bit_cast<double>(bits) : static_cast<double>(bits);
    case SampleType::kInt8:
      return static_cast<std::int8_t>(bits);
    case SampleType::kInt16:
      return static_cast<std::int16_t>(bits);
    case SampleType::kInt32:
      return static_cast<std::int32_t>(bits);
    default:
      return static_cast<double>(bits);
  }
}

void DescribedSource::set_void(double value) {
  const auto stored = void_value_as_stored(info_.sample_type, value);
  if (stored && std::ranges::find(info_.void_values, *stored) == info_.void_values.end())
    info_.void_values.push_back(*stored);
}

void DescribedSource::set_unit(const std::string& unit) {
  const std::optional<LinearUnit> length = linear_unit(unit);
  info_.vertical_unit = length ? length->name : printable(lower_case(unit));
  info_.metres_per_vertical_unit = length ? length->metres : 1.0;
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

void DescribedSource::lose_place(const char* why) {
  info_.georeference.unit = HorizontalUnit::kUnknown;
  info_.warnings.push_back(loss(std::string(why) + "; its place is left out"));
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
  read_sidecars(info_, band);
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
