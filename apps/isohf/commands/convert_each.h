#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "input/convert_setup.h"
#include "isohf/convert/batch.h"
#include "isohf/error.h"
#include "output/report.h"

namespace isohf::cli {

/// One of many conversions.
struct EachFile {
  std::string input;
  std::string output;
};

/// What became of it: `report` has the members output, status and archive_bytes.
struct EachResult {
  Report report;
  std::vector<Warning> warnings = {};
  std::string note = {};  ///< not printed with --quiet
};

/// Converts one file within the share; nullopt if it is too large for it.
using ConvertOneFile = std::function<std::optional<EachResult>(const EachFile& file, const Batch::Share& share)>;

/// isohf convert INPUT... --out-dir DIR: an archive of each input, with a line for each in the order of the inputs, and
/// one for all. If the disk is full, no further conversion begins. Returns the worst exit code. Throws
/// Error{kCancelled}.
int convert_each(const ConvertCommandOptions& options, const ConvertOneFile& convert_one);

}  // namespace isohf::cli
