// Errors that come back at every look, told once a minute.
#pragma once
#include "server/access/access.h"
#include "server/log.h"

namespace kvx {

// Thread-safe; does not throw. Events are told apart by their names.
class SeldomLog {
 public:
  void Error(const char* event, LogFields fields) try {
    if (!told_.Take(event, 1).exceeded) LogError(event, fields);
  } catch (...) {
  }

 private:
  RateLimiter told_{SteadyClockMs};
};

}  // namespace kvx
