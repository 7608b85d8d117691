#include "formats/readers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr std::size_t kLongestList = 200;  // of names in a message
constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 20U;
constexpr std::int64_t kNpyRowsAtOnce = 256;
constexpr std::int64_t kMostNpySide = std::int64_t{1} << 31;

struct Header {
  std::string descr;
  bool fortran_order = false;
  std::vector<std::int64_t> shape;
};

/// The header's Python dictionary: three keys, each once.
class HeaderParser {
 public:
  HeaderParser(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  Header parse() {
    Header header;
    unsigned seen = 0;
    take('{');
    while (peek() != '}') {
      const std::string key = quoted();
      take(':');
      if (key == "descr") {
        if (peek() == '[')
          throw Error(ErrorCode::kUnsupported, path_ + ": the array's elements are records, must be numbers");
        header.descr = quoted();
        seen |= 1U;
      } else if (key == "fortran_order") {
        header.fortran_order = truth();
        seen |= 2U;
      } else if (key == "shape") {
        header.shape = numbers();
        seen |= 4U;
      } else {
        fail(fmt::format("has an unknown key {}", key));
      }
      if (peek() != '}') take(',');
    }
    if (seen != 7U) fail("must say descr, fortran_order and shape");
    return header;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: the array's header {}", path_, what));
  }

  char peek() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    if (at_ >= text_.size()) fail("ends early");
    return text_[at_];
  }

  void take(char wanted) {
    if (peek() != wanted) fail(fmt::format("has no {} at its character {}", wanted, at_));
    ++at_;
  }

  std::string quoted() {
    const char quote = peek();
    if (quote != '\'' && quote != '"') fail(fmt::format("has no text at its character {}", at_));
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos) fail("has a text without an end");
    std::string result(text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    if (!std::all_of(result.begin(), result.end(), [](char c) { return c >= ' ' && c < 127; })) {
      fail("has a text that is not ASCII");
    }
    return result;
  }

  bool truth() {
    peek();
    for (const std::string_view word : {std::string_view("True"), std::string_view("False")}) {
      if (text_.substr(at_, word.size()) != word) continue;
      at_ += word.size();
      return word == "True";
    }
    fail("says neither True nor False of fortran_order");
  }

  std::vector<std::int64_t> numbers() {
    std::vector<std::int64_t> result;
    take('(');
    while (peek() != ')') {
      std::int64_t number = 0;
      const char* const end = text_.data() + text_.size();
      const auto [at, error] = std::from_chars(text_.data() + at_, end, number);
      if (error != std::errc{} || number < 0) fail(fmt::format("has no length at its character {}", at_));
      at_ = static_cast<std::size_t>(at - text_.data());
      result.push_back(number);
      if (peek() != ')') take(',');
    }
    ++at_;
    return result;
  }

  std::string path_;
  std::string_view text_;
  std::size_t at_ = 0;
};

std::optional<SampleType> sample_type(std::string_view kind) {
  constexpr std::array<std::pair<std::string_view, SampleType>, 11> kTypes = {{{"u1", SampleType::kUint8},
                                                                               {"i1", SampleType::kInt8},
                                                                               {"u2", SampleType::kUint16},
                                                                               {"i2", SampleType::kInt16},
                                                                               {"u4", SampleType::kUint32},
                                                                               {"i4", SampleType::kInt32},
                                                                               {"u8", SampleType::kFloat64},
                                                                               {"i8", SampleType::kFloat64},
                                                                               {"f2", SampleType::kFloat16},
                                                                               {"f4", SampleType::kFloat32},
                                                                               {"f8", SampleType::kFloat64}}};
  const auto* const found = std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& t) { return t.first == kind; });
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

class NpySource final : public PlainSource {
 public:
  NpySource(const std::string& path, const OpenOptions& options) : PlainSource(path, "NumPy", options) {
    read_header();
    (void)choose_band(info_, options, 1);
    read_place_beside(info_, 1);
    apply_open_options(info_, options);
  }
  /// One array of an .npz.
  NpySource(const std::string& path, const ZipEntry& member, const OpenOptions& options) : PlainSource(path, "NumPy") {
    file_.emplace(path, member, options.unpacked_bytes);
    read_header();
  }

  [[nodiscard]] SourceInfo& mutable_info() { return info_; }

