// SIGINT, SIGTERM and SIGHUP set a flag; the handler is used up by the first signal.
#include "cli/terminal/interrupt.h"

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
  struct sigaction of_before = {};
  sigaction(SIGHUP, nullptr, &of_before);
  if (of_before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // else nohup has asked for that
}

bool InterruptRequested() { return interrupted; }

void ThrowIfInterrupted() {
  if (interrupted) throw Cancelled();
}

}  // namespace kvx
