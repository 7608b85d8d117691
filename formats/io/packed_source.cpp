/// Rasters in ZIP and tar archives, and in .gz where their reader needs a file: they are unpacked into a folder that goes
/// when they are closed.

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "formats/mosaic/mosaic_source.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/base/file.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTarBlock = 512;
/// More is no archive of rasters, but damage.
constexpr std::size_t kMostMembers = 100000;
/// Files that belong to one raster.
constexpr std::size_t kMostBeside = 64;

/// A file in an archive.
struct Member {
  std::string name;
  std::uint64_t bytes = 0;
  std::uint64_t begin = 0;           ///< of a tar
  bool is_sparse = false;            ///< of a tar: its bytes are not those of the file
  std::optional<ZipEntry> zip = {};  ///< of a ZIP

  [[nodiscard]] std::string file_name() const { return fs::path(name).filename().string(); }
  [[nodiscard]] fs::path folder() const { return fs::path(name).parent_path(); }
};

std::vector<Member> members_of_zip(const RawFile& file) {
  std::vector<Member> members;
  for (ZipEntry& entry : zipped_files(file)) {
    Member member{entry.name, entry.bytes};
    member.zip = std::move(entry);
    members.push_back(std::move(member));
  }
  return members;
}

/// A tar archive, member by member: POSIX.1-2001 (ustar and pax), and GNU's long names and sizes.
class TarReader {
 public:
  explicit TarReader(const RawFile& file) : file_(file) {}

  [[nodiscard]] std::vector<Member> members() {
    while (file_.read_some(at_, block_) == block_.size()) {
      if (std::ranges::all_of(block_, [](std::byte byte) { return byte == std::byte{0}; })) return std::move(members_);
      read_member();
      if (members_.size() > kMostMembers) fail(ErrorCode::kUnsupported, "holds more files than an archive of rasters");
    }
    fail(ErrorCode::kCorrupt, "the tar ends early");
  }

 private:
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const {
    throw Error(code, fmt::format("{}: {}, at byte {}", file_.path(), what, at_));
  }
  [[nodiscard]] std::string_view field(std::size_t at, std::size_t length) const {
    const std::string_view text = text_of(block_).substr(at, length);
    return text.substr(0, std::min(text.find('\0'), length));
  }

  /// Octal digits, or, behind a first byte of 0x80, the number itself.
  [[nodiscard]] std::uint64_t number(std::size_t at, std::size_t length) const {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 56U;
    std::uint64_t value = 0;
    if (block_[at] == std::byte{0x80}) {
      for (std::size_t i = 1; i < length && value < kMost; ++i)
        value = value << 8U | std::to_integer<unsigned>(block_[at + i]);
      return value;
    }
    const std::string digits = trimmed(field(at, length));
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 8);
    if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size() || value > kMost) {
      fail(ErrorCode::kCorrupt, "the tar is damaged");
    }
    return value;
  }

  void check_sum() const {
    constexpr std::size_t kSumAt = 148;
    constexpr std::size_t kSumBytes = 8;
    std::uint64_t sum = kSumBytes * ' ';
    for (std::size_t i = 0; i < block_.size(); ++i) {
      if (i < kSumAt || i >= kSumAt + kSumBytes) sum += std::to_integer<unsigned>(block_[i]);
    }
    if (sum != number(kSumAt, kSumBytes)) fail(ErrorCode::kCorrupt, "the tar is damaged");
  }

  /// Records of a pax header, "27 path=a name of any length\n".
  void read_pax(std::string_view text) {
    while (!text.empty()) {
      std::size_t length = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
      const auto blank = static_cast<std::size_t>(end - text.data());
      if (error != std::errc{} || length <= blank + 1 || length > text.size())
        fail(ErrorCode::kCorrupt, "the tar is damaged");
      const std::string_view record = text.substr(blank + 1, length - blank - 2);
      const std::string_view key = record.substr(0, record.find('='));
      const std::string_view value = record.substr(std::min(key.size() + 1, record.size()));
      if (key == "path") next_.name = value;
      if (key.starts_with("GNU.sparse.")) next_.is_sparse = true;
      if (key == "size") {
        next_bytes_.emplace(0);
        std::from_chars(value.data(), value.data() + value.size(), *next_bytes_);
      }
      text.remove_prefix(length);
    }
  }

  void read_member() {
    check_sum();
    const char type = static_cast<char>(block_[156]);
    const bool is_of_next = type == 'x' || type == 'g' || type == 'L' || type == 'K';
    const std::uint64_t bytes = is_of_next ? number(124, 12) : next_bytes_.value_or(number(124, 12));
    const std::uint64_t begin = at_ + kTarBlock;
    if (begin > file_.size_bytes() || bytes > file_.size_bytes() - begin)
      fail(ErrorCode::kCorrupt, "the tar ends early");
    if (type == 'x' || type == 'L') {
      constexpr std::uint64_t kMostText = std::uint64_t{1} << 20U;
      if (bytes > kMostText) fail(ErrorCode::kCorrupt, "the tar is damaged");
      std::string text(static_cast<std::size_t>(bytes), '\0');
      file_.read(begin, std::as_writable_bytes(std::span(text)));
      type == 'x' ? read_pax(text) : static_cast<void>(next_.name = text.substr(0, text.find('\0')));
    } else if (!is_of_next) {
      if (next_.name.empty()) {
        const bool is_posix = text_of(block_).substr(257, 6) == std::string_view("ustar\0", 6);
        const std::string prefix(is_posix ? field(345, 155) : std::string_view());
        next_.name = (prefix.empty() ? "" : prefix + '/') + std::string(field(0, 100));
      }
      next_.bytes = bytes;
      next_.begin = begin;
      next_.is_sparse = next_.is_sparse || type == 'S';
      if (type == '0' || type == '\0' || type == '7' || type == 'S') members_.push_back(next_);
      next_ = {};
      next_bytes_.reset();
    }
    at_ = begin + (bytes + kTarBlock - 1) / kTarBlock * kTarBlock;
  }

  const RawFile& file_;
  std::uint64_t at_ = 0;
  std::array<std::byte, kTarBlock> block_{};
  Member next_;  ///< what was said of the member that follows
  std::optional<std::uint64_t> next_bytes_;
  std::vector<Member> members_;
};

