#include <fmt/core.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <list>
#include <numeric>
#include <optional>
#include <pugixml.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/mosaic/mosaic_layout.h"
#include "formats/mosaic/reader_pool.h"
#include "formats/mosaic/strip_reader.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/file.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kHeadBytes = 512;
constexpr std::uint64_t kLongestVrt = std::uint64_t{256} << 20U;
constexpr std::int64_t kMostSide = std::int64_t{1} << 31;
/// Strips are as large as the blocks say that a VRT states of its sources, up to here, and to so many times what may be
/// kept: a claim, which nothing is held against.
constexpr std::uint64_t kMostClaimedBytes = std::uint64_t{64} << 20U;
constexpr std::uint64_t kStripsOfLimit = 8;
/// Of a sample: places in a VRT are written in decimals.
constexpr double kOnTheGrid = 1e-3;

/// A file, and where it lies in the mosaic.
struct Piece {
  std::string path;
  std::int64_t band = 1;
  std::string type;  ///< of its samples, as the VRT says; empty: it does not
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::optional<double> skipped;  ///< of its values, which let what lies beneath through
};

/// What a window takes from a piece.
struct Part {
  const Piece* piece = nullptr;
  Window own;               ///< in the file
  std::int64_t column = 0;  ///< of its first sample in the window
  std::int64_t row = 0;
  HeightSource* source = nullptr;
  std::span<std::byte> samples;  ///< of the file's kind
};

