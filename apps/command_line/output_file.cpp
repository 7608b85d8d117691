#include "output_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "isohf/base/error.h"

namespace isohf::cli {
namespace {

bool same_file(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

[[noreturn]] void refuse(const std::string& output, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, output + ": " + why);
}

}  // namespace

void check_output_file(const std::string& input, const std::string& output, bool overwrite) {
  check_output_file(std::vector<std::string>{input}, output, overwrite);
}

void check_output_file(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  struct stat out {};
  // The writer truncates NAME.part and its journal as well.
  for (const char* ending : {"", ".part", ".part.journal"}) {
    const std::string written = output + ending;
    if (::stat(written.c_str(), &out) != 0) continue;
    for (const std::string& input : inputs) {
      struct stat in {};
      if (::stat(input.c_str(), &in) != 0 || !same_file(in, out)) continue;
      refuse(output, "the output " + (*ending == '\0' ? std::string() : "writes " + written + ", which ") +
                         (inputs.size() == 1 ? "is the input" : "is one of the inputs") + "; choose another name");
    }
  }
  if (::stat(output.c_str(), &out) == 0) {
    if (S_ISDIR(out.st_mode)) refuse(output, "is a folder, the output must be a file name");
    if (!S_ISREG(out.st_mode)) refuse(output, "is no regular file, the output must be one");
    if (!overwrite) refuse(output, "exists; --overwrite replaces it");
    return;
  }
  const std::size_t slash = output.rfind('/');
  if (slash == output.size() - 1) refuse(output, "names a folder, the output must be a file name");
  const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : output.substr(0, slash);
  if (::stat(folder.c_str(), &out) != 0) {
    throw Error(ErrorCode::kIo, output + ": cannot write into folder " + folder + ": " + std::strerror(errno));
  }
  if (!S_ISDIR(out.st_mode)) throw Error(ErrorCode::kIo, output + ": " + folder + " is no folder");
}

}  // namespace isohf::cli
