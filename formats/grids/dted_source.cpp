#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kTapeRecordBytes = 80;
// Where the labels begin, and the records: UHL of 80 bytes, DSI of 648, ACC of 2700.
constexpr std::size_t kDsi = 80;
constexpr std::size_t kAcc = 728;
constexpr std::size_t kHeaderBytes = 3428;
constexpr std::size_t kRecordHeadBytes = 8;     // sentinel, block count, longitude count, latitude count
constexpr std::int64_t kRecordExtraBytes = 12;  // with the checksum
constexpr std::int64_t kProfileRows = 256;
constexpr int kDtedVoid = -32767;
/// Far below any ground; two's complement, which some programs write instead, lands there.
constexpr int kLowestElevation = -16000;

/// Of a number of sign and magnitude, as whose bits it was read.
std::int16_t elevation(std::uint16_t bits) {
  const auto magnitude = static_cast<std::int16_t>(bits & 0x7FFFU);
  return (bits & 0x8000U) != 0 ? static_cast<std::int16_t>(-magnitude) : magnitude;
}

/// A big-endian number of `size` bytes.
std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at, int size) {
  std::uint32_t number = 0;
  for (int i = 0; i < size; ++i)
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[at + static_cast<std::size_t>(i)]);
  return number;
}

class DtedSource final : public PlainSource {
 public:
  DtedSource(const std::string& path, const OpenOptions& options) : PlainSource(path, "DTED") {
    (void)choose_band(info_, options, 1);
    read_header();
    describe();
    describe_datums();
    const std::int64_t record_bytes = kRecordExtraBytes + 2 * info_.height;
    layout_.offset_bytes = header_at_ + kHeaderBytes + kRecordHeadBytes;
    layout_.column_bytes = static_cast<std::uint64_t>(record_bytes);
    layout_.row_bytes = 2;
    layout_.big_endian = true;
    layout_.from_south = true;
    const auto wanted = header_at_ + kHeaderBytes + static_cast<std::uint64_t>(info_.width * record_bytes);
    if (file_->size_bytes() < wanted) {
      fail(ErrorCode::kCorrupt, fmt::format("ends early: {} bytes, {} columns of {} posts need {}", file_->size_bytes(),
                                            info_.width, info_.height, wanted));
    }
    checked_.assign(static_cast<std::size_t>(info_.width), false);
    read_sidecars(info_, 1);
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    for (std::int64_t c = window.column; !samples.empty() && c < window.column + window.columns; ++c) check_column(c);
    PlainSource::read_window(window, samples);
    for (std::size_t at = 0; at < samples.size(); at += sizeof(std::int16_t)) {
      std::uint16_t bits = 0;
      std::memcpy(&bits, samples.data() + at, sizeof bits);
      const std::int16_t value = elevation(bits);
      std::memcpy(samples.data() + at, &value, sizeof value);
    }
  }

 private:
  [[noreturn]] void corrupt(std::string_view label, const std::string& what) const {
    fail(ErrorCode::kCorrupt, fmt::format("{}: {}", label, what));
  }

  [[nodiscard]] std::string_view field(std::size_t at, std::size_t size) const {
    return std::string_view(header_).substr(at, size);
  }

  /// A field of digits; nullopt for any other text.
  [[nodiscard]] std::optional<int> digits(std::size_t at, std::size_t size) const {
    int value = 0;
    for (const char c : field(at, size)) {
      if (std::isdigit(static_cast<unsigned char>(c)) == 0) return std::nullopt;
      value = value * 10 + (c - '0');
    }
    return value;
  }

  [[nodiscard]] int required(std::size_t at, const char* name) const {
    const int value = digits(at, 4).value_or(0);
    if (value < 1) corrupt("UHL", fmt::format("the {} at byte {} is not a number from 1", name, header_at_ + at));
    return value;
  }

  /// "DDDMMSSH" in degrees.
  [[nodiscard]] double angle(std::size_t at, const char* name, const char* hemispheres, int most) const {
    const int degrees = digits(at, 3).value_or(most + 1);
    const int minutes = digits(at + 3, 2).value_or(60);
    const int seconds = digits(at + 5, 2).value_or(60);
    const bool is_negative = header_[at + 7] == hemispheres[1];
    if (degrees > most || minutes > 59 || seconds > 59 || (header_[at + 7] != hemispheres[0] && !is_negative)) {
      corrupt("UHL", fmt::format("the {} of the origin at byte {} is not of the form DDDMMSS{}", name, header_at_ + at,
                                 hemispheres[0]));
    }
    const double value = degrees + minutes / 60.0 + seconds / 3600.0;
    return is_negative ? -value : value;
  }

  void read_header() {
    header_ = first_bytes(*file_, kTapeRecordBytes + 4);
    if (!header_.starts_with("UHL1")) header_at_ = kTapeRecordBytes;
    if (!kDtedFormat.recognises(std::as_bytes(std::span(header_))))
      fail(ErrorCode::kCorrupt, "has no user header label UHL1, must start with it");
    header_.resize(kHeaderBytes);
    if (file_->read_some(header_at_, std::as_writable_bytes(std::span(header_))) != kHeaderBytes) {
      fail(ErrorCode::kCorrupt, fmt::format("ends early: {} bytes, the labels UHL, DSI and ACC alone have {}",
                                            file_->size_bytes(), header_at_ + kHeaderBytes));
    }
    for (const auto& [name, at] : {std::pair("DSI", kDsi), {"ACC", kAcc}}) {
      if (field(at, 3) != name) corrupt(name, fmt::format("is not at byte {}", header_at_ + at));
    }
  }

