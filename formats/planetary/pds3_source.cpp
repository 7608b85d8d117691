#include "formats/planetary/pds3_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "formats/files/file_beside.h"
#include "formats/files/letter_case.h"
#include "formats/files/raw_file.h"
#include "formats/georeference/units.h"
#include "formats/open_options.h"
#include "formats/planetary/label_text.h"
#include "formats/planetary/pds3_layout.h"
#include "formats/planetary/pds3_place.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// A VAX F-float, its bytes as stored, as an IEEE float: words in the other order, no leading 1 in front of the point,
/// exponents up to 127; its reserved operand is a NaN. The smallest ones lose bits, which are no elevation.
float float_from_vax(std::uint32_t stored) {
  const std::uint32_t bits = stored >> 16U | stored << 16U;
  const auto exponent = static_cast<int>(bits >> 23U & 0xFFU);
  const bool negative = bits >> 31U != 0;
  if (exponent == 0) return negative ? std::numeric_limits<float>::quiet_NaN() : 0.0F;
  const double magnitude = std::ldexp(static_cast<double>((bits & 0x7FFFFFU) | 0x800000U), exponent - 128 - 24);
  return static_cast<float>(negative ? -magnitude : magnitude);
}

class Pds3Source final : public HeightSource {
 public:
  Pds3Source(const std::string& path, const OpenOptions& options) : label_path_(path) {
    if (has_pds3_label(path)) label_path_ = file_beside(path, std::filesystem::path(path).stem().string() + ".lbl");
    const LabelText label = read_label(label_path_, options.unpacked_bytes);
    const LabelBlock& image = only_image(label.root);
    const LabelFields fields(label_path_, image);
    info_.path = path;
    info_.format = "PDS3";
    layout_ = pds3_layout(fields);
    find_data(label);
    if (label_path_ != path && !same_file(path, data_path_)) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: its label {} describes {} instead", path, label_path_, data_path_));
    }
    file_.emplace(data_path_, options.unpacked_bytes);
    check_size(label);
    describe(fields, label.root);
    const std::int64_t band = choose_band(info_, options, layout_.bands);
    layout_.offset_bytes += static_cast<std::uint64_t>(band * layout_.band_stride_bytes);
    apply_open_options(info_, options);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0);
    ISOHF_ASSERT(window.column + window.columns <= info_.width && window.row + window.rows <= info_.height);
    const auto size = static_cast<std::int64_t>(size_bytes(info_.sample_type));
    ISOHF_ASSERT(static_cast<std::int64_t>(samples.size()) == window.columns * window.rows * size);
    if (samples.empty()) return;
    const bool together = layout_.sample_stride_bytes == size;
    if (together && window.columns == info_.width && layout_.line_stride_bytes == window.columns * size) {
      file_->read(place_of(window.row, 0), samples);
    } else {
      const auto run = static_cast<std::size_t>(window.columns * size);
      for (std::int64_t r = 0; r < window.rows; ++r) {
        const auto out = samples.subspan(static_cast<std::size_t>(r) * run, run);
        const std::uint64_t at = place_of(window.row + r, window.column);
        if (together) {
          file_->read(at, out);
        } else {
          read_interleaved(at, window.columns, out);
        }
      }
    }
    if (layout_.big_endian) swap_byte_order(samples, static_cast<std::size_t>(size));
    if (!layout_.vax) return;
    for (std::size_t at = 0; at < samples.size(); at += sizeof(float)) {
      std::uint32_t stored = 0;
      std::memcpy(&stored, samples.data() + at, sizeof(stored));
      const float value = float_from_vax(stored);
      std::memcpy(samples.data() + at, &value, sizeof(value));
    }
  }

  void limit_buffers(std::uint64_t bytes) override { file_->limit_buffers(bytes); }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override { return file_->buffer_bytes(limit); }

 private:
  [[nodiscard]] const LabelBlock& only_image(const LabelBlock& root) const {
    const auto images = root.all("IMAGE");
    if (images.size() == 1) return *images.front();
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the label describes {} objects IMAGE, must be 1", label_path_, images.size()));
  }

  /// Follows ^IMAGE: (record), <BYTES>, "file", ("file", record). The outer label's pointer goes before inner ones.
  void find_data(const LabelText& label) {
    const LabelBlock* holder = label.root.entry("^IMAGE") != nullptr ? &label.root : nullptr;
    for (const char* name : {"UNCOMPRESSED_FILE", "FILE"}) {
      for (const LabelBlock* block : label.root.all(name)) {
        if (holder == nullptr && block->entry("^IMAGE") != nullptr) holder = block;
      }
    }
    if (holder == nullptr) {
      throw Error(ErrorCode::kUnsupported, label_path_ + ": the label has no ^IMAGE, which says where the samples are");
    }
    const LabelEntry& pointer = *holder->entry("^IMAGE");
    const auto refuse = [&](const std::string& what) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: ^IMAGE {}", label_path_, pointer.line, what));
    };
    if (pointer.values.empty() || pointer.values.size() > 2) refuse("must be a place, a file, or a file and a place");
    const bool names_file = pointer.values.size() == 2 || !number_of(pointer.values.front());
    data_path_ = label_path_;
    if (names_file) {
      const std::string& name = pointer.values.front().text;
      if (name.find('/') != std::string::npos) refuse(fmt::format("names {}, must be a file beside the label", name));
      data_path_ = file_beside(label_path_, name);
      if (data_path_.empty()) {
        throw Error(ErrorCode::kIo, fmt::format("{}: label line {}: ^IMAGE names {}, which is not beside the label",
                                                label_path_, pointer.line, name));
      }
    }
    if (names_file && pointer.values.size() == 1) return;
    const LabelValue& place = pointer.values.back();
    const std::optional<double> number = number_of(place);
    if (!number || !(*number >= 1.0) || *number > 9e15 || *number != static_cast<double>(std::int64_t(*number))) {
      refuse(fmt::format("is \"{}\", must be a whole number from 1", place.text));
    }
    const auto ordinal = static_cast<std::uint64_t>(*number) - 1;
    if (place.unit.rfind("byte", 0) == 0) {
      image_bytes_ = ordinal;
    } else {
      const LabelBlock& records = holder->entry("RECORD_BYTES") != nullptr ? *holder : label.root;
      const auto record =
          static_cast<std::uint64_t>(LabelFields(label_path_, records).count("RECORD_BYTES", 1, std::int64_t{1} << 31));
      if (ordinal > (std::uint64_t{1} << 62U) / record) refuse("points beyond any file");
      image_bytes_ = ordinal * record;
    }
    pointer_line_ = pointer.line;
  }

  [[nodiscard]] static bool same_file(const std::string& a, const std::string& b) {
    std::error_code ignored;
    return std::filesystem::equivalent(a, b, ignored);
  }

  /// Every sample must be in the file, and none inside the label.
  void check_size(const LabelText& label) {
    const std::uint64_t total = layout_.total_bytes;
    const std::uint64_t there = file_->size_bytes();
    if (data_path_ == label_path_ && image_bytes_ < label.end_bytes) {
      // Editing a label's text moves the samples. Where they fill the rest of the file there is no doubt.
      if (there < label.end_bytes + total || there > label.end_bytes + total + 3) {
        throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: ^IMAGE points at byte {}, inside the label, "
                                                     "which ends at byte {}",
                                                     label_path_, pointer_line_, image_bytes_ + 1, label.end_bytes));
      }
      info_.warnings.push_back(
          fmt::format("^IMAGE points at byte {}, inside the label, which ends at byte {}; the samples fill the rest of "
                      "the file and "
                      "are read from there",
                      image_bytes_ + 1, label.end_bytes));
      image_bytes_ = label.end_bytes;
    }
    if (image_bytes_ + total > there) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: has {} bytes; {} x {} samples of {} from byte {} need {}",
                                                   data_path_, there, layout_.columns, layout_.rows,
                                                   to_string(layout_.type), image_bytes_, image_bytes_ + total));
    }
    layout_.offset_bytes += image_bytes_;
  }

  void describe(const LabelFields& image, const LabelBlock& root) {
    info_.width = layout_.columns;
    info_.height = layout_.rows;
    info_.sample_type = layout_.type;
    info_.block_width = info_.width;
    info_.block_height = 1;
    info_.z_scale = image.number("SCALING_FACTOR").value_or(1.0);
    info_.z_offset = image.number("OFFSET").value_or(0.0);
    if (info_.z_scale == 0.0) image.refuse("SCALING_FACTOR", "other than 0");
    const std::string unit = image.word("UNIT").value_or("N/A");
    if (unit != "N/A" && unit != "UNK" && unit != "NULL") {
      const std::optional<LinearUnit> length = linear_unit(unit);
      info_.vertical_unit = length ? length->name : lower_case(unit);
      info_.metres_per_vertical_unit = length ? length->metres : 1.0;
    }
    for (const char* key : {"MISSING_CONSTANT", "MISSING", "NULL", "NULL_CONSTANT", "CORE_NULL", "INVALID_CONSTANT",
                            "LOW_REPR_SATURATION", "LOW_INSTR_SATURATION", "HIGH_REPR_SATURATION",
                            "HIGH_INSTR_SATURATION", "CORE_LOW_REPR_SATURATION", "CORE_LOW_INSTR_SATURATION",
                            "CORE_HIGH_REPR_SATURATION", "CORE_HIGH_INSTR_SATURATION"}) {
      if (const LabelEntry* entry = image.block().entry(key)) {
        for (const LabelValue& value : entry->values) add_void(key, value);
      }
    }
    // ISIS writes its special pixels into PDS products: the lowest values of 32 bit floats, up to FF7FFFF9.
    if (info_.sample_type == SampleType::kFloat32 && !layout_.vax) info_.valid_min = std::bit_cast<float>(0xFF7FFFFAU);
    Pds3Place place = place_from_pds3(label_path_, root, info_.width, info_.height);
    info_.georeference = std::move(place.georeference);
    info_.warnings.insert(info_.warnings.end(), place.warnings.begin(), place.warnings.end());
  }

  /// A based constant of a float gives the bits, not the number.
  void add_void(const char* key, const LabelValue& value) {
    std::optional<double> number = number_of(value);
    if (!number) return;  // N/A
    if (info_.sample_type == SampleType::kFloat32 && value.text.find('#') != std::string::npos) {
      const auto bits = static_cast<std::uint32_t>(*number);
      number = static_cast<double>(layout_.vax ? float_from_vax(bits) : std::bit_cast<float>(bits));
    }
    const std::optional<double> stored = void_value_as_stored(info_.sample_type, *number);
    if (!stored) {
      info_.warnings.push_back(loss(fmt::format("{} is {}, which no {} sample can hold; it is left aside", key,
                                                value.text, to_string(info_.sample_type))));
    } else if (std::find(info_.void_values.begin(), info_.void_values.end(), *stored) == info_.void_values.end()) {
      info_.void_values.push_back(*stored);
    }
  }

  [[nodiscard]] std::uint64_t place_of(std::int64_t row, std::int64_t column) const {
    return layout_.offset_bytes +
           static_cast<std::uint64_t>(row * layout_.line_stride_bytes + column * layout_.sample_stride_bytes);
  }

  /// Picks one band's samples out of those of all bands, a bounded piece at a time.
  void read_interleaved(std::uint64_t at, std::int64_t columns, std::span<std::byte> out) {
    constexpr std::int64_t kColumnsAtOnce = 4096;
    const std::size_t size = size_bytes(info_.sample_type);
    const auto stride = static_cast<std::size_t>(layout_.sample_stride_bytes);
    for (std::int64_t done = 0; done < columns; done += kColumnsAtOnce) {
      const auto count = static_cast<std::size_t>(std::min(kColumnsAtOnce, columns - done));
      piece_.resize((count - 1) * stride + size);
      file_->read(at + static_cast<std::uint64_t>(done) * stride, piece_);
      std::byte* to = out.data() + static_cast<std::size_t>(done) * size;
      for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * size, piece_.data() + i * stride, size);
    }
  }

  std::string label_path_;
  Pds3Layout layout_;
  std::string data_path_;
  std::uint64_t image_bytes_ = 0;  // where ^IMAGE points
  int pointer_line_ = 0;
  std::optional<RawFile> file_;
  std::vector<std::byte> piece_;
  SourceInfo info_;
};

}  // namespace

bool looks_like_pds3(std::span<const std::byte> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const auto skip_blank = [&] {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  };
  skip_blank();
  if (text.substr(0, 4) == "CCSD" || text.substr(0, 4) == "NJPL") {
    text.remove_prefix(std::min(text.find('\n'), text.size()));
    skip_blank();
  }
  return text.substr(0, 14) == "PDS_VERSION_ID";
}

bool has_pds3_label(const std::string& path) {
  if (lower_case(std::filesystem::path(path).extension().string()) != ".img") return false;
  std::array<std::byte, 128> head = {};
  const auto is_label = [&](const std::string& file) {
    const RawFile raw(file);
    return looks_like_pds3(std::span(head).first(raw.read_some(0, head)));
  };
  if (is_label(path)) return false;
  const std::string label = file_beside(path, std::filesystem::path(path).stem().string() + ".lbl");
  return !label.empty() && is_label(label);
}

std::unique_ptr<HeightSource> open_pds3(const std::string& path, const OpenOptions& options) {
  return std::make_unique<Pds3Source>(path, options);
}

}  // namespace isohf
