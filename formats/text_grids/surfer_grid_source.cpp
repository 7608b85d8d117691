#include "formats/readers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/binary_grids/plain_samples.h"
#include "formats/files/bands.h"
#include "formats/files/text.h"
#include "formats/files/text_tokens.h"
#include "formats/georeference/files_beside.h"
#include "formats/open_options.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kMagicBytes = 4;
constexpr std::string_view kText = "DSAA";
constexpr std::string_view kSurfer6 = "DSBB";
constexpr std::string_view kSurfer7 = "DSRB";
constexpr std::string_view kGridSection = "GRID";
constexpr std::string_view kDataSection = "DATA";
/// Blanked nodes have this value or a greater one: just below 1.70141e38, which texts write in fewer digits.
constexpr double kBlank = 1.7014e38;
constexpr std::size_t kSurfer6HeaderBytes = 56;
constexpr std::size_t kGridSectionBytes = 72;
/// More lie before no grid's data.
constexpr int kMostSections = 64;
constexpr double kMostSide = 2147483647.0;

class SurferGridSource final : public PlainSource {
 public:
  SurferGridSource(const std::string& path, const OpenOptions& options) : PlainSource(path, "", options) {
    (void)choose_band(info_, options, 1);
    std::array<char, kMagicBytes> magic{};
    file_->read(0, std::as_writable_bytes(std::span(magic)));
    const std::string_view kind(magic.data(), magic.size());
    info_.valid_max = kBlank;
    if (kind == kText) {
      read_text_header();
    } else if (kind == kSurfer6) {
      read_surfer6();
    } else if (kind == kSurfer7) {
      read_surfer7();
    } else {
      corrupt("does not begin as a Surfer grid does (DSAA, DSBB or DSRB)");
    }
    // What programs write, so that rasters made of it can say so.
    if (info_.void_values.empty()) {
      info_.void_values = {info_.sample_type == SampleType::kFloat32 ? double{1.70141e38F} : 1.70141e38};
    }
    read_files_beside(info_, 1);
    info_.block_width = info_.width;
    info_.block_height = 1;
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = turned(window, info_.height);
    ISOHF_ASSERT(is_window_of(info_, stored, samples.size()));
    if (!words_) {
      PlainSource::read_window(stored, samples);
    } else if (!rows_->read<double>(stored, samples, read_decimal)) {
      corrupt("the file has changed since it was opened");
    }
    turn_rows(samples, static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type));
  }

 private:
  [[noreturn]] void corrupt(const std::string& what) const { fail(ErrorCode::kCorrupt, what); }

  void set_size(double columns, double rows) {
    const auto fits = [](double n) { return n >= 2.0 && n <= kMostSide && n == std::floor(n); };
    if (!fits(columns) || !fits(rows)) {
      corrupt(fmt::format("the header says {} x {} nodes, must be whole numbers from 2 to {:.0f}", columns, rows,
                          kMostSide));
    }
    info_.width = static_cast<std::int64_t>(columns);
    info_.height = static_cast<std::int64_t>(rows);
  }

  /// By the south-western node and the distances between nodes.
  void set_place(double west, double south, double spacing_x, double spacing_y) {
    Georeference& place = info_.georeference;
    place.registration = Registration::kPoint;
    place.has_origin = true;
    place.spacing_x = spacing_x;
    place.spacing_y = spacing_y;
    place.origin_x = west;
    place.origin_y = south + static_cast<double>(info_.height - 1) * spacing_y;
    if (!std::isfinite(west) || !std::isfinite(place.origin_y) || !(spacing_x > 0.0) || !std::isfinite(spacing_x) ||
        !(spacing_y > 0.0)) {
      corrupt(
          fmt::format("the header puts the first node at ({}, {}) and the next ones {} and {} from it, must be "
                      "finite numbers, the distances positive",
                      west, south, spacing_x, spacing_y));
    }
  }

  void set_place_by_corners(double west, double east, double south, double north) {
    set_place(west, south, (east - west) / static_cast<double>(info_.width - 1),
              (north - south) / static_cast<double>(info_.height - 1));
    info_.georeference.origin_y = north;
  }

  void set_layout(std::uint64_t offset_bytes, SampleType type) {
    info_.sample_type = type;
    layout_.offset_bytes = offset_bytes;
    layout_.row_bytes = static_cast<std::uint64_t>(info_.width) * size_bytes(type);
    const std::uint64_t room = file_->size_bytes() - offset_bytes;
    if (layout_.row_bytes > room / static_cast<std::uint64_t>(info_.height)) {
      corrupt(fmt::format("ends early: {} x {} nodes of {} bytes begin at byte {}, the file has {} bytes", info_.width,
                          info_.height, size_bytes(type), offset_bytes, file_->size_bytes()));
    }
  }

  void read_surfer6() {
    info_.format = "Surfer 6 grid";
    std::array<std::byte, kSurfer6HeaderBytes> header{};
    file_->read(0, header);
    ByteReader in(header);
    (void)in.read_bytes(kMagicBytes);
    const double columns = in.read<std::int16_t>();
    const double rows = in.read<std::int16_t>();
    set_size(columns, rows);
    const auto west = in.read<double>();
    const auto east = in.read<double>();
    const auto south = in.read<double>();
    const auto north = in.read<double>();
    set_place_by_corners(west, east, south, north);
    set_layout(header.size(), SampleType::kFloat32);
    const std::uint64_t end = layout_.offset_bytes + layout_.row_bytes * static_cast<std::uint64_t>(info_.height);
    if (end < file_->size_bytes()) {
      info_.warnings.push_back(loss(fmt::format("{} bytes follow the grid", file_->size_bytes() - end)));
    }
  }

  /// Sections, each with its name and size.
  void read_surfer7() {
    info_.format = "Surfer 7 grid";
    std::uint64_t at = 0;
    bool has_grid = false;
    for (int i = 0; i < kMostSections; ++i) {
      std::array<std::byte, 8> head{};
      file_->read(at, head);
      const std::string_view name = text_of(head).substr(0, kMagicBytes);
      const auto size = ByteReader(std::span<const std::byte>(head).subspan(kMagicBytes)).read<std::int32_t>();
      at += head.size();
      if (name == kDataSection) {
        if (!has_grid) corrupt("its data come before the section that says what they are");
        return set_layout(at, SampleType::kFloat64);
      }
      if (size < 0) corrupt(fmt::format("section {} at byte {} has a size of {} bytes", printable(name), at - 8, size));
      if (name == kGridSection) {
        if (static_cast<std::size_t>(size) < kGridSectionBytes) {
          corrupt(fmt::format("the grid section has {} bytes, must have {}", size, kGridSectionBytes));
        }
        read_grid_section(at);
        has_grid = true;
      }
      at += static_cast<std::uint64_t>(size);
    }
    corrupt(fmt::format("has {} sections without data among them", kMostSections));
  }

  void read_grid_section(std::uint64_t at) {
    std::array<std::byte, kGridSectionBytes> section{};
    file_->read(at, section);
    ByteReader in(section);
    const double rows = in.read<std::int32_t>();
    const double columns = in.read<std::int32_t>();
    set_size(columns, rows);
    const auto west = in.read<double>();
    const auto south = in.read<double>();
    const auto spacing_x = in.read<double>();
    const auto spacing_y = in.read<double>();
    set_place(west, south, spacing_x, spacing_y);
    (void)in.read_bytes(16);  // the range of the elevations
    const auto angle = in.read<double>();
    if (angle != 0.0) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: the grid is turned by {}; only grids along the axes are read", info_.path, angle));
    }
    const auto blank = in.read<double>();
    if (std::isfinite(blank)) info_.void_values = {blank};
  }

  double next_number(const char* what) {
    std::string_view word;
    double value = 0.0;
    if (!words_->next(word)) corrupt(fmt::format("line {}: ends before {}", words_->line(), what));
    if (!read_decimal(word, value)) refuse_word(word);
    return value;
  }

  [[noreturn]] void refuse_word(std::string_view word) const {
    corrupt(fmt::format("\"{}\" at byte {} is not a number", printable(word), words_->offset_of(word)));
  }

  void read_text_header() {
    info_.format = "Surfer text grid";
    info_.sample_type = SampleType::kFloat64;
    words_.emplace(*file_);
    std::string_view word;
    (void)words_->next(word);
    if (word != kText) corrupt(fmt::format("begins with \"{}\", must begin with DSAA", printable(word)));
    const double columns = next_number("the number of columns");
    const double rows = next_number("the number of rows");
    set_size(columns, rows);
    const double west = next_number("the range of x");
    const double east = next_number("the range of x");
    const double south = next_number("the range of y");
    const double north = next_number("the range of y");
    set_place_by_corners(west, east, south, north);
    (void)next_number("the range of z");
    (void)next_number("the range of z");
    // A number takes a byte and another one keeps it apart from the next.
    const auto most = static_cast<std::int64_t>((file_->size_bytes() + 1) / 2);
    if (info_.height > most / info_.width) {
      corrupt(fmt::format("the header says {} x {} nodes; the file's {} bytes hold {} at most", info_.width,
                          info_.height, file_->size_bytes(), most));
    }
    scan();
  }

  /// Checks every number and notes where rows begin.
  void scan() {
    rows_.emplace(*words_, info_.width);
    std::string_view word;
    double value = 0.0;
    for (std::int64_t row = 0; row < info_.height; ++row) {
      for (std::int64_t column = 0; column < info_.width; ++column) {
        if (!words_->next(word)) {
          corrupt(fmt::format("the file ends after {} of {} x {} nodes", row * info_.width + column, info_.width,
                              info_.height));
        }
        if (column == 0) rows_->note(row, words_->offset_of(word));
        if (!read_decimal(word, value)) refuse_word(word);
      }
    }
    if (words_->next(word)) {
      corrupt(fmt::format("\"{}\" at byte {} comes after the {} x {} nodes that the header says", printable(word),
                          words_->offset_of(word), info_.width, info_.height));
    }
  }

  std::optional<TextTokens> words_;  // of text
  std::optional<TextRows> rows_;     // from the South
};

}  // namespace

bool looks_like_surfer_grid(std::span<const std::byte> head) {
  const std::string_view text = text_of(head).substr(0, kMagicBytes);
  return text == kText || text == kSurfer6 || text == kSurfer7;
}

std::unique_ptr<HeightSource> open_surfer_grid(const std::string& path, const OpenOptions& options) {
  return std::make_unique<SurferGridSource>(path, options);
}

}  // namespace isohf
