// Errors told with the name of what they are about.
#pragma once
#include <string>

#include "core/errors.h"

namespace kvx {

// What `make` makes. An error of one of these kinds is told as "name: ..."; it is of the first kind that
// fits.
template <class... Kinds, class Make>
auto WithName(const std::string& name, const Make& make) {
  try {
    return make();
  } catch (const Error& error) {
    const auto named = [&]<class Kind>(const Kind* as) {
      as = dynamic_cast<const Kind*>(&error);
      if (as) throw Kind(name + ": " + error.what());
    };
    (named(static_cast<const Kinds*>(nullptr)), ...);
    throw;
  }
}

}  // namespace kvx
