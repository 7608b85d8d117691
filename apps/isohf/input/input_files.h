#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common.h"

namespace isohf::cli {

/// A file that an input on a command line names, and the folders between it and the folder that was named: "N44" of
/// tiles/N44/N44E006.hgt for tiles/.
struct InputFile {
  std::string path;
  std::string below;
};

/// The files that inputs name, in their order. An input is
///   a file;
///   a folder: all files in it that have the extension of a raster that isohf reads natively, by name; with `recursive`
///     those of its folders as well;
///   a pattern of *, ? and [...] that is not a file's name: the files that match, by name;
///   @LIST: a text file of one input a line, relative to the list's folder; empty lines and those that start with # are
///     skipped. A file whose name starts with @ is named ./@NAME.
/// Throws Error{kIo} for what does not exist, matches nothing or contains nothing.
[[nodiscard]] std::vector<InputFile> find_inputs(const std::vector<std::string>& inputs, bool recursive);
/// Their paths.
[[nodiscard]] std::vector<std::string> expand_inputs(const std::vector<std::string>& inputs, bool recursive);

/// The same for commands that read each file on its own: a folder's archives (.isohf) count too, or alone with
/// `only_archives`. A name of a file is taken as it is, whether it exists or not.
[[nodiscard]] std::vector<std::string> list_files(const std::vector<std::string>& inputs, bool only_archives);

/// The worse of two exit codes: wrong usage before failure before differences.
[[nodiscard]] int worse_code(int one, int other);

/// Reads files one after the other: `work` returns an exit code or throws Error, which is printed and does not stop the
/// others; with --json it is an object on a line as well. For several files a line on standard error sums up. Returns the
/// worst exit code. A single file's Error is thrown.
[[nodiscard]] int for_each_file(const std::vector<std::string>& files, const Common& common,
                                const std::function<int(const std::string& file)>& work);

}  // namespace isohf::cli
