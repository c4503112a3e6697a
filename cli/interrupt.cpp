// SIGINT and SIGTERM set a flag; the handler is used up by the first signal.
#include "cli/interrupt.h"

#include <atomic>
#include <csignal>

#include "core/errors.h"

namespace kvx {
namespace {

std::atomic<bool> interrupted = false;  // read on several threads
static_assert(std::atomic<bool>::is_always_lock_free, "a signal's handler may set no other");

void Remember(int) { interrupted = true; }

}  // namespace

void CatchInterrupts() {
  struct sigaction action = {};
  action.sa_handler = Remember;
  action.sa_flags = int(SA_RESETHAND) | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool InterruptRequested() { return interrupted; }

void ThrowIfInterrupted() {
  if (interrupted) throw Cancelled();
}

}  // namespace kvx
