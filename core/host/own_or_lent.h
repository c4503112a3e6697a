// What a function has made, or was given and hands on as it is, without a copy.
#pragma once
#include <optional>
#include <utility>

namespace kvx {

// What is lent has to outlive it.
template <class T>
class OwnOrLent {
 public:
  OwnOrLent(T&& own) : own_(std::move(own)) {}
  OwnOrLent(const T& lent) : lent_(&lent) {}
  const T& operator*() const { return own_ ? *own_ : *lent_; }
  const T* operator->() const { return &**this; }
  bool lent() const { return lent_ != nullptr; }
  // A copy of what is lent.
  T Taken() && { return own_ ? std::move(*own_) : *lent_; }

 private:
  std::optional<T> own_;
  const T* lent_ = nullptr;
};

}  // namespace kvx
