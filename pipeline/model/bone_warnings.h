// What a user is told about bones whose poses in a scan are in doubt.
#pragma once
#include <string>
#include <vector>

#include "core/pose.h"

namespace kvx {

// A line for each doubtful bone with its reason, and one for all uncertain bones of the scan.
// `bones`: names, index as in `fits`.
std::vector<std::string> BoneWarnings(const std::string& scan, const std::vector<std::string>& bones,
                                      const BoneFits& fits);

}  // namespace kvx
