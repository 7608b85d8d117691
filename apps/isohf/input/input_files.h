#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common.h"
#include "formats/io/input_files.h"

namespace isohf::cli {

/// The worse of two exit codes: wrong usage before failure before differences.
[[nodiscard]] int worse_code(int one, int other);

/// Reads files one after the other: `work` returns an exit code or throws Error, which is printed and does not stop the
/// others; with --json it is an object on a line as well. For several files a line on standard error sums up. Returns
/// the worst exit code. A single file's Error is thrown.
[[nodiscard]] int for_each_file(const std::vector<std::string>& files, const Common& common,
                                const std::function<int(const std::string& file)>& work);

}  // namespace isohf::cli