  void describe() {
    info_.width = required(47, "number of columns");
    info_.height = required(51, "number of posts in a column");
    const std::optional<int> rows = digits(kDsi + 281, 4);
    const std::optional<int> columns = digits(kDsi + 285, 4);
    if (rows && columns && (*rows != info_.height || *columns != info_.width))
      corrupt("DSI", fmt::format("says {} x {} posts, UHL {} x {}", *columns, *rows, info_.width, info_.height));
    if (field(kDsi + 264, 9).find_first_of("123456789") != std::string_view::npos)
      fail(ErrorCode::kUnsupported, "DSI: the cell is rotated; only cells along meridians are read");
    info_.sample_type = SampleType::kInt16;
    info_.void_values = {static_cast<double>(kDtedVoid)};
    info_.vertical_unit = "metre";
    info_.block_width = info_.width;
    info_.block_height = std::min(info_.height, kProfileRows);
    Georeference& geo = info_.georeference;
    geo.registration = Registration::kPoint;
    geo.unit = HorizontalUnit::kDegree;
    // Tenths of arc seconds.
    geo.spacing_x = required(20, "longitude interval") / 36000.0;
    geo.spacing_y = required(24, "latitude interval") / 36000.0;
    geo.has_origin = true;
    geo.origin_x = angle(4, "longitude", "EW", 360);
    geo.origin_y = angle(12, "latitude", "NS", 90) + static_cast<double>(info_.height - 1) * geo.spacing_y;
  }

  void describe_datums() {
    ReferenceSystem& system = info_.georeference.system;
    const std::string_view vertical = field(kDsi + 141, 3);
    const std::string_view horizontal = field(kDsi + 144, 5);
    if (horizontal == "WGS84" || horizontal == "WGS72") {
      take_system(horizontal == "WGS84" ? "EPSG:4326" : "EPSG:4322", info_);
    } else {
      info_.warnings.push_back(
          loss("the horizontal datum in DSI is neither WGS84 nor WGS72; its ellipsoid is not known"));
    }
    system.body = "Earth";
    if (vertical == "E96") system.vertical_datum = "EGM96";
    if (vertical == "MSL") system.vertical_datum = "mean sea level";
  }

  /// Checks a column's record when it is first touched.
  void check_column(std::int64_t index) {
    if (checked_[static_cast<std::size_t>(index)]) return;
    const std::uint64_t at =
        layout_.offset_bytes - kRecordHeadBytes + static_cast<std::uint64_t>(index) * layout_.column_bytes;
    std::vector<std::byte> record(layout_.column_bytes);
    file_->read(at, record);
    const std::string name = fmt::format("column {} at byte {}", index, at);
    if (record[0] != std::byte{0xAA})
      corrupt(name, fmt::format("starts with {:#04x}, must with 0xaa", number_at(record, 0, 1)));
    if (const auto number = number_at(record, 4, 2); number != static_cast<std::uint64_t>(index))
      corrupt(name, fmt::format("says that it is column {}", number));
    if (const auto first = number_at(record, 6, 2); first != 0)
      corrupt(name, fmt::format("starts at post {}, must at 0", first));
    const std::size_t end = record.size() - 4;
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < end; ++i) sum += std::to_integer<std::uint32_t>(record[i]);
    if (const std::uint32_t stored = number_at(record, end, 4); stored != sum)
      corrupt(name, fmt::format("its checksum is {}, its bytes sum up to {}", stored, sum));
    for (std::size_t i = kRecordHeadBytes; i < end; i += 2) {
      const int value = elevation(static_cast<std::uint16_t>(number_at(record, i, 2)));
      if (value < kLowestElevation && value != kDtedVoid) {
        corrupt(name, fmt::format("post {} from the South is at {} m, must be above {} (two's complement is no DTED)",
                                  (i - kRecordHeadBytes) / 2, value, kLowestElevation));
      }
    }
    checked_[static_cast<std::size_t>(index)] = true;
  }

  std::size_t header_at_ = 0;
  std::string header_;  // UHL, DSI, ACC
  std::vector<bool> checked_;
};

bool looks_like_dted(std::span<const std::byte> head) {
  return text_of(head).starts_with("UHL1") ||
         text_of(head).substr(std::min(kTapeRecordBytes, head.size())).starts_with("UHL1");
}

std::unique_ptr<HeightSource> open_dted(const std::string& path, const OpenOptions& options) {
  return std::make_unique<DtedSource>(path, options);
}

}  // namespace

const Format kDtedFormat = {
    .name = "DTED", .extensions = {".dt0", ".dt1", ".dt2"}, .open = open_dted, .recognises = looks_like_dted};

}  // namespace isohf
