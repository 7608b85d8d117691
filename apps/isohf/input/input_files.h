#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common.h"

namespace isohf::cli {

/// The files that inputs on a command line stand for, in their order. An input is
///   a file;
///   a folder: all files in it that have the extension of a raster that isohf reads natively, by name; with `recursive`
///     those of its folders as well;
///   a pattern of *, ? and [...] that names no file itself: the files that match, by name;
///   @LIST: a text file of one input a line, relative to the list's folder; empty lines and such that start with # are
///     passed over. A file whose name starts with @ is named ./@NAME.
/// Throws Error{kIo} for what is not there, matches nothing or holds nothing.
[[nodiscard]] std::vector<std::string> expand_inputs(const std::vector<std::string>& inputs, bool recursive);

/// A file, and where it was found below a folder that was named: "N44" of tiles/N44/N44E006.hgt for tiles/.
struct InputFile {
  std::string path;
  std::string below;
};
[[nodiscard]] std::vector<InputFile> expand_input_files(const std::vector<std::string>& inputs, bool recursive);

/// Whether a file of this name would be taken from a folder.
[[nodiscard]] bool has_raster_name(const std::string& path);

/// The files that a command goes through one after the other, each on its own: as above, but archives (.isohf) of a
/// folder as well, or nothing else with `only_archives`, and what names a file is taken as it is, there or not.
[[nodiscard]] std::vector<std::string> list_files(const std::vector<std::string>& inputs, bool only_archives);

/// Goes through files one after the other: `work` returns an exit code or throws Error, which is said and does not keep
/// the others from their turn; with `json` it is an object on a line as well. Of several files a line on standard error
/// sums up. Returns the worst exit code: wrong usage before failure before differences. A single file's Error goes on.
[[nodiscard]] int for_each_file(const std::vector<std::string>& files, const Common& common,
                                const std::function<int(const std::string& file)>& work);

}  // namespace isohf::cli
