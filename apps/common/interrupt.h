#pragma once

#include <atomic>

namespace isohf::cli {

/// From here on SIGINT, SIGTERM and SIGHUP set the flag that is returned, and a second one ends the program at once
/// with exit code 130 (a conversion leaves NAME.part, never the final name). Commands that finish in a moment do not
/// call this.
[[nodiscard]] const std::atomic<bool>& watch_interrupts();

}  // namespace isohf::cli
