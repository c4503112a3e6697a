// Takes the place of the program's operators.
#include "tests/support/failing_new.h"

#include <algorithm>
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

// nullptr where there is none.
static void* Tried(std::size_t bytes) { return Granted() ? std::malloc(bytes > 0 ? bytes : 1) : nullptr; }
static void* Tried(std::size_t bytes, std::align_val_t alignment) {
  const auto align = std::size_t(alignment);
  return Granted() ? std::aligned_alloc(align, (std::max<std::size_t>(bytes, 1) + align - 1) / align * align)
                   : nullptr;
}
static void* OrThrown(void* memory) {
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

// All of them: what one kind gives another may take back, in libraries too, and sanitizers look for pairs.
using kvx::testing_support::OrThrown, kvx::testing_support::Tried;
using std::align_val_t, std::nothrow_t, std::size_t;

void* operator new(size_t bytes) { return OrThrown(Tried(bytes)); }
void* operator new[](size_t bytes) { return OrThrown(Tried(bytes)); }
void* operator new(size_t bytes, const nothrow_t&) noexcept { return Tried(bytes); }
void* operator new[](size_t bytes, const nothrow_t&) noexcept { return Tried(bytes); }
void* operator new(size_t bytes, align_val_t at) { return OrThrown(Tried(bytes, at)); }
void* operator new[](size_t bytes, align_val_t at) { return OrThrown(Tried(bytes, at)); }
void* operator new(size_t bytes, align_val_t at, const nothrow_t&) noexcept { return Tried(bytes, at); }
void* operator new[](size_t bytes, align_val_t at, const nothrow_t&) noexcept { return Tried(bytes, at); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, size_t, align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t, align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, align_val_t, const nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, align_val_t, const nothrow_t&) noexcept { std::free(memory); }
