#include "isohf/error.h"

#include "isohf/job.h"

namespace isohf {

Error error_from(const std::vector<Warning>& warnings) {
  std::string all;
  for (const Warning& warning : warnings) all += (all.empty() ? "" : "; ") + warning;
  return {ErrorCode::kWarning, "a warning counts as an error: " + all, {"", all, "no warning", ""}};
}

void Job::throw_if_cancelled() const {
  if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) throw Error(ErrorCode::kCancelled, "interrupted");
}

}  // namespace isohf
