#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace isohf {

/// The name without the ending of one packed file: "a.tif" of a.tif.gz, "a.tar" of a.tgz; any other name as it is.
[[nodiscard]] std::string unpacked_name(const std::string& path);
/// Whether the file is called .zip, .7z or .tar, or is a packed .tar by its name.
[[nodiscard]] bool has_archive_name(const std::string& path);
/// Whether these first bytes of a file are those of gzip, bzip2, xz or Zstandard, and its name says the same.
[[nodiscard]] bool is_compressed(const std::string& path, std::span<const std::byte> head);
/// Whether they are those of a ZIP, 7z or tar archive; up to 512 bytes.
[[nodiscard]] bool looks_like_archive(std::span<const std::byte> head);

/// A path that continues behind a file names a member of that archive: d/a.tif of tiles.zip in "tiles.zip/d/a.tif".
struct MemberPath {
  std::string archive;
  std::string member;
};
/// nullopt: `path` is not of that kind.
[[nodiscard]] std::optional<MemberPath> member_path(const std::string& path);
/// GDAL's names of members as such paths: "tiles.zip/d/a.tif" of "/vsizip/tiles.zip/d/a.tif" and of
/// "/vsizip/{tiles.zip}/d/a.tif", "a.tif.gz" of "/vsigzip/a.tif.gz"; any other name as it is.
[[nodiscard]] std::string without_vsi(const std::string& path);

/// The regular files in a packed file, one after the other, as libarchive reads them: ZIP, 7z and tar, the latter in
/// gzip, bzip2, xz or Zstandard as well, or one file in one of these four. Links, folders and devices are passed over.
///
/// Contents are verified with the checksums that the format has. All files together may unpack to 1100 times the stored
/// bytes, which deflate never exceeds, or to 1 GiB. Every function throws Error naming the path: kCorrupt for what is
/// damaged or cut off, kUnsupported for what is encrypted, unpacks to more, or is not readable, kIo, kOutOfMemory.
class PackedFiles {
 public:
  explicit PackedFiles(const std::string& path);
  ~PackedFiles();
  PackedFiles(const PackedFiles&) = delete;
  PackedFiles& operator=(const PackedFiles&) = delete;

  /// Goes on to the next file; false behind the last one.
  [[nodiscard]] bool next();
  /// Whether the packed file is no archive but one file, whose name is unpacked_name().
  [[nodiscard]] bool is_one_file() const;
  /// Of the file: "d/a.tif", fit for one line.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// As the archive states; 0 where it does not.
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  /// Hands out the file's contents, in order; what lies between two blocks is zero.
  void read(const std::function<void(std::uint64_t offset_bytes, std::span<const std::byte> block)>& take);

 private:
  struct Library;
  [[noreturn]] void fail();
  void require_modest(std::uint64_t bytes) const;

  std::string path_;
  std::unique_ptr<Library> library_;
  std::string name_;
  std::uint64_t size_bytes_ = 0;
  std::uint64_t most_bytes_ = 0;  ///< that all files together may have
  std::uint64_t bytes_so_far_ = 0;
};

}  // namespace isohf
