#include "formats/io/input_files.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "formats/io/packed_files.h"
#include "formats/registry.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& input, const std::string& why) {
  throw Error(ErrorCode::kIo, {input, why, "", ""});
}

/// Which files of a folder are inputs.
struct Wanted {
  bool rasters = true;
  bool archives = false;
  bool recursive = false;
};

bool is_wanted(const fs::path& path, const Wanted& wanted) {
  const std::string name = path.filename().string();
  if (lower_case(name).ends_with(".isohf")) return wanted.archives && !name.starts_with(".");
  return wanted.rasters && is_raster_in_folder(path.string());
}

template <typename Iterator>
void find_in_folder(const std::string& folder, const Wanted& wanted, std::vector<InputFile>& found) {
  const std::size_t first = found.size();
  std::error_code error;
  for (Iterator entry(folder, error); !error && entry != Iterator(); entry.increment(error)) {
    std::error_code gone;
    // A link to nothing stands for a missing file, which is reported when it is opened.
    const bool is_file = entry->is_regular_file(gone) || (entry->is_symlink(gone) && !entry->exists(gone));
    if (!is_file || !is_wanted(entry->path(), wanted)) continue;
    found.push_back({entry->path().string(), entry->path().lexically_relative(folder).parent_path().string()});
  }
  if (error) refuse(folder, "cannot be listed: " + error.message());
  if (found.size() == first) {
    refuse(folder, fmt::format("contains no {}{}",
                               !wanted.rasters   ? "archive (.isohf)"
                               : wanted.archives ? "archive (.isohf) and no raster that isohf reads"
                                                 : "raster that isohf reads",
                               wanted.recursive || wanted.archives ? "" : "; `recursive` searches its folders too"));
  }
  std::sort(found.begin() + static_cast<std::ptrdiff_t>(first), found.end(),
            [](const InputFile& a, const InputFile& b) { return a.path < b.path; });
}

void find_pattern(const std::string& pattern, std::vector<InputFile>& found) {
  glob_t matches{};
  const int result = ::glob(pattern.c_str(), GLOB_ERR, nullptr, &matches);
  const std::vector<std::string> names(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
  ::globfree(&matches);
  if (result == GLOB_NOSPACE) throw Error(ErrorCode::kOutOfMemory, pattern + ": matches more than memory holds");
  if (result == GLOB_ABORTED) refuse(pattern, "a folder of the pattern cannot be listed");
  const std::size_t first = found.size();
  for (const std::string& name : names) {
    std::error_code gone;
    if (!fs::is_directory(name, gone)) found.push_back({name, ""});
  }
  if (found.size() == first) refuse(pattern, "no file matches");
}

/// A file, a folder or a pattern.
void find_one(const std::string& input, const Wanted& wanted, std::vector<InputFile>& found) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (fs::is_directory(status)) {
    return wanted.recursive ? find_in_folder<fs::recursive_directory_iterator>(input, wanted, found)
                            : find_in_folder<fs::directory_iterator>(input, wanted, found);
  }
  if (fs::exists(status) || member_path(input)) {
    found.push_back({input, ""});
  } else if (input == "-") {
    refuse(input, "standard input cannot be read twice, as a conversion needs; save it in a file");
  } else if (input.find_first_of("*?[") != std::string::npos) {
    find_pattern(input, found);
  } else {
    refuse(input, error && error != std::errc::no_such_file_or_directory ? error.message() : "no such file");
  }
}

void find_list(const std::string& list, const Wanted& wanted, std::vector<InputFile>& found) {
  std::error_code error;
  if (fs::is_directory(list, error)) refuse(list, "is a folder; leave out the @, which is for a list of inputs");
  std::ifstream file(list, std::ios::binary);
  if (!file) refuse(list, fs::exists(list, error) ? "cannot be read" : "no such list of inputs");
  const std::size_t first = found.size();
  std::string line;
  for (std::int64_t number = 1; std::getline(file, line); ++number) {
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    line.erase(line.find_last_not_of(" \t\r") + 1);
    line.erase(0, std::min(line.find_first_not_of(" \t"), line.size()));
    if (line.empty() || line.front() == '#') continue;
    try {
      find_one((fs::path(list).parent_path() / line).string(), wanted, found);
    } catch (const Error& problem) {
      throw problem.within(fmt::format("{}: line {}", list, number));
    }
  }
  if (file.bad()) refuse(list, "cannot be read");
  if (found.size() == first) refuse(list, "names no input");
}

bool is_list(const std::string& input) {
  return input.size() > 1 && input.front() == '@';
}

std::vector<InputFile> find_all(const std::vector<std::string>& inputs, const Wanted& wanted) {
  std::vector<InputFile> found;
  for (const std::string& input : inputs)
    is_list(input) ? find_list(input.substr(1), wanted, found) : find_one(input, wanted, found);
  return found;
}

std::vector<std::string> paths_of(const std::vector<InputFile>& files) {
  std::vector<std::string> paths;
  for (const InputFile& file : files) paths.push_back(file.path);
  return paths;
}

}  // namespace

std::vector<InputFile> find_inputs(const std::vector<std::string>& inputs, bool recursive) {
  return find_all(inputs, {.recursive = recursive});
}

std::vector<std::string> expand_inputs(const std::vector<std::string>& inputs, bool recursive) {
  return paths_of(find_inputs(inputs, recursive));
}

std::vector<std::string> list_files(const std::vector<std::string>& inputs, bool only_archives) {
  std::vector<std::string> found;
  for (const std::string& input : inputs) {
    std::error_code none;
    const bool is_pattern = input.find_first_of("*?[") != std::string::npos && !fs::exists(input, none);
    std::vector<std::string> files = {input};
    if (is_list(input) || is_pattern || fs::is_directory(input, none))
      files = paths_of(find_all({input}, {.rasters = !only_archives, .archives = true}));
    std::move(files.begin(), files.end(), std::back_inserter(found));
  }
  return found;
}

std::string bare_name(const std::string& path) {
  const fs::path name = fs::path(path).filename();
  const bool is_packed =
      (unpacked_name(path) != path || has_archive_name(path)) && is_raster_in_folder(name.stem().string());
  return (is_packed ? name.stem().stem() : name.stem()).string();
}

}  // namespace isohf
