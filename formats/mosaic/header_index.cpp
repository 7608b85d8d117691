#include "formats/mosaic/header_index.h"

#include <libdeflate.h>

#include <algorithm>
#include <concepts>
#include <optional>
#include <type_traits>
#include <utility>

#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint64_t kMagic = 0x32524448464f5349;  // "ISOFHDR2"

template <typename T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Writes fields, or reads what it wrote.
class Fields {
 public:
  explicit Fields(std::vector<std::byte>& out) : writer_(out) {}
  explicit Fields(std::span<const std::byte> in) : reader_(in) {}

  template <typename... T>
  void all(T&... values) {
    (one(values), ...);
  }
  [[nodiscard]] std::size_t left() const { return reader_->remaining(); }

 private:
  template <Plain T>
  void one(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      auto byte = static_cast<std::uint8_t>(value ? 1 : 0);
      one(byte);
      value = byte != 0;
    } else if constexpr (std::is_enum_v<T>) {
      auto number = static_cast<std::int32_t>(value);
      one(number);
      value = static_cast<T>(number);
    } else if (writer_) {
      writer_->write(value);
    } else {
      value = reader_->read<T>();
    }
  }
  void one(std::string& text) {
    std::uint64_t size = text.size();
    one(size);
    if (writer_) return writer_->write_bytes(std::as_bytes(std::span<const char>(text)));
    const auto bytes = reader_->read_bytes(size);
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void one(Warning& warning) { all(static_cast<std::string&>(warning), warning.kind); }
  template <typename T>
  void one(std::optional<T>& value) {
    bool is_there = value.has_value();
    one(is_there);
    if (is_there && !value) value.emplace();
    if (is_there) one(*value);
  }
  template <typename T>
  void one(std::vector<T>& values) {
    std::uint64_t size = values.size();
    one(size);
    for (std::uint64_t i = 0; i < size; ++i) {
      if (reader_) values.push_back(empty<T>());
      one(values[i]);
    }
  }
  template <typename T>
  static T empty() {
    if constexpr (std::is_same_v<T, Warning>)
      return Warning("");
    else
      return T{};
  }

  std::optional<ByteWriter> writer_;
  std::optional<ByteReader> reader_;
};

/// All that is read of a file but its path, size, place and what no reader of files sets.
void each_of_kind(Fields& io, SourceInfo& info) {
  Georeference& place = info.georeference;
  ReferenceSystem& system = place.system;
  io.all(info.format, info.sample_type, info.channel, info.void_values, info.valid_min, info.valid_max, info.z_scale,
         info.z_offset, info.vertical_unit, info.metres_per_vertical_unit, info.block_width, info.block_height,
         info.warnings, place.registration, place.unit, place.metres_per_unit, place.spacing_x, place.spacing_y,
         place.has_origin, system.name, system.epsg, system.wkt, system.body, system.semi_major_axis_m,
         system.inverse_flattening, system.vertical_epsg, system.vertical_datum);
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

template <typename Io>
void HeaderIndex::each(Io& io, File& file) {
  io.all(file.path, file.kind, file.width, file.height, file.origin_x, file.origin_y, file.stamp.size_bytes,
         file.stamp.changed_s, file.stamp.changed_ns, file.reader_bytes);
}

HeaderIndex::HeaderIndex(const std::string& bytes, const std::string& key) {
  const auto refuse = [](const char* why) { throw Error(ErrorCode::kCorrupt, why); };
  const std::size_t tail = sizeof(std::uint32_t);
  if (bytes.size() < sizeof kMagic + tail) refuse("is cut short");
  const auto all = std::as_bytes(std::span<const char>(bytes));
  const auto said = all.first(all.size() - tail);
  if (ByteReader(all.last(tail)).read<std::uint32_t>() != libdeflate_crc32(0, said.data(), said.size()))
    refuse("is damaged");
  Fields in(said);
  std::uint64_t magic = 0;
  std::string its_key;
  std::uint64_t kinds = 0;
  in.all(magic, its_key, kinds);
  if (magic != kMagic || its_key != key) refuse("belongs to another plan");
  for (; kinds > 0; --kinds) each_of_kind(in, kinds_.emplace_back());
  while (in.left() > 0) {
    each(in, files_.emplace_back());
    if (files_.back().kind >= kinds_.size()) refuse("is damaged");
  }
}

std::string HeaderIndex::bytes(const std::string& key) const {
  std::vector<std::byte> bytes;
  Fields out(bytes);
  std::uint64_t magic = kMagic;
  std::uint64_t kinds = kinds_.size();
  std::string its_key = key;
  out.all(magic, its_key, kinds);
  for (SourceInfo kind : kinds_) each_of_kind(out, kind);
  for (File file : files_) each(out, file);
  std::uint32_t sum = libdeflate_crc32(0, bytes.data(), bytes.size());
  out.all(sum);
  return text_of(bytes);
}

bool HeaderIndex::is_of(std::span<const std::string> paths) const {
  return std::equal(paths.begin(), paths.end(), files_.begin(), files_.end(),
                    [](const std::string& path, const File& file) { return path == file.path; });
}

HeaderIndex::Header HeaderIndex::header(std::size_t i) const {
  const File& file = files_[i];
  Header found{kinds_[file.kind], file.stamp, file.reader_bytes};
  found.info.width = file.width;
  found.info.height = file.height;
  found.info.georeference.origin_x = file.origin_x;
  found.info.georeference.origin_y = file.origin_y;
  return found;
}

void HeaderIndex::add(const std::string& path, const Header& header) {
  SourceInfo kind = header.info;
  const std::string prefix = path + ": ";
  for (Warning& warning : kind.warnings) {
    if (warning.starts_with(prefix)) warning = warning.reworded(warning.substr(prefix.size()));
  }
  std::vector<std::byte> bytes;
  Fields out(bytes);
  each_of_kind(out, kind);
  std::string text = text_of(bytes);
  const auto found = std::find(kind_bytes_.begin(), kind_bytes_.end(), text);
  File file{path,
            static_cast<std::uint32_t>(found - kind_bytes_.begin()),
            header.info.width,
            header.info.height,
            header.info.georeference.origin_x,
            header.info.georeference.origin_y,
            header.stamp,
            header.reader_bytes};
  file.stamp.device = file.stamp.inode = 0;
  if (found == kind_bytes_.end()) {
    kinds_.push_back(std::move(kind));
    kind_bytes_.push_back(std::move(text));
  }
  files_.push_back(std::move(file));
}

}  // namespace isohf