 private:
  void read_header() {
    std::array<unsigned char, 12> start = {};
    file_->read(0, std::as_writable_bytes(std::span(start).first(10)));
    const unsigned version = start[6];
    if (version < 1 || version > 3) {
      throw Error(ErrorCode::kUnsupported, fmt::format("{}: NumPy format {}, must be 1 to 3", info_.path, version));
    }
    if (version > 1) file_->read(10, std::as_writable_bytes(std::span(start).subspan(10)));
    std::size_t length = start[8] | static_cast<std::size_t>(start[9]) << 8U;
    if (version > 1) length |= static_cast<std::size_t>(start[10]) << 16U | static_cast<std::size_t>(start[11]) << 24U;
    if (length > kMostHeaderBytes) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: the array's header has {} bytes, must be at most {}",
                                                   info_.path, length, kMostHeaderBytes));
    }
    const std::size_t text_at = version > 1 ? 12 : 10;
    std::string text(length, '\0');
    file_->read(text_at, std::as_writable_bytes(std::span(text)));
    layout_.offset_bytes = text_at + length;
    describe(HeaderParser(info_.path, text).parse());
  }

  void describe(const Header& header) {
    const auto unsupported = [&](const std::string& what) {
      throw Error(ErrorCode::kUnsupported, fmt::format("{}: {}", info_.path, what));
    };
    const char order = header.descr.empty() ? '?' : header.descr.front();
    const std::optional<SampleType> type = sample_type(std::string_view(header.descr).substr(order == '?' ? 0 : 1));
    if (!type || std::string_view("<>=|").find(order) == std::string_view::npos ||
        (order == '|' && size_bytes(*type) > 1)) {
      unsupported(fmt::format("the array's type is '{}'; integers of 8 to 64 bits and floats of 16 to 64 are read",
                              header.descr));
    }
    std::vector<std::int64_t> shape = header.shape;
    while (shape.size() > 2 && std::find(shape.begin(), shape.end(), 1) != shape.end()) {
      shape.erase(std::find(shape.begin(), shape.end(), 1));  // (1, rows, columns) is a raster as well
    }
    if (shape.size() != 2) {
      unsupported(fmt::format("the array's shape is ({}), must have 2 dimensions", fmt::join(header.shape, ", ")));
    }
    const bool by_columns = header.fortran_order && shape[0] > 1 && shape[1] > 1;
    if (header.descr.ends_with("i8")) layout_.stored_as = StoredAs::kInt64;
    if (header.descr.ends_with("u8")) layout_.stored_as = StoredAs::kUint64;
    info_.height = shape[0];
    info_.width = shape[1];
    if (info_.width < 1 || info_.height < 1 || info_.width > kMostNpySide || info_.height > kMostNpySide) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: the array's shape is ({}), must be from 1 to {}", info_.path,
                                                   fmt::join(header.shape, ", "), kMostNpySide));
    }
    info_.sample_type = type.value_or(SampleType::kFloat32);
    info_.block_width = info_.width;
    info_.block_height = by_columns ? std::min(info_.height, kNpyRowsAtOnce) : 1;
    layout_.big_endian = order == '>';
    if (by_columns) {
      layout_.row_bytes = size_bytes(info_.sample_type);
      layout_.column_bytes = static_cast<std::uint64_t>(info_.height) * layout_.row_bytes;
    }
    const double wanted = layout_.end_bytes(info_);
    const auto there = static_cast<double>(file_->size_bytes());
    if (there < wanted) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: ends early: {} bytes, an array of {} x {} {} needs {:.0f}", info_.path,
                              file_->size_bytes(), info_.width, info_.height, to_string(info_.sample_type), wanted));
    }
    if (there > wanted) info_.warnings.push_back(loss(fmt::format("{:.0f} bytes follow the array", there - wanted)));
  }
};

/// "elevation.npy" is the array elevation.
std::string array_name(const ZipEntry& member) {
  return member.name.ends_with(".npy") ? member.name.substr(0, member.name.size() - 4) : member.name;
}

/// An array that is a raster; nullptr where its shape or type make it none and nobody asked for it by name.
std::unique_ptr<NpySource> open_array(const std::string& path, const ZipEntry& member, bool wanted,
                                      const OpenOptions& options) {
  try {
    return std::make_unique<NpySource>(path, member, options);
  } catch (const Error& error) {
    if (!wanted && error.code() == ErrorCode::kUnsupported) return nullptr;
    throw Error(error.code(), fmt::format("{} (array {})", error.what(), array_name(member)));
  }
}

}  // namespace

bool looks_like_npy(std::span<const std::byte> head) {
  return text_of(head).starts_with(kNpyMagic);
}

std::unique_ptr<HeightSource> open_npy(const std::string& path, const OpenOptions& options) {
  return std::make_unique<NpySource>(path, options);
}

std::unique_ptr<HeightSource> open_npz(const std::string& path, const OpenOptions& options) {
  const std::vector<ZipEntry> members = zipped_files(RawFile(path));
  std::unique_ptr<NpySource> chosen;
  std::string name;
  std::string names;
  std::size_t rasters = 0;
  for (const ZipEntry& member : members) {
    const std::string array = array_name(member);
    const bool wanted = options.channel == array;
    if (wanted || options.channel.empty()) {
      std::unique_ptr<NpySource> source = open_array(path, member, wanted, options);
      rasters += source ? 1 : 0;
      if (source && !chosen) {
        chosen = std::move(source);
        name = array;
      }
    }
    if (names.size() < kLongestList) names += (names.empty() ? "" : ", ") + printable(array);
  }
  if (!chosen && !options.channel.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: there is no array \"{}\"; there are {}", path, options.channel, names));
  }
  if (!chosen) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("{}: no array of the archive ({}) has two dimensions and a type that is read", path, names));
  }
  if (rasters > 1) {
    chosen->mutable_info().warnings.push_back(
        fmt::format("array {} is read, of {}; `channel` NAME takes another", name, names));
  }
  chosen->mutable_info().channel = members.size() > 1 ? name : std::string();
  apply_open_options(chosen->mutable_info(), options);
  return chosen;
}

}  // namespace isohf
