#include "isohf/base/memory/memory_budget.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <cmath>
#include <vector>

#include "isohf/base/arena.h"
#include "isohf/base/text/number_text.h"
#include "isohf/error.h"

namespace isohf {

void give_back_freed_memory() {
#if defined(__GLIBC__)
  (void)::malloc_trim(0);
#endif
}

double reading_bytes(const Job& job, double vertices_of_tile) {
  return kProgramBytes + threads_of(job) * (kThreadBytes + kDecodingBytesPerVertex * vertices_of_tile);
}

void require_memory(const Job& job, double bytes, double least, const std::string& what, const std::string& remedy) {
  if (job.bound_bytes() == 0 || bytes <= static_cast<double>(job.bound_bytes())) return;
  constexpr std::uint64_t kMega = 1000000;
  if (job.memory_bytes == 0) {
    const std::string needed = in_bytes(least);
    const std::string most = in_bytes(static_cast<double>(job.bound_bytes()));
    const std::string allow = fmt::format(
        "`memory_bytes` {} allows it{}",
        least < 1e9 ? fmt::format("{}MB", std::ceil(least / 1e6))
                    : fmt::format("{}GB", least < 1e10 ? std::ceil(least / 1e8) / 10.0 : std::ceil(least / 1e9)),
        remedy.empty() ? "" : ", or use " + remedy);
    throw Error(
        ErrorCode::kOutOfMemory,
        fmt::format("{} needs {} of memory, more than a quarter of this machine's, {}; {}", what, needed, most, allow),
        {"memory", needed, "at most " + most, allow});
  }
  const auto enough = static_cast<std::uint64_t>(std::ceil(least / static_cast<double>(kMega)));
  std::vector<std::string> less;
  if (!remedy.empty()) less.push_back(remedy);
  if (threads_of(job) > 1) less.push_back(fmt::format("fewer `threads` than {}", threads_of(job)));
  const std::string use = less.empty() ? "" : fmt::format(", or use {}", fmt::join(less, " or "));
  throw Error(ErrorCode::kOutOfMemory,
              fmt::format("`memory_bytes` allows {} MB, {} needs at least {} MB; allow that much{}",
                          job.memory_bytes / kMega, what, enough, use),
              {"memory", fmt::format("{} MB", job.memory_bytes / kMega), fmt::format("at least {} MB", enough),
               "allow that much" + use});
}

ScratchFolder scratch_for(const Job& job, double in_memory, double in_scratch, const std::string& what) {
  if (job.bound_bytes() == 0 || in_memory <= static_cast<double>(job.bound_bytes())) return std::nullopt;
  require_memory(job, in_scratch, in_scratch, what, "");
  return job.scratch_folder;
}

}  // namespace isohf
