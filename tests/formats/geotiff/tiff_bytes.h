#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace isohf::test {

/// Builds TIFF files byte by byte, also ones that no library would write. The directory comes first, then the arrays,
/// then the blocks, so that every truncation cuts something else.
class TiffBytes {
 public:
  enum Type : std::uint16_t { kAscii = 2, kShort = 3, kLong = 4, kDouble = 12, kLong8 = 16 };

  explicit TiffBytes(bool big_endian = false, bool big_tiff = false) : big_endian_(big_endian), big_tiff_(big_tiff) {}

  TiffBytes& integers(std::uint16_t tag, Type type, const std::vector<std::uint64_t>& values) {
    Entry entry{tag, type, values.size(), {}};
    for (const std::uint64_t value : values) append(entry.bytes, value, type == kShort ? 2 : type == kLong ? 4 : 8);
    return set(std::move(entry));
  }
  TiffBytes& shorts(std::uint16_t tag, const std::vector<std::uint64_t>& values) {
    return integers(tag, kShort, values);
  }
  TiffBytes& longs(std::uint16_t tag, const std::vector<std::uint64_t>& values) { return integers(tag, kLong, values); }
  TiffBytes& doubles(std::uint16_t tag, const std::vector<double>& values) {
    Entry entry{tag, kDouble, values.size(), {}};
    for (const double value : values) append(entry.bytes, std::bit_cast<std::uint64_t>(value), 8);
    return set(std::move(entry));
  }
  TiffBytes& ascii(std::uint16_t tag, const std::string& text) {
    return set({tag, kAscii, text.size() + 1, std::string(text.c_str(), text.size() + 1)});
  }

  /// An image of `bits` wide samples in strips; the blocks are added by block().
  TiffBytes& image(std::uint64_t width, std::uint64_t height, int bits, int format, std::uint64_t rows_per_strip,
                   int compression = 1) {
    longs(256, {width}).longs(257, {height}).shorts(258, {static_cast<std::uint64_t>(bits)});
    shorts(259, {static_cast<std::uint64_t>(compression)}).shorts(262, {1}).shorts(277, {1});
    return longs(278, {rows_per_strip}).shorts(284, {1}).shorts(339, {static_cast<std::uint64_t>(format)});
  }
  /// A strip's or tile's bytes; empty: not stored.
  TiffBytes& block(std::string bytes) {
    blocks_.push_back(std::move(bytes));
    return *this;
  }
  TiffBytes& tiles(std::uint64_t columns, std::uint64_t rows) {
    tiled_ = true;
    entries_.erase(std::remove_if(entries_.begin(), entries_.end(), [](const Entry& e) { return e.tag == 278; }),
                   entries_.end());
    return longs(322, {columns}).longs(323, {rows});
  }

  /// The directory that follows this one, of the same byte order and kind.
  TiffBytes& next(const TiffBytes& following) {
    next_ = {following};
    return *this;
  }

  /// `bytes` of host-order samples in the file's order.
  [[nodiscard]] std::string ordered(std::string bytes, std::size_t sample_bytes) const {
    if (big_endian_) {
      for (std::size_t i = 0; i + sample_bytes <= bytes.size(); i += sample_bytes) {
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                     bytes.begin() + static_cast<std::ptrdiff_t>(i + sample_bytes));
      }
    }
    return bytes;
  }

  [[nodiscard]] std::string build() const {
    std::string out = big_endian_ ? "MM" : "II";
    append(out, big_tiff_ ? 43 : 42, 2);
    if (big_tiff_) append(out, 8, 2), append(out, 0, 2);
    append(out, big_tiff_ ? 16 : 8, big_tiff_ ? 8 : 4);
    append_directory(out);
    return out;
  }

  [[nodiscard]] std::string write(const std::string& path) const {
    write_file(path, build());
    return path;
  }

 private:
  struct Entry {
    std::uint16_t tag;
    std::uint16_t type;
    std::uint64_t count;
    std::string bytes;
  };

  TiffBytes& set(Entry entry) {
    std::erase_if(entries_, [&](const Entry& e) { return e.tag == entry.tag; });
    entries_.push_back(std::move(entry));
    return *this;
  }

  void append(std::string& out, std::uint64_t value, int bytes) const {
    for (int i = 0; i < bytes; ++i) {
      out.push_back(static_cast<char>((value >> (8 * (big_endian_ ? bytes - 1 - i : i))) & 0xFFU));
    }
  }

  void append_directory(std::string& out) const {
    // Laid out twice: offsets need sizes only, which the first round settles.
    std::vector<std::uint64_t> offsets(blocks_.size(), 0);
    std::uint64_t end = out.size() + lay_out(out.size(), offsets, 0).size();
    end += end % 2;
    out += lay_out(out.size(), offsets, next_.empty() ? 0 : end);
    if (next_.empty()) return;
    out.resize(end, '\0');
    next_.front().append_directory(out);
  }

  /// The directory at `start` in the file, its arrays and its blocks, whose offsets are told.
  std::string lay_out(std::uint64_t start, std::vector<std::uint64_t>& offsets, std::uint64_t next_directory) const {
    TiffBytes all = *this;
    const auto has = [&](std::uint16_t tag) {
      return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.tag == tag; });
    };
    std::vector<std::uint64_t> sizes;
    for (const std::string& block : blocks_) sizes.push_back(block.size());
    const Type table = big_tiff_ ? kLong8 : kLong;
    if (!blocks_.empty() && !has(tiled_ ? 324 : 273)) all.integers(tiled_ ? 324 : 273, table, offsets);
    if (!blocks_.empty() && !has(tiled_ ? 325 : 279)) all.integers(tiled_ ? 325 : 279, table, sizes);
    std::sort(all.entries_.begin(), all.entries_.end(), [](const Entry& a, const Entry& b) { return a.tag < b.tag; });

    const int offset_bytes = big_tiff_ ? 8 : 4;
    const std::uint64_t directory =
        (big_tiff_ ? 8 : 2) + all.entries_.size() * (big_tiff_ ? 20 : 12) + static_cast<std::uint64_t>(offset_bytes);
    std::string out;
    append(out, all.entries_.size(), big_tiff_ ? 8 : 2);
    std::string arrays;
    for (const Entry& entry : all.entries_) {
      append(out, entry.tag, 2);
      append(out, entry.type, 2);
      append(out, entry.count, offset_bytes);
      if (entry.bytes.size() <= static_cast<std::size_t>(offset_bytes)) {
        out += entry.bytes + std::string(static_cast<std::size_t>(offset_bytes) - entry.bytes.size(), '\0');
      } else {
        append(out, start + directory + arrays.size(), offset_bytes);
        arrays += entry.bytes;
        if (arrays.size() % 2 != 0) arrays.push_back('\0');
      }
    }
    append(out, next_directory, offset_bytes);
    out += arrays;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      offsets[i] = blocks_[i].empty() ? 0 : start + out.size();
      out += blocks_[i];
    }
    return out;
  }

  bool big_endian_;
  bool big_tiff_;
  bool tiled_ = false;
  std::vector<Entry> entries_;
  std::vector<std::string> blocks_;
  std::vector<TiffBytes> next_;  ///< one or none
};

}  // namespace isohf::test
