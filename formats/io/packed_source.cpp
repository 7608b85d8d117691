/// Rasters in packed files: they are unpacked into a folder that goes when they are closed.

#include <archive.h>
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "formats/io/file_stamp.h"
#include "formats/io/packed_files.h"
#include "formats/io/raw_file.h"
#include "formats/io/unpacked_folder.h"
#include "formats/mosaic/mosaic_source.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

/// More is no archive of rasters, but damage.
constexpr std::size_t kMostMembers = 100000;
constexpr std::size_t kMostNameBytes = std::size_t{64} << 20U;
/// Files that belong to one raster.
constexpr std::size_t kMostBeside = 64;

/// A file in an archive.
struct Member {
  std::string name;
  std::uint64_t bytes = 0;

  [[nodiscard]] std::string file_name() const { return fs::path(name).filename().string(); }
  [[nodiscard]] fs::path folder() const { return fs::path(name).parent_path(); }
  [[nodiscard]] bool ends_in(std::string_view extension) const { return lower_case(name).ends_with(extension); }
};

/// From the one that `files` is at.
std::vector<Member> members_of(const std::string& path, PackedFiles& files) {
  std::vector<Member> members;
  std::size_t name_bytes = 0;
  do {
    name_bytes += files.name().size();
    if (members.size() == kMostMembers || name_bytes > kMostNameBytes)
      throw Error(ErrorCode::kUnsupported, path + ": holds more files than an archive of rasters; unpack it first");
    members.push_back({files.name(), files.size_bytes()});
  } while (files.next());
  return members;
}

/// By its name; headers, labels, packed files and what names other files are none.
bool is_raster(const Member& member) {
  const std::string name = lower_case(member.file_name());
  if (name.empty() || name.front() == '.' || has_archive_name(name) || unpacked_name(name) != name) return false;
  if (std::ranges::any_of(std::initializer_list<const char*>{".hdr", ".lbl", ".lblx", ".vrt"},
                          [&](const char* other) { return name.ends_with(other); })) {
    return false;
  }
  return has_raster_extension(name);
}

