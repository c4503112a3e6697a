// Takes the place of the program's operators.
#include "tests/support/failing_new.h"

#include <atomic>
#include <cstdlib>
#include <limits>

namespace kvx::testing_support {
namespace {

constexpr int kAll = std::numeric_limits<int>::max();
thread_local int granted_here = kAll;
thread_local bool spared = false;  // by FailingNewElsewhere
std::atomic<bool> none_elsewhere = false;

bool Granted() {
  if (none_elsewhere && !spared) return false;
  return granted_here == kAll || granted_here-- != 0;
}

}  // namespace

static void* Allocated(std::size_t bytes) {
  void* memory = Granted() ? std::malloc(bytes > 0 ? bytes : 1) : nullptr;
  if (!memory) throw std::bad_alloc();
  return memory;
}

FailingNew::FailingNew(int granted) { granted_here = granted; }
FailingNew::~FailingNew() { granted_here = kAll; }

FailingNewElsewhere::FailingNewElsewhere() {
  spared = true;
  none_elsewhere = true;
}
FailingNewElsewhere::~FailingNewElsewhere() {
  none_elsewhere = false;
  spared = false;
}

}  // namespace kvx::testing_support

void* operator new(std::size_t bytes) { return kvx::testing_support::Allocated(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
