// How tissue follows the bones: by eq. 6 (EVD), which adds what the examples taught; by eq. 2 (VBD) alone; or
// by EVD and, between the examples, as elastic tissue comes to rest at the very pose.
#pragma once
#include <string>
#include <utility>

#include "core/errors.h"

namespace kvx {

enum class DeformationMode { kEvd, kVbd, kElastic };

inline constexpr std::pair<DeformationMode, const char*> kDeformationModes[] = {
    {DeformationMode::kVbd, "vbd"}, {DeformationMode::kEvd, "evd"}, {DeformationMode::kElastic, "elastic"}};

inline std::string NameOf(DeformationMode wanted) {
  for (const auto& [mode, name] : kDeformationModes)
    if (mode == wanted) return name;
  return {};
}

// "evd", "vbd", "elastic"; throws InputError.
inline DeformationMode DeformationModeFromName(const std::string& wanted) {
  for (const auto& [mode, name] : kDeformationModes)
    if (name == wanted) return mode;
  throw InputError("'mode' is evd, vbd or elastic");
}

}  // namespace kvx