/// By its name; headers, labels, archives and what names other files are none.
/// nullopt: is neither ZIP nor tar.
std::optional<std::vector<Member>> members_of(const RawFile& file) {
  std::array<std::byte, kTarBlock> head{};
  const auto there = std::span(head).first(file.read_some(0, head));
  if (looks_like_tar(there)) return TarReader(file).members();
  if (text_of(there).starts_with("PK")) return members_of_zip(file);
  return std::nullopt;
}

bool is_raster(const Member& member) {
  const std::string name = lower_case(member.file_name());
  if (name.empty() || name.front() == '.') return false;
  for (const char* other : {".hdr", ".lbl", ".lblx", ".vrt", ".zip", ".tar", ".tgz"}) {
    if (name.ends_with(other)) return false;
  }
  return std::ranges::any_of(native_formats(), [&](const Format& format) {
    return std::ranges::any_of(format.extensions,
                               [&](const std::string& extension) { return name.ends_with(extension); });
  });
}

bool ends_in(const Member* member, const char* extension) {
  return lower_case(member->name).ends_with(extension);
}

/// What is read of an archive, by name: `part`, or all that are rasters, pictures only where there is nothing else.
std::vector<const Member*> rasters_in(const std::vector<Member>& members, const std::string& part) {
  std::vector<const Member*> found;
  for (const Member& member : members) {
    if (part.empty() ? is_raster(member) : member.name == part || member.file_name() == part) found.push_back(&member);
  }
  const auto is_picture = [](const Member* member) { return ends_in(member, ".png"); };
  if (!std::ranges::all_of(found, is_picture)) std::erase_if(found, is_picture);
  std::ranges::sort(found, {}, &Member::name);
  return found;
}

/// "a.tif, b.tif, ...", no longer than a line.
std::string list_of_names(const std::vector<const Member*>& members) {
  constexpr std::size_t kLongest = 200;
  std::string list;
  for (const Member* member : members) {
    if (list.size() > kLongest) return list + ", ...";
    list += (list.empty() ? "" : ", ") + printable(member->name);
  }
  return list.empty() ? "no files" : list;
}

/// A folder's lock, which goes with the process that holds it, however that ends.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)),
        held_(descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {}
  ~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  [[nodiscard]] bool held() const { return held_; }

 private:
  int descriptor_;
  bool held_;
};

constexpr std::string_view kScratchName = "isohf-unpacked-";
/// By then a folder that was made is locked.
constexpr std::chrono::minutes kUntilLocked{1};

/// Removes folders of runs that were killed.
void remove_abandoned(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.path().filename().string().starts_with(kScratchName)) continue;
    std::error_code ignored;
    const auto changed = entry.last_write_time(ignored);
    if (ignored || fs::file_time_type::clock::now() - changed < kUntilLocked) continue;
    if (const FolderLock lock(entry.path()); lock.held()) fs::remove_all(entry.path(), ignored);
  }
}

