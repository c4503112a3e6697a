// A value that a stage reads and nobody stores.
#pragma once
#include <memory>
#include <utility>

#include "pipeline/artifacts/stage_cache.h"

namespace kvx {

template <class T>
Artifact<T> Held(T value) {
  return {{}, std::make_shared<const T>(std::move(value))};
}

}  // namespace kvx
