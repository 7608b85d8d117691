#include "input/input_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "formats/io/text.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& input, const std::string& why) {
  throw Error(ErrorCode::kIo, {input, why, "", ""});
}

/// Extensions of native formats; headers beside the files that they describe are not rasters of their own.
const std::set<std::string>& raster_extensions() {
  static const std::set<std::string> known = [] {
    std::set<std::string> list;
    for (const Format& format : native_formats()) list.insert(format.extensions.begin(), format.extensions.end());
    for (const char* other : {".hdr", ".vrt"}) list.erase(other);  // beside rasters, or of them
    return list;
  }();
  return known;
}

/// What of a folder counts.
enum class Wanted { kRasters, kArchives, kBoth };

/// By its name; of ZIP and tar archives by the names inside, of ENVI's .dat by the header beside.
bool has_wanted_name(const fs::path& path, Wanted wanted) {
  std::string name = lower_case(path.filename().string());
  if (name.starts_with(".")) return false;
  const bool is_archive = name.size() > 6 && name.ends_with(".isohf");
  if (is_archive || wanted == Wanted::kArchives) return is_archive && wanted != Wanted::kRasters;
  for (const char* packed : {".zip", ".tar", ".tgz", ".tar.gz"}) {
    if (name.ends_with(packed)) return is_archive_of_rasters(path.string());
  }
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  if (name.ends_with(".dat")) return has_envi_header(path.string());
  return std::any_of(raster_extensions().begin(), raster_extensions().end(), [&](const std::string& extension) {
    return name.size() > extension.size() && name.ends_with(extension);
  });
}

/// A detached label is read with the image beside it.
bool is_label_of_another(const fs::path& path) {
  if (lower_case(path.extension().string()) != ".lbl") return false;
  for (const char* extension : {".img", ".IMG", ".Img"}) {
    std::error_code ignored;
    if (fs::exists(fs::path(path).replace_extension(extension), ignored)) return true;
  }
  return false;
}

template <typename Iterator>
std::vector<std::string> files_in(const std::string& folder, Wanted wanted) {
  std::vector<std::string> found;
  std::error_code error;
  Iterator entry(folder, error);
  for (; !error && entry != Iterator(); entry.increment(error)) {
    std::error_code gone;
    // A link that leads nowhere stands for a file that is missing: whoever opens it says so.
    const bool is_file = entry->is_regular_file(gone) || (entry->is_symlink(gone) && !entry->exists(gone));
    if (is_file && has_wanted_name(entry->path(), wanted) && !is_label_of_another(entry->path())) {
      found.push_back(entry->path().string());
    }
  }
  if (error) refuse(folder, "cannot be listed: " + error.message());
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> files_of_folder(const std::string& folder, bool recursive, Wanted wanted) {
  std::vector<std::string> found = recursive ? files_in<fs::recursive_directory_iterator>(folder, wanted)
                                             : files_in<fs::directory_iterator>(folder, wanted);
  if (found.empty()) {
    const std::string rasters = fmt::format("raster that isohf reads ({})", fmt::join(raster_extensions(), ", "));
    refuse(folder, fmt::format("holds no {}{}{}", wanted == Wanted::kRasters ? "" : "archive (.isohf)",
                               wanted == Wanted::kBoth ? " and no " : "", wanted == Wanted::kArchives ? "" : rasters) +
                       (recursive || wanted != Wanted::kRasters ? "" : "; --recursive looks into its folders too"));
  }
  return found;
}

std::vector<std::string> files_of_pattern(const std::string& pattern) {
  glob_t matches{};
  const int result = ::glob(pattern.c_str(), GLOB_NOSORT | GLOB_ERR, nullptr, &matches);
  std::vector<std::string> found(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
  ::globfree(&matches);
  if (result == GLOB_NOSPACE) throw Error(ErrorCode::kOutOfMemory, pattern + ": matches more than memory holds");
  if (result == GLOB_ABORTED) refuse(pattern, "a folder of the pattern cannot be listed");
  found.erase(std::remove_if(found.begin(), found.end(),
                             [](const std::string& path) {
                               std::error_code gone;
                               return fs::is_directory(path, gone);
                             }),
              found.end());
  if (found.empty()) refuse(pattern, "no file matches");
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> files_of(const std::string& input, bool recursive, Wanted wanted) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (fs::is_directory(status)) return files_of_folder(input, recursive, wanted);
  if (fs::exists(status)) return {input};
  if (input == "-") {
    refuse(input, "standard input has no beginning to go back to, as reading an input needs; save it in a file");
  }
  if (input.find_first_of("*?[") != std::string::npos) return files_of_pattern(input);
  refuse(input, error && error != std::errc::no_such_file_or_directory ? error.message() : "no such file");
}

std::vector<std::string> files_of_list(const std::string& list, bool recursive, Wanted wanted) {
  std::error_code error;
  if (fs::is_directory(list, error)) refuse(list, "is a folder; @ is for a list of inputs, leave it out");
  std::ifstream file(list, std::ios::binary);
  if (!file) refuse(list, fs::exists(list, error) ? "cannot be read" : "no such list of inputs");
  const fs::path folder = fs::path(list).parent_path();
  std::vector<std::string> found;
  std::string line;
  for (std::int64_t number = 1; std::getline(file, line); ++number) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.pop_back();
    line.erase(0, std::min(line.find_first_not_of(" \t"), line.size()));
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (line.empty() || line.front() == '#') continue;
    try {
      // An absolute path stays what it is.
      std::vector<std::string> files = files_of((folder / line).string(), recursive, wanted);
      std::move(files.begin(), files.end(), std::back_inserter(found));
    } catch (const Error& problem) {
      throw problem.within(fmt::format("{}: line {}", list, number));
    }
  }
  if (file.bad()) refuse(list, "cannot be read");
  if (found.empty()) refuse(list, "names no input");
  return found;
}

}  // namespace

