#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/io/inflated_bytes.h"
#include "isohf/base/file.h"
#include "isohf/base/zip.h"

namespace isohf {

/// Whether a regular file is there; what cannot be looked at is none.
[[nodiscard]] bool is_file(const std::filesystem::path& path);
/// Whether the name ends in .gz or .tgz, in any case.
[[nodiscard]] bool is_gzip_name(const std::string& path);
/// The name without a .gz at its end, and with .tar for .tgz.
[[nodiscard]] std::string without_gzip(const std::string& path);

/// A regular file open for reading at any offset, by several threads at once. Closes itself.
///
/// Of a file that is called .gz and is gzip, all members speak of what is inside. Opening unpacks it once and checks
/// it; up to a size it is held from then on, beyond it is inflated again piece by piece, for which backwards costs more
/// than forwards (inflated_bytes.h).
class RawFile {
 public:
  /// No more than this is held in memory of what a file has inside; while it is unpacked, the packed bytes as well.
  static constexpr std::uint64_t kMostHeldBytes = std::uint64_t{64} << 20U;

  /// held_bytes  most to be held, up to kMostHeldBytes
  /// Throws Error{kIo} naming the path: missing, unreadable, not a regular file; Error{kCorrupt}: damaged gzip data.
  explicit RawFile(const std::string& path, std::uint64_t held_bytes = kMostHeldBytes);
  /// The contents of one member of a zip archive: stored or deflated, checked against size and CRC.
  /// Throws also Error{kUnsupported}: encrypted, or packed by another method.
  RawFile(const std::string& path, const ZipEntry& member, std::uint64_t held_bytes = kMostHeldBytes);
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  /// Of the file as it is stored.
  [[nodiscard]] int descriptor() const { return file_.descriptor(); }

  /// Reads up to bytes.size() bytes at `offset_bytes`; returns how many there were before the end of the file.
  /// Throws Error{kIo}.
  std::size_t read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

  /// Fills `bytes`. Throws Error{kIo}, and Error{kCorrupt} where the file ends early.
  void read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

  /// As HeightSource's: contents that are more than `limit`, or modest ones where it leaves no room for such, are no
  /// longer held but inflated piece by piece. No other thread reads meanwhile.
  void limit_buffers(std::uint64_t limit);
  /// 0 where nothing is packed.
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const;

 private:
  /// Where packed contents lie in the file.
  struct Packed {
    std::uint64_t begin_bytes = 0;
    std::uint64_t stored_bytes = 0;
    InflatedBytes::Kind kind = InflatedBytes::Kind::kGzip;
  };

  [[nodiscard]] std::vector<std::byte> stored_bytes() const;
  [[nodiscard]] InflatedBytes::ReadStored packed_reader() const;
  void unpack_gzip(std::uint64_t held_bytes);
  void unpack_member(const ZipEntry& member, std::uint64_t held_bytes);

  std::string path_;
  File file_;
  std::uint64_t begin_bytes_ = 0;  // of a stored zip member
  std::uint64_t size_bytes_ = 0;
  Packed packed_;
  std::optional<UnpackedBytes> held_;
  std::unique_ptr<InflatedBytes> inflated_;
  mutable std::mutex one_inflates_;
};

/// Turns the byte order of every sample of `sample_bytes` (1, 2, 4 or 8) in place.
void swap_byte_order(std::span<std::byte> samples, std::size_t sample_bytes);

/// The directory of a zip archive, names fit for one line. Throws Error{kCorrupt, kIo} naming the file.
[[nodiscard]] std::vector<ZipEntry> zipped_files(const RawFile& file);

/// Where the stored bytes of `member` begin in the file. Throws Error: kUnsupported for encrypted members and for
/// methods other than stored and deflated; kCorrupt.
[[nodiscard]] std::uint64_t zipped_file_begin(const RawFile& file, const ZipEntry& member);

}  // namespace isohf