/// A folder that goes with all that is in it. Its files have names that readers go by: where this process is killed, the
/// next one that unpacks removes them.
class Scratch {
 public:
  explicit Scratch(const std::string& archive) {
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    if (!error) remove_abandoned(folder);
    std::string name = (folder / kScratchName).string() + "XXXXXX";
    if (error || ::mkdtemp(name.data()) == nullptr) {
      throw Error(ErrorCode::kIo,
                  archive + ": no folder to unpack it in can be made where temporary files are (TMPDIR)");
    }
    path_ = name;
    lock_.emplace(path_);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }

  void require_room(const std::string& archive, std::uint64_t bytes) const {
    std::error_code error;
    const fs::space_info space = fs::space(path_, error);
    if (error || bytes <= space.available) return;
    throw Error(ErrorCode::kIo,
                fmt::format("{}: takes {} bytes unpacked, {} has room for {} (TMPDIR names another folder)", archive,
                            bytes, path_.parent_path().string(), space.available));
  }

  /// Copies what a file holds, or a part of it.
  void add(const std::string& name, const RawFile& from, std::uint64_t begin, std::uint64_t bytes) const {
    File file((path_ / name).string(), File::Mode::kReadWrite);
    std::vector<std::byte> piece(std::size_t{1} << 20U);
    for (std::uint64_t done = 0; done < bytes;) {
      const auto part =
          std::span(piece).first(static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), bytes - done)));
      from.read(begin + done, part);
      file.write_at(done, part);
      done += part.size();
    }
  }

 private:
  fs::path path_;
  std::optional<FolderLock> lock_;
};

/// A raster that was unpacked to be read, under its archive's name.
class PackedSource final : public HeightSource {
 public:
  PackedSource(const std::string& path, const OpenOptions& options) : path_(path), scratch_(path) {
    OpenOptions inside = options;
    inside.part.clear();
    inside.reference_system.clear();  // which the caller takes for the whole
    std::vector<std::string> names;
    try {
      names = unpack(options);
      if (names.size() == 1) {
        source_ = open_raster(names.front(), inside);
      } else {
        source_ = std::make_unique<MosaicSource>(path, plan_mosaic(names, inside), inside, OverlapRule::kLast);
      }
    } catch (const Error& error) {
      throw renamed(error);
    }
    info_ = source_->info();
    info_.path = path;
    for (Warning& warning : info_.warnings) warning = warning.reworded(renamed(warning));
    if (names.size() > 1)
      info_.warnings.push_back(fmt::format("{} tiles are inside, which are read as one", names.size()));
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    try {
      source_->read_window(window, samples);
    } catch (const Error& error) {
      throw renamed(error);
    }
  }
  void limit_buffers(std::uint64_t bytes) override { source_->limit_buffers(bytes); }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override { return source_->buffer_bytes(limit); }

