// A similarity's measures in documents: of a model, of an evaluation, of `kinevox info`.
#pragma once
#include <nlohmann/json.hpp>

#include "core/measures.h"

namespace kvx {

// {"ssd", "cc", "mi"}
inline nlohmann::ordered_json ToJson(const Measures& m) {
  return {{"ssd", m.ssd}, {"cc", m.cc}, {"mi", m.mi}};
}

}  // namespace kvx
