// What happens in the middle of something: a fake lets it happen where the real part takes its time.
#pragma once
#include <functional>
#include <mutex>
#include <utility>

namespace kvx::testing_support {

// Happens once.
class Meanwhile {
 public:
  Meanwhile& operator=(std::function<void()> act) {
    const std::lock_guard lock(mutex_);
    act_ = std::move(act);
    return *this;
  }
  void Happen() {
    std::function<void()> act;
    {
      const std::lock_guard lock(mutex_);
      act = std::exchange(act_, nullptr);
    }
    if (act) act();
  }

 private:
  std::mutex mutex_;
  std::function<void()> act_;
};

}  // namespace kvx::testing_support
