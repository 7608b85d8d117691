#include "formats/io/packed_files.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/core.h>
#include <locale.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <filesystem>
#include <string_view>
#include <vector>

#include "formats/io/raw_file.h"
#include "isohf/base/file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

constexpr std::size_t kBlockBytes = std::size_t{1} << 18U;
/// What packed files may unpack to at least, and how many times their own size.
constexpr std::uint64_t kLeastMost = std::uint64_t{1} << 30U;
constexpr std::uint64_t kMostRatio = 1100;

struct Compression {
  std::string_view ending;
  std::string_view inside;  ///< the ending of what is inside
  std::string_view begins;
};

constexpr Compression kCompressions[] = {
    {".gz", "", "\x1f\x8b\x08"sv},      {".bz2", "", "BZh"sv},
    {".xz", "", "\xfd\x37zXZ"sv},       {".zst", "", "\x28\xb5\x2f\xfd"sv},
    {".tgz", ".tar", "\x1f\x8b\x08"sv}, {".tbz2", ".tar", "BZh"sv},
    {".txz", ".tar", "\xfd\x37zXZ"sv},  {".tzst", ".tar", "\x28\xb5\x2f\xfd"sv},
};

const Compression* compression_of(const std::string& path) {
  const std::string name = lower_case(path);
  for (const Compression& each : kCompressions) {
    if (name.size() > each.ending.size() && name.ends_with(each.ending)) return &each;
  }
  return nullptr;
}

/// Names of members are read as UTF-8, whatever the process's locale is.
struct Utf8Locale {
  ::locale_t own = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  ::locale_t before = ::uselocale(own);  // which changes nothing for nullptr

  ~Utf8Locale() {
    ::uselocale(before);
    if (own != nullptr) ::freelocale(own);
  }
};

/// What is in a gzip file, all its members: libarchive does not verify their checksums, and stops at a damaged one.
class GzipStream {
 public:
  explicit GzipStream(const std::string& path)
      : file_(path, File::Mode::kRead), stored_(kBlockBytes), contents_(kBlockBytes) {
    constexpr int kGzip = 16;
    if (inflateInit2(&stream_, kGzip + MAX_WBITS) != Z_OK)
      throw Error(ErrorCode::kOutOfMemory, path + ": no memory to inflate it");
  }
  ~GzipStream() { inflateEnd(&stream_); }
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// Empty at the end.
  [[nodiscard]] std::span<const std::byte> next() {
    stream_.next_out = reinterpret_cast<Bytef*>(contents_.data());
    stream_.avail_out = static_cast<uInt>(contents_.size());
    while (stream_.avail_out != 0 && !ended_) {
      if (!has_stored()) fail("ends early");
      const int result = inflate(&stream_, Z_NO_FLUSH);
      if (result == Z_STREAM_END) {
        // Another member may follow; zero bytes are padding.
        while (has_stored() && *stream_.next_in == 0) skip_byte();
        ended_ = !has_stored();
        inflateReset(&stream_);
      } else if (result != Z_OK && result != Z_BUF_ERROR) {
        fail(stream_.msg != nullptr ? stream_.msg : "no valid data");
      }
    }
    return std::span(contents_).first(contents_.size() - stream_.avail_out);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: gzip data: {} at byte {}", file_.path(), why, read_bytes_ - stream_.avail_in));
  }
  bool has_stored() {
    if (stream_.avail_in != 0) return true;
    const std::size_t got = file_.read_at(read_bytes_, stored_);
    read_bytes_ += got;
    stream_.next_in = reinterpret_cast<Bytef*>(stored_.data());
    stream_.avail_in = static_cast<uInt>(got);
    return got != 0;
  }
  void skip_byte() {
    ++stream_.next_in;
    --stream_.avail_in;
  }

  File file_;
  std::uint64_t read_bytes_ = 0;
  std::vector<std::byte> stored_;
  std::vector<std::byte> contents_;
  z_stream stream_ = {};
  bool ended_ = false;
};

}  // namespace