 private:
  /// Files inside as a user knows them.
  [[nodiscard]] std::string renamed(std::string text) const {
    const std::string folder = scratch_.path().string();
    for (std::size_t at = 0; (at = text.find(folder, at)) != std::string::npos; at += path_.size()) {
      text.replace(at, folder.size(), path_);
    }
    return text;
  }
  [[nodiscard]] Error renamed(const Error& error) const {
    const std::string text = renamed(std::string(error.what()));
    return {error.code(), text.starts_with(path_) ? text : path_ + ": " + text};
  }
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, path_ + ": " + what); }

  /// The paths of the rasters, unpacked.
  [[nodiscard]] std::vector<std::string> unpack(const OpenOptions& options) {
    const RawFile file(path_, options.unpacked_bytes);
    if (auto members = members_of(file)) return unpack(file, std::move(*members), options);
    if (is_gzip_name(path_)) return {unpack_gzip(file)};
    fail(ErrorCode::kCorrupt, "is no whole ZIP or tar archive");
  }

  std::vector<std::string> unpack(const RawFile& file, const std::vector<Member>& members, const OpenOptions& options) {
    const std::vector<const Member*> rasters = rasters_in(members, options.part);
    if (rasters.empty()) {
      std::vector<const Member*> all;
      for (const Member& member : members) all.push_back(&member);
      fail(options.part.empty() ? ErrorCode::kUnsupported : ErrorCode::kInvalidArgument,
           fmt::format("holds no {}; there are {}",
                       options.part.empty() ? "raster that isohf reads" : '"' + printable(options.part) + '"',
                       list_of_names(all)));
    }
    // Tiles of .hgt say by their names where they lie; of any other rasters nobody knows whether they are one.
    if (rasters.size() > 1 && !std::ranges::all_of(rasters, [](const Member* each) { return ends_in(each, ".hgt"); })) {
      fail(ErrorCode::kInvalidArgument,
           fmt::format("holds {} rasters, {}; `part` NAME takes one of them, unpacked in a "
                       "folder they are one input",
                       rasters.size(), list_of_names(rasters)));
    }
    std::vector<const Member*> wanted;
    std::vector<std::string> paths;
    for (const Member* raster : rasters) {
      want(raster, members, wanted);
      paths.push_back((scratch_.path() / raster->file_name()).string());
    }
    std::uint64_t bytes = 0;
    for (const Member* member : wanted) {
      if (member->is_sparse) {
        fail(ErrorCode::kUnsupported,
             fmt::format("{} is stored with holes, as a sparse file; unpack it first", printable(member->name)));
      }
      bytes += std::min(member->bytes, ~std::uint64_t{0} - bytes);
    }
    scratch_.require_room(path_, bytes);
    for (const Member* member : wanted) {
      if (member->zip) {
        const RawFile inside(path_, *member->zip, options.unpacked_bytes);
        scratch_.add(member->file_name(), inside, 0, inside.size_bytes());
      } else {
        scratch_.add(member->file_name(), file, member->begin, member->bytes);
      }
    }
    return paths;
  }

  /// The raster, and the files of its name that lie beside it in the archive.
  void want(const Member* raster, const std::vector<Member>& members, std::vector<const Member*>& wanted) const {
    const std::string stem = fs::path(raster->file_name()).stem().string() + '.';
    std::size_t beside = 0;
    for (const Member& member : members) {
      const std::string name = member.file_name();
      const bool belongs = member.folder() == raster->folder() && name.starts_with(stem) && !is_raster(member) &&
                           !ends_in(&member, ".ovr") && beside < kMostBeside;
      if (&member != raster && !belongs) continue;
      if (std::ranges::any_of(wanted, [&](const Member* other) { return other->file_name() == name; })) {
        fail(ErrorCode::kUnsupported, fmt::format("holds two files called {}; unpack it first", printable(name)));
      }
      beside += &member == raster ? 0 : 1;
      wanted.push_back(&member);
    }
  }

  /// The contents of a .gz; its neighbours in its folder become neighbours of what is inside.
  [[nodiscard]] std::string unpack_gzip(const RawFile& file) const {
    scratch_.require_room(path_, file.size_bytes());
    const fs::path inside = fs::path(without_gzip(path_)).filename();
    scratch_.add(inside.string(), file, 0, file.size_bytes());
    std::error_code error;
    std::size_t beside = 0;
    for (const auto& entry : fs::directory_iterator(fs::absolute(path_, error).parent_path(), error)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(inside.stem().string() + '.') || is_gzip_name(name) || ++beside > kMostBeside) continue;
      std::error_code ignored;  // a neighbour of the same name, which is not the one inside
      fs::create_symlink(entry.path(), scratch_.path() / name, ignored);
    }
    return (scratch_.path() / inside).string();
  }

  std::string path_;
  Scratch scratch_;
  std::unique_ptr<HeightSource> source_;  ///< closed before its files go
  SourceInfo info_;
};

}  // namespace

bool looks_like_tar(std::span<const std::byte> head) {
  return head.size() > 262 && text_of(head).substr(257, 5) == "ustar";
}

bool is_zip(const std::string& path) {
  if (is_gzip_name(path)) return false;
  try {
    const RawFile file(path);
    std::array<std::byte, 2> head{};
    if (file.read_some(0, head) < head.size() || text_of(head) != "PK") return false;
    // isohf's own archives are ZIP files as well.
    return std::ranges::none_of(zipped_files(file), [](const ZipEntry& member) { return member.name == "isohf.json"; });
  } catch (const Error&) {
    return false;  // is something else, or too damaged to say
  }
}

bool is_archive_of_rasters(const std::string& path) {
  try {
    const auto members = members_of(RawFile(path));
    return !members || !rasters_in(*members, "").empty();
  } catch (const Error&) {
    return true;  // whoever opens it says what is wrong
  }
}

std::unique_ptr<HeightSource> open_packed(const std::string& path, const OpenOptions& options) {
  return std::make_unique<PackedSource>(path, options);
}

}  // namespace isohf
