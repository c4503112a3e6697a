// Files as an account without rights sees them, whoever runs the tests.
#pragma once
#include <sys/fsuid.h>
#include <unistd.h>

namespace kvx::testing_support {

// While this lives, this thread may open what everybody may. It changes nothing for an account that is not
// root, to which files without rights are closed anyhow.
class AsNobody {
 public:
  AsNobody() : before_(uid_t(::setfsuid(kNobody))) {}
  ~AsNobody() { ::setfsuid(before_); }

 private:
  static constexpr uid_t kNobody = 65534;
  uid_t before_;
};

}  // namespace kvx::testing_support
