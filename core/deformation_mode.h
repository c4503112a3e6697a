// How tissue follows the bones: by eq. 6 (EVD), which adds what the examples taught, or by eq. 2 (VBD) alone.
#pragma once
#include <string>

#include "core/errors.h"

namespace kvx {

enum class DeformationMode { kEvd, kVbd };

inline std::string NameOf(DeformationMode mode) { return mode == DeformationMode::kEvd ? "evd" : "vbd"; }

// "evd", "vbd"; throws InputError.
inline DeformationMode DeformationModeFromName(const std::string& name) {
  if (name == "evd") return DeformationMode::kEvd;
  if (name == "vbd") return DeformationMode::kVbd;
  throw InputError("'mode' is evd or vbd");
}

}  // namespace kvx