std::string unpacked_name(const std::string& path) {
  const Compression* const found = compression_of(path);
  return found == nullptr ? path : path.substr(0, path.size() - found->ending.size()).append(found->inside);
}

bool has_archive_name(const std::string& path) {
  const std::string name = lower_case(unpacked_name(path));
  return name.ends_with(".tar") || lower_case(path).ends_with(".zip") || lower_case(path).ends_with(".7z");
}

bool is_compressed(const std::string& path, std::span<const std::byte> head) {
  const Compression* const found = compression_of(path);
  return found != nullptr && text_of(head).starts_with(found->begins);
}

bool looks_like_archive(std::span<const std::byte> head) {
  constexpr std::size_t kTarAt = 257;
  const std::string_view text = text_of(head);
  return text.starts_with("PK\3\4") || text.starts_with("PK\5\6") ||  // the latter: an empty one
         text.starts_with("7z\xBC\xAF\x27\x1C") || (text.size() > kTarAt && text.substr(kTarAt).starts_with("ustar"));
}

std::optional<MemberPath> member_path(const std::string& path) {
  if (std::error_code none; fs::exists(path, none)) return std::nullopt;
  for (fs::path file = fs::path(path).parent_path(); file.has_relative_path(); file = file.parent_path()) {
    if (!is_file(file)) continue;
    const std::string archive = file.string();
    return MemberPath{archive, path.substr(std::min(path.find_first_not_of('/', archive.size()), path.size()))};
  }
  return std::nullopt;
}

std::string without_vsi(const std::string& path) {
  for (const std::string_view prefix : {"/vsizip/", "/vsitar/", "/vsigzip/", "/vsi7z/"}) {
    if (!path.starts_with(prefix)) continue;
    std::string name = path.substr(prefix.size());
    const std::size_t end = name.find('}');
    if (name.starts_with('{') && end != std::string::npos) name.erase(end, 1).erase(0, 1);
    return name;
  }
  return path;
}

struct PackedFiles::Library {
  archive* reader = archive_read_new();
  archive_entry* entry = nullptr;
  std::unique_ptr<GzipStream> gzip;
  std::exception_ptr failure;  ///< of `gzip`
  Utf8Locale locale;

  ~Library() { archive_read_free(reader); }

  static la_ssize_t read_gzip(archive* /*reader*/, void* self, const void** block) {
    auto& library = *static_cast<Library*>(self);
    try {
      const std::span<const std::byte> contents = library.gzip->next();
      *block = contents.data();
      return static_cast<la_ssize_t>(contents.size());
    } catch (...) {
      library.failure = std::current_exception();
      return ARCHIVE_FATAL;
    }
  }
};

PackedFiles::PackedFiles(const std::string& path) : path_(path), library_(std::make_unique<Library>()) {
  const RawFile file(path);
  if (file.size_bytes() == 0) throw Error(ErrorCode::kCorrupt, path + ": is empty (0 bytes)");
  most_bytes_ = std::max(kLeastMost, kMostRatio * std::min(file.size_bytes(), UINT64_MAX / kMostRatio));
  std::array<std::byte, 4> head{};
  (void)file.read_some(0, head);
  const bool is_gzip = text_of(head).starts_with("\x1f\x8b");
  archive* const reader = library_->reader;
  // The formats that rasters come in; others would be so much more code for hostile files.
  archive_read_support_filter_bzip2(reader);
  archive_read_support_filter_xz(reader);
  archive_read_support_filter_zstd(reader);
  archive_read_support_format_7zip(reader);
  archive_read_support_format_empty(reader);
  archive_read_support_format_tar(reader);
  archive_read_support_format_zip_seekable(reader);
  if (text_of(head) == "PK\5\6") archive_read_support_format_zip_streamable(reader);  // an empty one
  if (unpacked_name(path) != path) archive_read_support_format_raw(reader);
  // To the packed file's end, with the checksums there.
  archive_read_set_format_option(reader, "tar", "read_concatenated_archives", "1");
  int result = ARCHIVE_OK;
  if (is_gzip) {
    library_->gzip = std::make_unique<GzipStream>(path);
    result = archive_read_open2(reader, library_.get(), nullptr, Library::read_gzip, nullptr, nullptr);
  } else {
    result = archive_read_open_filename(reader, path.c_str(), kBlockBytes);
  }
  if (result != ARCHIVE_OK) fail();
}

