#pragma once

#include <string>
#include <vector>

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

}  // namespace isohf::cli