/// What is read of an archive, by name: `part`, or all that are rasters, pictures only where there is nothing else.
std::vector<const Member*> rasters_in(const std::vector<Member>& members, const std::string& part) {
  std::vector<const Member*> found;
  for (const Member& member : members) {
    if (part.empty() ? is_raster(member) : member.name == part || member.file_name() == part) found.push_back(&member);
  }
  const auto is_picture = [](const Member* member) { return member->ends_in(".png"); };
  if (part.empty() && !std::ranges::all_of(found, is_picture)) std::erase_if(found, is_picture);
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

/// Rasters of a packed file with the files beside them, in a folder of their own.
class Unpacked {
 public:
  Unpacked(std::string path, const std::string& part) : path_(std::move(path)), folder_(path_) {
    PackedFiles files(path_);
    const bool has_files = files.next();
    if (files.is_one_file()) {
      unpack_one(files, part);
    } else {
      unpack_archive(has_files ? members_of(path_, files) : std::vector<Member>(), part);
    }
  }

  /// Their paths.
  [[nodiscard]] const std::vector<std::string>& rasters() const { return rasters_; }
  [[nodiscard]] bool has_room_to_stay() const { return folder_.has_room_to_stay(); }

  /// A text that names files as a user knows them.
  [[nodiscard]] std::string renamed(std::string text) const {
    for (const auto& [from, to] : called_) {
      for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    }
    return text;
  }

 private:
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, path_ + ": " + what); }

  void unpack_one(PackedFiles& files, const std::string& part) {
    if (has_archive_name(path_)) fail(ErrorCode::kCorrupt, "is not a whole archive");
    if (!part.empty()) fail(ErrorCode::kInvalidArgument, "is one packed file; `part` is for archives");
    const fs::path inside = folder_.path() / files.name();
    called_ = {{inside.string(), path_}, {folder_.path().string(), fs::path(path_).parent_path().string()}};
    folder_.add(files.name(), files);
    rasters_.push_back(inside.string());
    link_neighbours(files.name());
  }

  void unpack_archive(const std::vector<Member>& members, const std::string& part) {
    called_ = {{folder_.path().string(), path_}};
    const std::vector<const Member*> rasters = rasters_in(members, part);
    if (rasters.empty()) {
      std::vector<const Member*> all;
      for (const Member& member : members) all.push_back(&member);
      fail(part.empty() ? ErrorCode::kUnsupported : ErrorCode::kInvalidArgument,
           fmt::format("holds no {}; there are {}",
                       part.empty() ? "raster that isohf reads" : '"' + printable(part) + '"', list_of_names(all)));
    }
    // Tiles of .hgt say by their names where they lie; of any other rasters nobody knows whether they are one.
    if (rasters.size() > 1 && !std::ranges::all_of(rasters, [](const Member* each) { return each->ends_in(".hgt"); })) {
      fail(ErrorCode::kInvalidArgument,
           fmt::format("holds {} rasters, {}; `part` NAME takes one of them, unpacked in a folder they are one input",
                       rasters.size(), list_of_names(rasters)));
    }
    std::vector<bool> wanted(members.size());
    std::uint64_t bytes = 0;
    const std::vector<const Member*> others = companions_in(members);
    for (const Member* raster : rasters) {
      for (const Member* member : with_neighbours(*raster, others)) {
        wanted[static_cast<std::size_t>(member - members.data())] = true;
        bytes += member->bytes;
      }
      rasters_.push_back((folder_.path() / raster->file_name()).string());
    }
    folder_.require_room(bytes);
    PackedFiles files(path_);
    for (std::size_t i = 0, left = static_cast<std::size_t>(std::ranges::count(wanted, true)); left > 0; ++i) {
      if (!files.next() || i >= members.size() || files.name() != members[i].name)
        fail(ErrorCode::kIo, "was changed while it was read");
      if (!wanted[i]) continue;
      const std::string name = members[i].file_name();
      if (std::error_code none; fs::exists(folder_.path() / name, none))
        fail(ErrorCode::kUnsupported, fmt::format("holds two files called {}; unpack it first", printable(name)));
      folder_.add(name, files);
      --left;
    }
  }

  /// The files that say something of rasters.
  [[nodiscard]] static std::vector<const Member*> companions_in(const std::vector<Member>& members) {
    std::vector<const Member*> found;
    for (const Member& member : members) {
      if (!is_raster(member) && !member.ends_in(".ovr")) found.push_back(&member);
    }
    return found;
  }

  /// The raster, and those of the other files that lie beside it under its stem.
  [[nodiscard]] static std::vector<const Member*> with_neighbours(const Member& raster,
                                                                  const std::vector<const Member*>& others) {
    const std::string stem = fs::path(raster.file_name()).stem().string() + '.';
    std::vector<const Member*> found = {&raster};
    for (const Member* member : others) {
      if (member->folder() == raster.folder() && member->file_name().starts_with(stem) && found.size() <= kMostBeside &&
          member != &raster)
        found.push_back(member);
    }
    return found;
  }

  /// What lies beside one packed file lies beside what is inside.
  void link_neighbours(const std::string& inside) const {
    const std::string stem = fs::path(inside).stem().string() + '.';
    std::error_code error;
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(fs::absolute(path_, error).parent_path(), error)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(stem) || unpacked_name(name) != name || ++count > kMostBeside) continue;
      std::error_code ignored;  // a neighbour of the same name, which is not the one inside
      fs::create_symlink(entry.path(), folder_.path() / name, ignored);
    }
  }

  std::string path_;
  UnpackedFolder folder_;
  std::vector<std::string> rasters_;
  std::vector<std::pair<std::string, std::string>> called_;  ///< paths here, and what they are called
};

