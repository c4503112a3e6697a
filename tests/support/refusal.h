// The words in which something is refused.
#pragma once
#include <functional>
#include <string>

#include "core/errors.h"

namespace kvx::testing_support {

// What the error of that kind says that `act` throws; `otherwise` where it throws none.
template <class Kind = Error>
std::string RefusalOf(const std::function<void()>& act, const std::string& otherwise = "") {
  try {
    act();
  } catch (const Kind& error) {
    return error.what();
  }
  return otherwise;
}

}  // namespace kvx::testing_support
