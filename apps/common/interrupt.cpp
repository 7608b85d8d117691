#include "interrupt.h"

#include <unistd.h>

#include <csignal>

#include "common.h"

namespace isohf::cli {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the flag is set in a signal handler");

extern "C" void on_interrupt(int /*signal*/) {
  if (interrupted.exchange(true)) _exit(kExitInterrupted);
}

}  // namespace

const std::atomic<bool>& watch_interrupts() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    // nohup ignores that a terminal goes away.
    if (std::signal(number, on_interrupt) == SIG_IGN && number == SIGHUP) std::signal(number, SIG_IGN);
  }
  return interrupted;
}

}  // namespace isohf::cli
