// Memory that `new` does not give when a test says so, however little is asked for.
#pragma once
#include <new>

namespace kvx::testing_support {

// While it lives, on the thread that made it, one allocation fails: the first after those that are granted.
class FailingNew {
 public:
  explicit FailingNew(int granted);
  ~FailingNew();
  FailingNew(const FailingNew&) = delete;
  FailingNew& operator=(const FailingNew&) = delete;
};

// While it lives no other thread gets any.
class FailingNewElsewhere {
 public:
  FailingNewElsewhere();
  ~FailingNewElsewhere();
  FailingNewElsewhere(const FailingNewElsewhere&) = delete;
  FailingNewElsewhere& operator=(const FailingNewElsewhere&) = delete;
};

// Calls `act` again and again, of which the first, then the second allocation fails and so on, until it
// succeeds. How often it did not.
template <class Act>
int TimesWithoutMemory(const Act& act) {
  for (int granted = 0;; ++granted) {
    try {
      const FailingNew failing(granted);
      act();
      return granted;
    } catch (const std::bad_alloc&) {
    }
  }
}

}  // namespace kvx::testing_support