/// What is unpacked at the moment: for the next one that opens the same.
struct UnpackedNow {
  std::mutex mutex;
  std::map<std::string, std::weak_ptr<const Unpacked>> all;
} now;

std::string key_of(const std::string& path, const OpenOptions& options) {
  return fmt::format("{} {} {}", FileStamp::of(path).text(), options.part, fs::absolute(path).string());
}

std::shared_ptr<const Unpacked> find_unpacked(const std::string& key) {
  const std::lock_guard lock(now.mutex);
  const auto found = now.all.find(key);
  return found == now.all.end() ? nullptr : found->second.lock();
}

std::shared_ptr<const Unpacked> unpack(const std::string& path, const OpenOptions& options) {
  const std::string key = key_of(path, options);
  if (auto found = find_unpacked(key)) return found;
  const MemberPath place = member_path(path).value_or(MemberPath{path, options.part});
  auto unpacked = std::make_shared<const Unpacked>(place.archive, place.member);
  const std::lock_guard lock(now.mutex);
  std::erase_if(now.all, [](const auto& each) { return each.second.expired(); });
  now.all[key] = unpacked;
  return unpacked;
}

/// A raster that was unpacked to be read, under its archive's name.
class PackedSource final : public HeightSource {
 public:
  PackedSource(const std::string& path, const OpenOptions& options) : unpacked_(unpack(path, options)) {
    OpenOptions inside = options;
    inside.part.clear();
    inside.reference_system.clear();  // which the caller takes for the whole
    const std::vector<std::string>& rasters = unpacked_->rasters();
    try {
      if (rasters.size() == 1) {
        source_ = open_by_content(rasters.front(), inside);
      } else {
        source_ = std::make_unique<MosaicSource>(path, plan_mosaic(rasters, inside), inside, OverlapRule::kLast);
      }
    } catch (const Error& error) {
      throw renamed(error);
    }
    info_ = source_->info();
    info_.path = path;
    for (Warning& warning : info_.warnings) warning = warning.reworded(unpacked_->renamed(warning));
    if (rasters.size() > 1)
      info_.warnings.push_back(fmt::format("{} tiles are inside, which are read as one", rasters.size()));
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    try {
      source_->read_window(window, samples);
    } catch (const Error& error) {
      throw renamed(error);
    }
  }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return source_->buffer_bytes(); }

 private:
  [[nodiscard]] Error renamed(const Error& error) const {
    ErrorParts parts = error.parts();
    for (std::string* text : {&parts.where, &parts.found, &parts.required, &parts.remedy})
      *text = unpacked_->renamed(*text);
    return {error.code(), unpacked_->renamed(error.what()), std::move(parts)};
  }

  std::shared_ptr<const Unpacked> unpacked_;
  std::unique_ptr<HeightSource> source_;  ///< closed before its files go
  SourceInfo info_;
};

std::unique_ptr<HeightSource> open_packed(const std::string& path, const OpenOptions& options) {
  return std::make_unique<PackedSource>(path, options);
}

}  // namespace

const Format kPackedFormat = {.name = "packed files",
                              .extensions = {".zip", ".7z", ".tar", ".tgz", ".gz", ".bz2", ".xz", ".zst"},
                              .library = [] { return std::string(archive_version_string()); },
                              .note = "takes `part`",
                              .open = open_packed,
                              .recognises = looks_like_archive,
                              .takes_part = true,
                              .takes_encoding = true};

bool is_archive_of_rasters(const std::string& path) {
  try {
    PackedFiles files(path);
    if (!files.next()) return false;
    return files.is_one_file() || !rasters_in(members_of(path, files), "").empty();
  } catch (const Error&) {
    return true;  // whoever opens it says what is wrong
  }
}

std::shared_ptr<const void> keep_unpacked(const std::string& path, const OpenOptions& options) {
  const auto found = find_unpacked(key_of(path, options));
  return found && found->has_room_to_stay() ? found : nullptr;
}

}  // namespace isohf
