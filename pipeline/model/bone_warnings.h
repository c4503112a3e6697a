// What a user is told about bones whose poses in a scan are in doubt.
#pragma once
#include <string>
#include <vector>

#include "core/bone.h"
#include "core/pose.h"

namespace kvx {

// A line for each doubtful bone with its reason, one that names the scan's uncertain bones, and one on how
// well its coarse bones are known.
std::vector<std::string> BoneWarnings(const std::string& scan, const BoneSet& bones, const BoneFits& fits);

// How well the coarse bones of a scan are known, together; empty where it has none.
std::string CoarseBonesText(const BoneSet& bones, const BoneFits& fits);

}  // namespace kvx
