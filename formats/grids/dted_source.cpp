#include "formats/readers.h"
#include "isohf/projection/source_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kTapeRecordBytes = 80;
constexpr std::size_t kUhlBytes = 80;
constexpr std::size_t kDsiBytes = 648;
constexpr std::size_t kAccBytes = 2700;
constexpr std::size_t kHeaderBytes = kUhlBytes + kDsiBytes + kAccBytes;
constexpr std::int64_t kRecordHeadBytes = 8;    // sentinel, block count, longitude count, latitude count
constexpr std::int64_t kRecordExtraBytes = 12;  // with the checksum
constexpr std::int64_t kProfileRows = 256;
constexpr int kDtedVoid = -32767;
/// Far below any ground; two's complement, which some programs write instead, lands there.
constexpr int kLowestElevation = -16000;

unsigned at_u8(std::span<const std::byte> bytes, std::size_t i) {
  return std::to_integer<unsigned>(bytes[i]);
}

/// Sign and magnitude, not two's complement.
int elevation(std::byte high, std::byte low) {
  const int magnitude = ((std::to_integer<int>(high) & 0x7F) << 8) | std::to_integer<int>(low);
  return (std::to_integer<int>(high) & 0x80) != 0 ? -magnitude : magnitude;
}

class DtedSource final : public FileSource {
 public:
  DtedSource(const std::string& path, const OpenOptions& options) : FileSource(path, "DTED", options) {
    (void)choose_band(info_, options, 1);
    read_header();
    describe();
    check_size();
    checked_.assign(static_cast<std::size_t>(info_.width), false);
    read_auxiliary_metadata(info_, 1);
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    for (std::int64_t c = 0; c < window.columns; ++c) {
      const std::span<const std::byte> posts = column(window.column + c, window.row, window.rows);
      // From South to North; rows run from North to South.
      std::byte* out = samples.data() + (c + (window.rows - 1) * window.columns) * 2;
      for (std::size_t i = 0; i < posts.size(); i += 2, out -= window.columns * 2) {
        const int value = elevation(posts[i], posts[i + 1]);
        const auto sample = static_cast<std::int16_t>(value);
        std::memcpy(out, &sample, sizeof sample);
      }
    }
  }

 private:
  [[noreturn]] void corrupt(std::string_view label, const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}: {}", info_.path, label, what));
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

  [[nodiscard]] int required(std::size_t at, std::size_t size, const char* name, int lowest) const {
    const std::optional<int> value = digits(at, size);
    if (!value || *value < lowest) {
      corrupt("UHL", fmt::format("the {} at byte {} is not a number from {}", name, header_at_ + at, lowest));
    }
    return *value;
  }

  /// "DDDMMSSH" in degrees.
  [[nodiscard]] double angle(std::size_t at, const char* name, char positive, char negative, int most) const {
    const std::optional<int> degrees = digits(at, 3);
    const std::optional<int> minutes = digits(at + 3, 2);
    const std::optional<int> seconds = digits(at + 5, 2);
    const char hemisphere = header_[at + 7];
    if (!degrees || !minutes || !seconds || *degrees > most || *minutes > 59 || *seconds > 59 ||
        (hemisphere != positive && hemisphere != negative)) {
      corrupt("UHL", fmt::format("the {} of the origin at byte {} is not of the form DDDMMSS{}", name, header_at_ + at,
                                 positive));
    }
    const double value = *degrees + *minutes / 60.0 + *seconds / 3600.0;
    return hemisphere == positive ? value : -value;
  }

