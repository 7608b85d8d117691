#include "input/input_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "isohf/error.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {

int worse_code(int one, int other) {
  constexpr std::array kWorstFirst = {int{kExitUsage}, int{kExitFailed}, int{kExitDifferences}, int{kExitDone}};
  return *std::ranges::find_first_of(kWorstFirst, std::array{one, other});
}

int for_each_file(const std::vector<std::string>& files, const Common& common,
                  const std::function<int(const std::string& file)>& work) {
  if (files.size() == 1) return work(files.front());
  std::map<int, std::size_t> counts;
  int worst = kExitDone;
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
    worst = worse_code(worst, code);
  }
  if (!common.quiet) {
    const std::size_t differ = counts[kExitDifferences];
    print_note(common, fmt::format("{} files: {} done, {}{} failed", files.size(), counts[kExitDone],
                                   differ > 0 ? fmt::format("{} with differences, ", differ) : "",
                                   counts[kExitFailed] + counts[kExitUsage]));
  }
  return worst;
}

}  // namespace isohf::cli
