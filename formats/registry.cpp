#include "formats/registry.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>

#include "formats/files/raw_file.h"
#include "formats/files/text.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// One native reader: how its files begin, and how one is opened.
struct Reader {
  Format format;
  bool (*recognises)(std::span<const std::byte> head);  ///< nullptr: the extension decides
  std::unique_ptr<HeightSource> (*open)(const std::string& path, const OpenOptions& options);
  /// Whether `path` is one by what stands inside or beside it, whatever its name; nullptr: that is not looked for.
  bool (*described)(const std::string& path) = nullptr;
  bool in_gzip = false;  ///< reads what is inside a .gz
};

const std::vector<Reader>& readers() {
  static const std::vector<Reader> table = {
      {{"OpenEXR", {".exr"}, exr_library, "takes `channel` and `part`"}, looks_like_exr, open_exr},
      {{"TIFF", {".tif", ".tiff"}, tiff_library, "takes `channel`"}, looks_like_tiff, open_tiff},
      {{"PNG", {".png"}, png_library, "takes `channel` and `encoding`"}, looks_like_png, open_png},
      {{"ESRI ASCII grid, GRASS ASCII", {".asc"}}, looks_like_ascii_grid, open_ascii_grid, nullptr, true},
      {{"GridFloat or EHdr header", {".hdr"}}, looks_like_grid_header, open_header_grid},
      {{"GridFloat", {".flt"}}, nullptr, open_header_grid},
      {{"EHdr", {".bil", ".bip", ".bsq"}}, nullptr, open_header_grid},
      {{"PDS3", {".img", ".lbl"}, nullptr, "takes `channel`"}, looks_like_pds3, open_pds3, has_pds3_label, true},
      {{"ISIS3 cube", {".cub", ".lbl"}, nullptr, "takes `channel`"}, looks_like_isis3, open_isis3, nullptr, true},
      {{"NumPy", {".npy"}}, looks_like_npy, open_npy, nullptr, true},
      {{"NumPy archive", {".npz"}, nullptr, "takes `channel`"}, nullptr, open_npz},
      {{"USGS DEM", {".dem"}}, looks_like_usgs_dem, open_usgs_dem, nullptr, true},
      {{"GTOPO30", {".dem"}}, nullptr, open_header_grid},
      {{"DTED", {".dt0", ".dt1", ".dt2"}}, looks_like_dted, open_dted, nullptr, true},
      {{"Surfer grid", {".grd"}}, looks_like_surfer_grid, open_surfer_grid, nullptr, true},
      {{"SRTM HGT", {".hgt", ".hgt.zip"}}, nullptr, open_hgt, is_zip_of_hgt, true},
      {{"raw samples",
        {".r8", ".r16", ".r32", ".f32", ".f64", ".raw"},
        nullptr,
        "needs `raw`, or isohf's .json beside"},
       nullptr,
       open_raw,
       nullptr,
       true},
  };
  return table;
}

/// Enough for every signature.
constexpr std::size_t kHeadBytes = 256;
/// Of a gzip file, to inflate so many from.
constexpr std::size_t kStoredHeadBytes = 4096;

struct Head {
  std::array<std::byte, kHeadBytes> bytes{};
  std::size_t size = 0;
  bool in_gzip = false;  ///< the bytes are those inside
};

/// The file's first bytes; refuses whatever is not a readable regular file with something in it.
Head read_head(const std::string& path) {
  const auto refuse = [&](ErrorCode code, const std::string& why) { throw Error(code, {path, why, "", ""}); };
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    refuse(ErrorCode::kIo, errno == ENOENT ? "no such file" : std::strerror(errno));
  }
  if (S_ISDIR(status.st_mode)) refuse(ErrorCode::kIo, "is a folder; a raster file is wanted");
  if (!S_ISREG(status.st_mode)) refuse(ErrorCode::kIo, "is not a regular file; a raster must be seekable");
  if (status.st_size == 0) refuse(ErrorCode::kCorrupt, "is empty (0 bytes)");
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) refuse(ErrorCode::kIo, fmt::format("cannot be opened: {}", std::strerror(errno)));
  Head head;
  std::array<std::byte, kStoredHeadBytes> stored{};
  const ssize_t got = ::pread(file, stored.data(), stored.size(), 0);
  const int error = errno;
  ::close(file);
  if (got < 0) refuse(ErrorCode::kIo, fmt::format("cannot be read: {}", std::strerror(error)));
  const auto there = std::span(stored).first(static_cast<std::size_t>(got));
  head.in_gzip = is_gzip_name(path) && looks_like_gzip(there);
  if (head.in_gzip) {
    head.size = inflate_head(there, head.bytes);
  } else {
    head.size = std::min(there.size(), head.bytes.size());
    std::copy_n(there.begin(), head.size, head.bytes.begin());
  }
  return head;
}

bool has_extension(const std::string& path, const Format& format) {
  const std::string name = lower_case(without_gzip(path));
  return std::any_of(format.extensions.begin(), format.extensions.end(), [&](const std::string& extension) {
    return name.size() > extension.size() && name.ends_with(extension);
  });
}

const Reader* reader_of(const std::string& path, std::span<const std::byte> head) {
  for (const Reader& reader : readers()) {
    if (reader.recognises != nullptr ? reader.recognises(head) : has_extension(path, reader.format)) return &reader;
  }
  for (const Reader& reader : readers()) {
    if (reader.described != nullptr && reader.described(path)) return &reader;
  }
  return nullptr;
}

const Format& raw_format() {
  const auto raw =
      std::find_if(readers().begin(), readers().end(), [](const Reader& reader) { return reader.open == open_raw; });
  return raw->format;
}

}  // namespace

const std::vector<Format>& native_formats() {
  static const std::vector<Format> formats = [] {
    std::vector<Format> list;
    for (const Reader& reader : readers()) list.push_back(reader.format);
    return list;
  }();
  return formats;
}

const Format* native_format_of(const std::string& path, const OpenOptions& options) {
  const Head head = read_head(path);
  if (options.raw) return &raw_format();
  const Reader* reader = reader_of(path, std::span(head.bytes).first(head.size));
  return reader != nullptr ? &reader->format : nullptr;
}

const Format* format_of_head(std::span<const std::byte> head) {
  for (const Reader& reader : readers()) {
    if (reader.recognises != nullptr && reader.recognises(head)) return &reader.format;
  }
  return nullptr;
}

std::string library_of(const Format& format) {
  return format.library != nullptr ? format.library() : "isohf";
}

namespace {

std::unique_ptr<HeightSource> open_by_head(const std::string& path, const OpenOptions& options) {
  const Head head = read_head(path);
  if (options.raw) return open_raw(path, options);
  const Reader* reader = reader_of(path, std::span(head.bytes).first(head.size));
  if (head.in_gzip && (reader == nullptr || !reader->in_gzip)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: is {} in gzip, which isohf does not read; gunzip it first", path,
                            reader == nullptr ? "something unknown" : reader->format.name));
  }
  if (reader == nullptr) return open_with_oiio(path, options);
  if (!options.part.empty() && reader->open != open_exr) {
    throw Error(ErrorCode::kInvalidArgument, path + ": has no parts; `part` is for OpenEXR files of several");
  }
  return reader->open(path, options);
}

}  // namespace

std::unique_ptr<HeightSource> open_raster(const std::string& path, const OpenOptions& options) {
  try {
    return open_by_head(path, options);
  } catch (const Error& error) {
    throw error.at(path);  // which every reader's message names
  }
}

}  // namespace isohf