  void read_header() {
    std::array<std::byte, kTapeRecordBytes + 4> head = {};
    const std::span<const std::byte> start(head.data(), file_->read_some(0, head));
    while (header_at_ < kTapeRecordBytes && text_of(start).substr(std::min(header_at_, start.size()), 4) != "UHL1")
      header_at_ += kTapeRecordBytes;
    if (text_of(start).substr(std::min(header_at_, start.size()), 4) != "UHL1") {
      throw Error(ErrorCode::kCorrupt, info_.path + ": has no user header label UHL1, must start with it");
    }
    header_.resize(kHeaderBytes);
    if (file_->read_some(header_at_, std::as_writable_bytes(std::span(header_))) != kHeaderBytes) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: ends early: {} bytes, the labels UHL, DSI and ACC alone have {}", info_.path,
                              file_->size_bytes(), header_at_ + kHeaderBytes));
    }
    if (field(kUhlBytes, 3) != "DSI") corrupt("DSI", fmt::format("is not at byte {}", header_at_ + kUhlBytes));
    if (field(kUhlBytes + kDsiBytes, 3) != "ACC") {
      corrupt("ACC", fmt::format("is not at byte {}", header_at_ + kUhlBytes + kDsiBytes));
    }
  }

  void describe() {
    info_.width = required(47, 4, "number of columns", 1);
    info_.height = required(51, 4, "number of posts in a column", 1);
    const std::optional<int> rows = digits(kUhlBytes + 281, 4);
    const std::optional<int> columns = digits(kUhlBytes + 285, 4);
    if (rows && columns && (*rows != info_.height || *columns != info_.width)) {
      corrupt("DSI", fmt::format("says {} x {} posts, UHL {} x {}", *columns, *rows, info_.width, info_.height));
    }
    const std::string_view turned = field(kUhlBytes + 264, 9);
    if (turned.find_first_of("123456789") != std::string_view::npos) {
      throw Error(ErrorCode::kUnsupported,
                  info_.path + ": DSI: the cell is rotated; only cells along meridians are read");
    }
    info_.sample_type = SampleType::kInt16;
    info_.void_values = {static_cast<double>(kDtedVoid)};
    info_.vertical_unit = "metre";
    info_.block_width = info_.width;
    info_.block_height = std::min(info_.height, kProfileRows);
    Georeference& geo = info_.georeference;
    geo.registration = Registration::kPoint;
    geo.unit = HorizontalUnit::kDegree;
    // Tenths of arc seconds.
    geo.spacing_x = required(20, 4, "longitude interval", 1) / 36000.0;
    geo.spacing_y = required(24, 4, "latitude interval", 1) / 36000.0;
    geo.has_origin = true;
    geo.origin_x = angle(4, "longitude", 'E', 'W', 360);
    geo.origin_y = angle(12, "latitude", 'N', 'S', 90) + static_cast<double>(info_.height - 1) * geo.spacing_y;
    describe_datums();
    check_level();
  }

  /// The name's level is the distance of posts along a meridian: 30, 3 or 1 seconds.
  void check_level() {
    const std::size_t at = info_.path.rfind(".dt");
    if (at == std::string::npos || at + 4 != info_.path.size()) return;
    const int level = info_.path.back() - '0';
    constexpr std::array<int, 3> kTenthsOfSeconds = {300, 30, 10};
    const std::optional<int> interval = digits(24, 4);
    if (level < 0 || level > 2 || !interval || *interval == kTenthsOfSeconds[static_cast<std::size_t>(level)]) return;
    info_.warnings.push_back(fmt::format("its name says DTED level {}, whose posts are {} seconds apart; they are {}",
                                         level, kTenthsOfSeconds[static_cast<std::size_t>(level)] / 10,
                                         *interval / 10.0));
  }

  void describe_datums() {
    ReferenceSystem& system = info_.georeference.system;
    system.body = "Earth";
    const std::string_view horizontal = field(kUhlBytes + 144, 5);
    if (horizontal == "WGS84") {
      system = wgs84_system();
    } else if (horizontal == "WGS72") {
      system.name = "WGS 72";
      system.epsg = 4322;
      system.semi_major_axis_m = 6378135.0;
      system.inverse_flattening = 298.26;
    } else {
      info_.warnings.push_back(
          loss("the horizontal datum in DSI is neither WGS84 nor WGS72; its ellipsoid is not known"));
    }
    const std::string_view vertical = field(kUhlBytes + 141, 3);
    if (vertical == "E96") {
      system.vertical_datum = "EGM96";
    } else if (vertical == "MSL") {
      system.vertical_datum = "mean sea level";
    }
  }

  void check_size() const {
    const auto wanted = header_at_ + kHeaderBytes + static_cast<std::uint64_t>(info_.width * record_bytes());
    if (file_->size_bytes() < wanted) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: ends early: {} bytes, {} columns of {} posts need {}",
                                                   info_.path, file_->size_bytes(), info_.width, info_.height, wanted));
    }
  }

  [[nodiscard]] std::int64_t record_bytes() const { return kRecordExtraBytes + 2 * info_.height; }

  /// The posts of `rows` rows from `row` on, as stored, from South to North. Valid until the next call.
  std::span<const std::byte> column(std::int64_t index, std::int64_t row, std::int64_t rows) {
    const auto at = header_at_ + kHeaderBytes + static_cast<std::uint64_t>(index * record_bytes());
    const std::int64_t begin = kRecordHeadBytes + 2 * (info_.height - row - rows);
    record_.resize(static_cast<std::size_t>(record_bytes()));
    const std::span<std::byte> record(record_);
    const auto posts = record.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(2 * rows));
    if (checked_[static_cast<std::size_t>(index)]) {
      file_->read(at + static_cast<std::uint64_t>(begin), posts);
    } else {
      file_->read(at, record);
      check_record(index, at, record);
      checked_[static_cast<std::size_t>(index)] = true;
    }
    return posts;
  }

  void check_record(std::int64_t index, std::uint64_t at, std::span<const std::byte> record) const {
    const std::string name = fmt::format("column {} at byte {}", index, at);
    if (at_u8(record, 0) != 0xAA) corrupt(name, fmt::format("starts with {:#04x}, must with 0xaa", at_u8(record, 0)));
    const unsigned number = at_u8(record, 4) << 8U | at_u8(record, 5);
    if (number != static_cast<unsigned>(index)) corrupt(name, fmt::format("says that it is column {}", number));
    const unsigned first = at_u8(record, 6) << 8U | at_u8(record, 7);
    if (first != 0) corrupt(name, fmt::format("starts at post {}, must at 0", first));
    const std::size_t end = record.size() - 4;
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < end; ++i) sum += at_u8(record, i);
    const std::uint32_t stored = at_u8(record, end) << 24U | at_u8(record, end + 1) << 16U |
                                 at_u8(record, end + 2) << 8U | at_u8(record, end + 3);
    if (stored != sum) {
      corrupt(name, fmt::format("its checksum is {}, its bytes sum up to {}", stored, sum));
    }
    for (std::size_t i = kRecordHeadBytes; i < end; i += 2) {
      const int value = elevation(record[i], record[i + 1]);
      if (value < kLowestElevation && value != kDtedVoid) {
        corrupt(name, fmt::format("post {} from the South is at {} m, must be above {} (two's complement is no DTED)",
                                  (i - kRecordHeadBytes) / 2, value, kLowestElevation));
      }
    }
  }

  std::size_t header_at_ = 0;
  std::string header_;  // UHL, DSI, ACC
  std::vector<bool> checked_;
  std::vector<std::byte> record_;
};

}  // namespace

bool looks_like_dted(std::span<const std::byte> head) {
  return text_of(head).starts_with("UHL1") ||
         text_of(head).substr(std::min(kTapeRecordBytes, head.size())).starts_with("UHL1");
}

std::unique_ptr<HeightSource> open_dted(const std::string& path, const OpenOptions& options) {
  return std::make_unique<DtedSource>(path, options);
}

}  // namespace isohf