PackedFiles::~PackedFiles() = default;

void PackedFiles::fail() {
  if (library_->failure) std::rethrow_exception(library_->failure);
  archive* const reader = library_->reader;
  // Until a format is found, libarchive 3.6 crashes over that question.
  if (archive_format(reader) != 0 && archive_read_has_encrypted_entries(reader) > 0) {
    throw Error(ErrorCode::kUnsupported, path_ + ": is encrypted; unpack it with its password first");
  }
  const char* const text = archive_error_string(reader);
  const std::string why = text != nullptr ? one_line(text) : "no reason given";
  const int number = archive_errno(reader);
  const bool is_understood = why.find("nsupported") == std::string::npos;
  const ErrorCode code = number == ENOMEM ? ErrorCode::kOutOfMemory
                         : number == EIO  ? ErrorCode::kIo
                         : is_understood  ? ErrorCode::kCorrupt
                                          : ErrorCode::kUnsupported;
  const char* const what = code == ErrorCode::kCorrupt ? "is damaged or cut off" : "cannot be unpacked";
  throw Error(code, fmt::format("{}: {}: {}", path_, what, why));
}

void PackedFiles::require_modest(std::uint64_t bytes) const {
  if (bytes <= most_bytes_) return;
  throw Error(ErrorCode::kUnsupported,
              fmt::format("{}: unpacks to more than {} bytes, which is no raster's ratio; unpack it first", path_,
                          most_bytes_));
}

bool PackedFiles::next() {
  for (;;) {
    const int result = archive_read_next_header(library_->reader, &library_->entry);
    if (result == ARCHIVE_EOF) return false;
    if (result != ARCHIVE_OK && result != ARCHIVE_WARN) fail();
    archive_entry* const entry = library_->entry;
    const la_int64_t size = archive_entry_size_is_set(entry) != 0 ? archive_entry_size(entry) : 0;
    size_bytes_ = static_cast<std::uint64_t>(std::max<la_int64_t>(size, 0));
    require_modest(bytes_so_far_ += std::min(size_bytes_, UINT64_MAX - bytes_so_far_));
    const char* const name = archive_entry_pathname(entry);
    if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry) != nullptr || name == nullptr)
      continue;
    if (is_one_file() && library_->gzip == nullptr && archive_filter_code(library_->reader, 0) == ARCHIVE_FILTER_NONE)
      throw Error(ErrorCode::kCorrupt, path_ + ": is cut off, or not packed as its name says");
    name_ = is_one_file() ? fs::path(unpacked_name(path_)).filename().string() : one_line(name);
    while (name_.starts_with("./")) name_.erase(0, 2);
    return true;
  }
}

bool PackedFiles::is_one_file() const {
  return archive_format(library_->reader) == ARCHIVE_FORMAT_RAW;
}

void PackedFiles::read(const std::function<void(std::uint64_t offset_bytes, std::span<const std::byte> block)>& take) {
  if (archive_entry_is_encrypted(library_->entry) != 0) fail();
  for (;;) {
    const void* block = nullptr;
    std::size_t bytes = 0;
    la_int64_t offset = 0;
    const int result = archive_read_data_block(library_->reader, &block, &bytes, &offset);
    if (result == ARCHIVE_EOF) return;
    if (result != ARCHIVE_OK || offset < 0) fail();
    require_modest(static_cast<std::uint64_t>(offset) + bytes);
    take(static_cast<std::uint64_t>(offset), {static_cast<const std::byte*>(block), bytes});
  }
}

}  // namespace isohf