bool has_raster_name(const std::string& path) {
  return has_wanted_name(path, Wanted::kRasters);
}

std::vector<InputFile> expand_input_files(const std::vector<std::string>& inputs, bool recursive) {
  std::vector<InputFile> found;
  for (const std::string& input : inputs) {
    std::error_code none;
    const bool is_folder = fs::is_directory(input, none);
    for (const std::string& path : expand_inputs({input}, recursive)) {
      found.push_back({path, is_folder ? fs::path(path).lexically_relative(input).parent_path().string() : ""});
    }
  }
  return found;
}

std::vector<std::string> expand_inputs(const std::vector<std::string>& inputs, bool recursive) {
  std::vector<std::string> found;
  for (const std::string& input : inputs) {
    const bool is_list = input.size() > 1 && input.front() == '@';
    std::vector<std::string> files = is_list ? files_of_list(input.substr(1), recursive, Wanted::kRasters)
                                             : files_of(input, recursive, Wanted::kRasters);
    std::move(files.begin(), files.end(), std::back_inserter(found));
  }
  return found;
}

std::vector<std::string> list_files(const std::vector<std::string>& inputs, bool only_archives) {
  const Wanted wanted = only_archives ? Wanted::kArchives : Wanted::kBoth;
  std::vector<std::string> found;
  for (const std::string& input : inputs) {
    std::error_code error;
    const fs::file_status status = fs::status(input, error);
    std::vector<std::string> files = {input};
    if (input.size() > 1 && input.front() == '@') {
      files = files_of_list(input.substr(1), false, wanted);
    } else if (fs::is_directory(status) ||
               (status.type() == fs::file_type::not_found && input.find_first_of("*?[") != std::string::npos)) {
      files = files_of(input, false, wanted);
    }
    std::move(files.begin(), files.end(), std::back_inserter(found));
  }
  return found;
}

int for_each_file(const std::vector<std::string>& files, const Common& common,
                  const std::function<int(const std::string& file)>& work) {
  if (files.size() == 1) return work(files.front());
  std::map<int, std::size_t> counts;
  for (const std::string& file : files) {
    int code = kExitDone;
    try {
      code = work(file);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kCancelled) throw;
      code = exit_code_for(error.code());
      print_error_line(common, error);
      if (common.json) {
        StandardOutput out(common);
        out.write(json_line({{"file", file}, {"error", json_from(error, code)}}));
        out.finish();
      }
    }
    ++counts[code];
  }
  if (!common.quiet) {
    const std::size_t differ = counts[kExitDifferences];
    print_note(common, fmt::format("{} files: {} done, {}{} failed", files.size(), counts[kExitDone],
                                   differ > 0 ? fmt::format("{} with differences, ", differ) : "",
                                   counts[kExitFailed] + counts[kExitUsage]));
  }
  for (const int code : {kExitUsage, kExitFailed, kExitDifferences}) {
    if (counts[code] > 0) return code;
  }
  return kExitDone;
}

}  // namespace isohf::cli
