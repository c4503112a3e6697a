// Who asks, as an API key or a token says; without authentication, the person at this machine.
#pragma once
#include <string>

#include "storage/api_keys.h"

namespace kvx {

struct Identity {
  std::string who = "local";
  std::string project = "default";
  AccessScope scope = AccessScope::kAdmin;
  Quota quota;
};

}  // namespace kvx
