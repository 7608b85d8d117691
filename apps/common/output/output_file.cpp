#include "output/output_file.h"

#include <sys/stat.h>

#include "isohf/base/output_file.h"
#include "isohf/error.h"

namespace isohf::cli {
namespace {

bool same_file(const std::string& a, const std::string& b) {
  struct stat first {};
  struct stat second {};
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 && first.st_dev == second.st_dev &&
         first.st_ino == second.st_ino;
}

/// written  the files that writing the output changes
void check_is_no_input(const std::vector<std::string>& inputs, const std::string& output,
                       const std::vector<std::string>& written) {
  for (const std::string& file : written) {
    for (const std::string& input : inputs) {
      if (!same_file(file, input)) continue;
      throw Error(ErrorCode::kInvalidArgument,
                  "the output " + (file == output ? std::string() : "writes " + file + ", which ") +
                      (inputs.size() == 1 ? "is the input" : "is one of the inputs") + "; choose another name");
    }
  }
}

}  // namespace

void check_output_file(const std::vector<std::string>& inputs, const std::string& output, bool overwrite,
                       const std::function<void(const std::string& place)>& check_place,
                       std::vector<std::string> also_written) {
  also_written.insert(also_written.begin(), output);
  try {
    check_is_no_input(inputs, output, also_written);
    const std::string place = output_place(output, true);
    // The writer changes its part and an archive's journal as well.
    check_is_no_input(inputs, output, {place + ".part", place + ".part.journal"});
    if (check_place) check_place(place);
    static_cast<void>(output_place(output, overwrite));
  } catch (const Error& error) {
    throw error.within(output);
  }
}

}  // namespace isohf::cli
