#include "isohf/error.h"

namespace isohf {

Error error_from(const std::vector<Warning>& warnings) {
  std::string all;
  for (const Warning& warning : warnings) all += (all.empty() ? "" : "; ") + warning;
  return {ErrorCode::kWarning, "a warning counts as an error: " + all, {"", all, "no warning", ""}};
}

}  // namespace isohf
