#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isohf/error.h"
#include "options/work_options.h"

namespace isohf::cli {

/// One of many conversions, and where its archive goes.
struct EachFile {
  std::string input;
  std::string output;
};

/// Inputs, as expand_inputs takes them, and the archive of each: FOLDER/NAME.isohf, in the folders that --recursive
/// found it in. Throws Error{kInvalidArgument} where two would be one.
[[nodiscard]] std::vector<EachFile> files_of_each(const std::vector<std::string>& inputs, bool recursive,
                                                  const std::string& folder);

/// What a conversion may use.
struct EachShare {
  int threads = 0;
  std::uint64_t memory_bytes = 0;  ///< as Job has them
  std::uint64_t machine_bytes = 0;
  bool alone = false;  ///< no other runs beside it
};

/// What became of a file.
struct EachResult {
  bool is_converted = true;  ///< else it was complete before
  std::string document;      ///< JSON members on one line
  std::vector<Warning> warnings;
  std::string note = {};  ///< not for --quiet
};

/// Converts one file within the share; nullopt where it is too large for a share that is not all there is.
using ConvertOneFile = std::function<std::optional<EachResult>(const EachFile& file, const EachShare& share)>;

/// Runs the conversions: small files side by side, one thread each, and large ones alone on all threads; together they
/// stay within the memory that work allows. Where the disk is full, none is begun any more. Tells of every file in the
/// order of the inputs, and of all at the end.
/// Returns the exit code. Throws Error{kCancelled}.
int convert_each(const std::vector<EachFile>& files, bool keep_going, const WorkOptions& work, const Common& common,
                 const ConvertOneFile& convert_one, const std::atomic<bool>& cancel);

}  // namespace isohf::cli
