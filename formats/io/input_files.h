#pragma once

#include <string>
#include <vector>

namespace isohf {

/// A file that an input stands for, and the folders between it and the folder that was named: "N44" of
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

/// The same for programs that read each file on its own: a folder's archives (.isohf) count too, or alone with
/// `only_archives`. A name of a file is taken as it is, whether it exists or not.
[[nodiscard]] std::vector<std::string> list_files(const std::vector<std::string>& inputs, bool only_archives);

/// "N44E006" of a/N44E006.hgt.zip: the name without its extension, and that of what is packed.
[[nodiscard]] std::string bare_name(const std::string& path);

}  // namespace isohf