class VrtSource final : public FileSource {
 public:
  VrtSource(const std::string& path, const OpenOptions& options)
      : FileSource(path, "VRT", options), unpacked_bytes_(options.unpacked_bytes) {
    std::string text(static_cast<std::size_t>(std::min(file_->size_bytes(), kLongestVrt + 1)), '\0');
    if (text.size() > kLongestVrt) fail(ErrorCode::kUnsupported, "is larger than 256 MiB");
    file_->read(0, std::as_writable_bytes(std::span(text)));
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer_inplace(text.data(), text.size());
    if (!parsed) {
      fail(ErrorCode::kCorrupt, fmt::format("is no whole XML: {} at byte {}", parsed.description(), parsed.offset));
    }
    read(document.child("VRTDataset"), options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    strips_.read(window, samples);
  }
  void limit_buffers(std::uint64_t bytes) override {
    limit_ = bytes / most_open_;
    for (Opened& each : opened_) each.source->limit_buffers(limit_);
    strips_.set_rows(strip_rows(bytes));
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    const auto rows = static_cast<std::size_t>(strip_rows(limit));
    const std::size_t part = rows * static_cast<std::size_t>(widest_) * size_bytes(info_.sample_type);
    const std::size_t strip = rows * row_bytes();
    return limit + strip + std::min(strip, std::max(part, kBatchBytes));
  }

 private:
  struct Opened {
    const Piece* piece;
    std::unique_ptr<HeightSource> source;
  };

  [[noreturn]] void refuse(const std::string& what) const {
    fail(ErrorCode::kUnsupported, fmt::format("{}; gdal_translate {} OUT.tif makes a GeoTIFF of it", what, info_.path));
  }

  double number(const pugi::xml_node& node, const char* attribute, std::optional<double> otherwise = {}) const {
    const pugi::xml_attribute found = node.attribute(attribute);
    double value = 0.0;
    if (!found && otherwise) return *otherwise;
    if (!found || !read_decimal(found.value(), value) || !std::isfinite(value)) {
      fail(ErrorCode::kCorrupt,
           fmt::format("{} of {} is \"{}\", must be a number", attribute, node.name(), printable(found.value())));
    }
    return value;
  }

  std::int64_t whole(const pugi::xml_node& node, const char* attribute, std::optional<double> otherwise = {}) const {
    const double value = number(node, attribute, otherwise);
    const double nearest = std::round(value);
    if (std::abs(value - nearest) > kOnTheGrid) {
      refuse(fmt::format("resamples: {} of {} is {}, between samples", attribute, node.name(), value));
    }
    if (!(nearest >= 0.0 && nearest <= static_cast<double>(kMostSide))) {
      fail(ErrorCode::kCorrupt,
           fmt::format("{} of {} is {}, must be 0 to {}", attribute, node.name(), value, kMostSide));
    }
    return static_cast<std::int64_t>(nearest);
  }

  std::optional<double> element_number(const pugi::xml_node& parent, const char* name) const {
    const pugi::xml_node node = parent.child(name);
    if (!node) return std::nullopt;
    double value = 0.0;
    if (!read_decimal(trimmed(node.text().get()), value)) {
      fail(ErrorCode::kCorrupt, fmt::format("{} is \"{}\", must be a number", name, printable(node.text().get())));
    }
    return value;
  }

  void read(const pugi::xml_node& root, const OpenOptions& options) {
    if (!root) fail(ErrorCode::kCorrupt, "has no VRTDataset");
    if (const std::string kind = root.attribute("subClass").value(); !kind.empty()) refuse("is a " + printable(kind));
    info_.width = whole(root, "rasterXSize");
    info_.height = whole(root, "rasterYSize");
    if (info_.width < 1 || info_.height < 1) fail(ErrorCode::kCorrupt, "has a rasterXSize or rasterYSize of 0");
    std::vector<pugi::xml_node> bands;
    std::vector<std::string> names;
    for (const pugi::xml_node& band : root.children("VRTRasterBand")) {
      bands.push_back(band);
      names.push_back(trimmed(band.child("Description").text().get()));
    }
    if (bands.empty()) fail(ErrorCode::kCorrupt, "has no VRTRasterBand");
    const pugi::xml_node band =
        bands[static_cast<std::size_t>(choose_band(info_, options, static_cast<std::int64_t>(bands.size()), names))];
    const std::string kind = band.attribute("subClass").value();
    if (!kind.empty() && kind != "VRTSourcedRasterBand") refuse("has a " + printable(kind));
    for (const pugi::xml_node& node : band.children()) read_source(node);
    read_type(band);
    read_system(root);
    if (const auto nodata = band.child("NoDataValue")) read_gdal_nodata(nodata.text().get(), info_);
    for (const auto& [role, element] : {std::pair{"unittype", "UnitType"}, {"scale", "Scale"}, {"offset", "Offset"}}) {
      if (const auto node = band.child(element)) read_gdal_item(role, trimmed(node.text().get()), info_);
    }
    info_.block_width = info_.width;
    type_ = info_.sample_type;
    if (info_.void_values.empty() && options.void_values.empty() && !is_floating(type_) && has_gaps()) {
      const MosaicSamples samples = choose_mosaic_samples({SampleKind::of(info_)}, true, nullptr);
      info_.sample_type = samples.kind.type;
      info_.void_values = samples.kind.void_values;
      info_.valid_min = samples.kind.valid_min;
      info_.warnings.push_back(
          fmt::format("it has samples without a source and no NoDataValue for them: they are void, and samples become "
                      "{} (`void_values` V gives them one)",
                      to_string(info_.sample_type)));
    }
    apply_open_options(info_, options);
    // Where no source is, samples are void whatever makes them so.
    const double none = is_floating(type_) ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    empty_ = stored_sample(info_.sample_type, info_.void_values.empty() ? none : info_.void_values.front());
    arrange();
  }

  void read_type(const pugi::xml_node& band) {
    static constexpr std::array<std::pair<std::string_view, SampleType>, 8> kTypes = {
        {{"Byte", SampleType::kUint8},
         {"Int8", SampleType::kInt8},
         {"UInt16", SampleType::kUint16},
         {"Int16", SampleType::kInt16},
         {"UInt32", SampleType::kUint32},
         {"Int32", SampleType::kInt32},
         {"Float32", SampleType::kFloat32},
         {"Float64", SampleType::kFloat64}}};
    const std::string name = band.attribute("dataType").as_string("Byte");
    const auto* const found = std::ranges::find(kTypes, name, &std::pair<std::string_view, SampleType>::first);
    if (found == kTypes.end()) refuse("has samples of the type " + printable(name));
    for (const Piece& piece : pieces_) {
      if (piece.type.empty() || piece.type == name) continue;
      refuse(fmt::format("has samples of {}, those of {} are {}", name, piece.path, printable(piece.type)));
    }
    info_.sample_type = found->second;
    if (info_.sample_type != SampleType::kUint8) return;
    const auto structure = band.find_child_by_attribute("Metadata", "domain", "IMAGE_STRUCTURE");
    const auto sign = structure.find_child_by_attribute("MDI", "key", "PIXELTYPE");
    // gdalbuildvrt does not say so.
    if (std::string_view(sign.text().get()) == "SIGNEDBYTE" || has_signed_source()) {
      info_.sample_type = SampleType::kInt8;
    }
  }

  /// Whether the first source has signed bytes; one that cannot be opened is reported when it is read.
  [[nodiscard]] bool has_signed_source() const {
    try {
      return !pieces_.empty() && open(pieces_.front())->info().sample_type == SampleType::kInt8;
    } catch (const Error&) {
      return false;
    }
  }

  void read_system(const pugi::xml_node& root) {
    Georeference& place = info_.georeference;
    if (const auto node = root.child("GeoTransform")) place_by_transform(info_.path, node.text().get(), place);
    if (const std::string system = trimmed(root.child("SRS").text().get()); !system.empty()) {
      read_system_text(system, info_.path, info_);
    }
    place.registration = place.has_origin ? Registration::kArea : Registration::kUnknown;
    for (const pugi::xml_node& metadata : root.children("Metadata")) {
      if (metadata.attribute("domain")) continue;
      const auto item = metadata.find_child_by_attribute("MDI", "key", "AREA_OR_POINT");
      if (item && std::string_view(item.text().get()) == "Point") place.registration = Registration::kPoint;
    }
  }

  void read_source(const pugi::xml_node& node) {
    const std::string_view kind = node.name();
    if (!kind.ends_with("Source")) return;
    if (kind != "SimpleSource" && kind != "ComplexSource") refuse(fmt::format("has a {}", printable(kind)));
    for (const char* calculated :
         {"LUT", "Exponent", "ColorTableComponent", "OpenOptions", "ScaleOffset", "ScaleRatio"}) {
      if (node.child(calculated)) refuse(fmt::format("has a {} with {}", kind, calculated));
    }
    const pugi::xml_node file = node.child("SourceFilename");
    Piece piece;
    piece.path = file.text().get();
    if (piece.path.empty()) fail(ErrorCode::kCorrupt, fmt::format("has a {} without SourceFilename", kind));
    if (piece.path != one_line(piece.path)) {
      fail(ErrorCode::kCorrupt, "names a file with control characters: " + printable(piece.path));
    }
    if (file.attribute("relativeToVRT").as_bool()) {
      piece.path = (std::filesystem::path(info_.path).parent_path() / piece.path).string();
    }
    const std::string band = node.child("SourceBand").text().as_string("1");
    double band_number = 0.0;
    if (!read_decimal(band, band_number) || !(band_number >= 1.0 && band_number < 65536.0)) {
      refuse("takes the band " + printable(band));
    }
    piece.band = static_cast<std::int64_t>(band_number);
    const pugi::xml_node from = node.child("SrcRect");
    const pugi::xml_node to = node.child("DstRect");
    piece.column = whole(to, "xOff", 0.0);
    piece.row = whole(to, "yOff", 0.0);
    piece.columns = whole(to, "xSize", static_cast<double>(info_.width));
    piece.rows = whole(to, "ySize", static_cast<double>(info_.height));
    if (whole(from, "xOff", 0.0) != 0 || whole(from, "yOff", 0.0) != 0) refuse("takes a part of " + piece.path);
    const std::int64_t columns = whole(from, "xSize", static_cast<double>(piece.columns));
    const std::int64_t rows = whole(from, "ySize", static_cast<double>(piece.rows));
    if (columns != piece.columns || rows != piece.rows) {
      refuse(fmt::format("resamples {}: {} x {} samples become {} x {}", piece.path, columns, rows, piece.columns,
                         piece.rows));
    }
    if (kind == "ComplexSource") piece.skipped = element_number(node, "NODATA");
    // A claim, which at worst costs time.
    const pugi::xml_node properties = node.child("SourceProperties");
    piece.type = properties.attribute("DataType").value();
    const double block = number(properties, "BlockYSize", 1.0);
    block_rows_ = std::max(block_rows_,
                           static_cast<std::int64_t>(std::max(1.0, std::min(block, static_cast<double>(piece.rows)))));
    pieces_.push_back(std::move(piece));
  }

  /// Finds what looking for pieces needs.
  void arrange() {
    by_row_.resize(pieces_.size());
    std::iota(by_row_.begin(), by_row_.end(), std::size_t{0});
    std::ranges::stable_sort(by_row_, {}, [&](std::size_t i) { return pieces_[i].row; });
    for (const Piece& piece : pieces_) {
      widest_ = std::max(widest_, piece.columns);
      tallest_ = std::max(tallest_, piece.rows);
    }
    most_open_ = std::clamp<std::size_t>(pieces_.size(), 1, most_open_rasters());
    unpacked_bytes_ /= most_open_;
    limit_buffers(kMostClaimedBytes);
  }

  [[nodiscard]] std::size_t row_bytes() const {
    return static_cast<std::size_t>(info_.width) * size_bytes(info_.sample_type);
  }

  /// Rows that are read at once: whole blocks of the sources where these are not too large for what may be kept.
  [[nodiscard]] std::int64_t strip_rows(std::uint64_t limit) const {
    const auto row = static_cast<std::int64_t>(row_bytes());
    const auto most = static_cast<std::int64_t>(std::min(limit, kMostClaimedBytes / kStripsOfLimit) * kStripsOfLimit);
    const std::int64_t rows = std::clamp<std::int64_t>(std::max(block_rows_, kStripBytes / row), 1, most / row + 1);
    return rows > block_rows_ ? rows - rows % block_rows_ : rows;
  }

  void compose(const Window& window, std::span<std::byte> samples) {
    fill_with(empty_, samples);
    std::vector<Part> parts = parts_in(window);
    for (std::size_t from = 0; from < parts.size();) {
      std::size_t bytes = 0;
      std::size_t end = from;
      for (; end < parts.size() && end - from < most_open_; ++end) {
        parts[end].source = &source_of(*parts[end].piece);
        const std::size_t more = bytes_of(parts[end]);
        if (end > from && bytes + more > kBatchBytes) break;
        bytes += more;
      }
      read(std::span(parts).subspan(from, end - from), bytes);
      for (; from < end; ++from) lay(parts[from], window, samples);
    }
  }

  /// In the order in which they are laid over each other.
  [[nodiscard]] std::vector<Part> parts_in(const Window& window) const {
    std::vector<Part> parts;
    const auto row_of = [&](std::size_t i) { return pieces_[i].row; };
    auto next = std::ranges::lower_bound(by_row_, window.row - tallest_ + 1, {}, row_of);
    for (; next != by_row_.end() && row_of(*next) < window.row + window.rows; ++next) {
      const Piece& piece = pieces_[*next];
      Part part;
      part.piece = &piece;
      part.column = piece.column;
      part.row = piece.row;
      Window& own = part.own;
      if (overlap(part.column, own.column, own.columns, piece.columns, window.column, window.columns) <= 0) continue;
      if (overlap(part.row, own.row, own.rows, piece.rows, window.row, window.rows) <= 0) continue;
      parts.push_back(part);
    }
    std::ranges::sort(parts, {}, &Part::piece);
    return parts;
  }

  [[nodiscard]] static std::size_t bytes_of(const Part& part) {
    return static_cast<std::size_t>(part.own.columns * part.own.rows) * size_bytes(part.source->info().sample_type);
  }

  /// Each from a file of its own, side by side.
  void read(std::span<Part> parts, std::size_t bytes) {
    buffer_.resize(bytes);
    std::size_t begin = 0;
    for (Part& part : parts) {
      part.samples = std::span(buffer_).subspan(begin, bytes_of(part));
      begin += part.samples.size();
    }
    const auto read_one = [&](std::size_t i) { parts[i].source->read_window(parts[i].own, parts[i].samples); };
    // Isolated: a thread that waits here does not start on unrelated work of the caller's.
    oneapi::tbb::this_task_arena::isolate([&] { oneapi::tbb::parallel_for(std::size_t{0}, parts.size(), read_one); });
  }

  /// Whether some samples lie in no source, or only in values that a source leaves out.
  [[nodiscard]] bool has_gaps() const {
    std::vector<SampleRectangle> covered;
    for (const Piece& piece : pieces_) {
      if (!piece.skipped) covered.push_back({piece.column, piece.row, piece.columns, piece.rows});
    }
    std::optional<SampleRectangle> first;
    return uncovered(std::move(covered), {0, 0, info_.width, info_.height}, first) > 0;
  }

  [[nodiscard]] std::unique_ptr<HeightSource> open(const Piece& piece) const {
    OpenOptions options;
    options.unpacked_bytes = unpacked_bytes_;
    if (piece.band > 1) options.channel = fmt::format("{}", piece.band - 1);
    try {
      std::array<std::byte, kHeadBytes> head{};
      const std::size_t there = File(piece.path, File::Mode::kRead).read_at(0, head);
      if (looks_like_vrt(std::span(head).first(there))) {
        throw Error(ErrorCode::kUnsupported,
                    piece.path + ": is a virtual raster itself; gdal_translate makes a GeoTIFF of it");
      }
      std::unique_ptr<HeightSource> source = open_raster(piece.path, options);
      // A band called elevations was chosen, where there is one, and the VRT wants the first.
      const SourceInfo& info = source->info();
      if (piece.band > 1 || info.channel.empty() || band_of_heights({"", info.channel}) == 0) return source;
      if (info.format == "OpenEXR" || info.format.starts_with("netCDF")) return source;  // whose channels have no order
      options.channel = "0";
      return open_raster(piece.path, options);
    } catch (const Error& error) {
      throw error.within(info_.path);
    }
  }

  HeightSource& source_of(const Piece& piece) {
    const auto found = std::ranges::find(opened_, &piece, &Opened::piece);
    if (found != opened_.end()) {
      opened_.splice(opened_.begin(), opened_, found);
      return *opened_.front().source;
    }
    std::unique_ptr<HeightSource> source = open(piece);
    const SourceInfo& info = source->info();
    if (piece.columns != info.width || piece.rows != info.height) {
      refuse(fmt::format("takes {} x {} of the {} x {} samples of {}", piece.columns, piece.rows, info.width,
                         info.height, piece.path));
    }
    source->limit_buffers(limit_);
    if (opened_.size() == most_open_) opened_.pop_back();
    opened_.push_front({&piece, std::move(source)});
    return *opened_.front().source;
  }

  void lay(const Part& part, const Window& window, std::span<std::byte> samples) {
    const Piece& piece = *part.piece;
    const SampleType type = part.source->info().sample_type;
    // What stands for a void in a wider type than the VRT's, as of masks, has no sample in it.
    const std::vector<double>& voids = part.source->info().void_values;
    const bool drops_voids = type != type_;
    const std::size_t size = size_bytes(type);
    const std::size_t out_size = empty_.size();
    const auto out_at = [&](std::int64_t row) {
      return samples.data() + static_cast<std::size_t>((part.row + row) * window.columns + part.column) * out_size;
    };
    const bool as_it_is = type == info_.sample_type && !piece.skipped;
    // A value of its type, which is written with as few as 15 digits.
    const auto skips = piece.skipped ? void_value_as_stored(type, *piece.skipped) : std::nullopt;
    const double skipped = skips.value_or(0.0);
    const double digits = type == SampleType::kFloat64 ? 5e-15 * std::abs(skipped) : 0.0;
    const auto store = store_sample(info_.sample_type);
    const bool to_whole = !is_floating(type_);
    with_stored_type(type, [&](auto kind) {
      using Stored = decltype(kind);
      for (std::int64_t row = 0; row < part.own.rows; ++row) {
        const std::byte* in = part.samples.data() + static_cast<std::size_t>(row * part.own.columns) * size;
        std::byte* out = out_at(row);
        if (as_it_is) {
          std::memcpy(out, in, static_cast<std::size_t>(part.own.columns) * size);
          continue;
        }
        for (std::int64_t column = 0; column < part.own.columns; ++column, in += size, out += out_size) {
          const double value = static_cast<double>(number_of(stored_at<Stored>(in)));
          if (skips && (std::abs(value - skipped) <= digits || (std::isnan(value) && std::isnan(skipped)))) continue;
          if (drops_voids && std::ranges::find(voids, value) != voids.end()) {
            if (!info_.void_values.empty()) continue;
            if (nearest_sample(type_, value) != value) {
              fail(ErrorCode::kUnsupported, piece.path +
                                                " has samples without an elevation, and the VRT no "
                                                "NoDataValue for them (gdalbuildvrt -vrtnodata)");
            }
          }
          if (type != type_ && (std::isnan(value) ? to_whole : nearest_sample(type_, value) != value)) {
            refuse(fmt::format("has samples of {}, one of {} is {}", to_string(type_), piece.path, value));
          }
          store(value, out);
        }
      }
    });
  }

  std::uint64_t unpacked_bytes_;
  std::uint64_t limit_ = 0;       ///< of the buffers of one source
  SampleType type_{};             ///< as the VRT has it; that of `info_` may be wider, for a void
  std::vector<std::byte> empty_;  ///< what stands where no piece is
  std::vector<Piece> pieces_;     ///< later ones lie above
  std::vector<std::size_t> by_row_;
  std::int64_t widest_ = 0;  ///< of the pieces
  std::int64_t tallest_ = 0;
  std::int64_t block_rows_ = 1;  ///< most that one of the sources says it has
  std::size_t most_open_ = 1;
  std::list<Opened> opened_;  ///< those last used first
  std::vector<std::byte> buffer_;
  StripReader strips_{info_, [this](const Window& window, std::span<std::byte> samples) { compose(window, samples); }};
};

}  // namespace

bool looks_like_vrt(std::span<const std::byte> head) {
  return text_of(head).find("<VRTDataset") != std::string_view::npos;
}

std::unique_ptr<HeightSource> open_vrt(const std::string& path, const OpenOptions& options) {
  return std::make_unique<VrtSource>(path, options);
}

}  // namespace isohf
