// Most scans of a hand at coarse voxels have many uncertain bones: one line for them, so that doubtful ones
// are seen.
#include "pipeline/model/bone_warnings.h"

namespace kvx {

std::vector<std::string> BoneWarnings(const std::string& scan, const std::vector<std::string>& bones,
                                      const BoneFits& fits) {
  std::vector<std::string> warnings;
  std::string uncertain;
  for (size_t j = 0; j < fits.size(); ++j) {
    if (fits[j].doubtful)
      warnings.push_back("scan '" + scan + "', bone '" + bones.at(j) + "' is doubtful: " + fits[j].note);
    else if (!fits[j].note.empty())
      uncertain += (uncertain.empty() ? "" : ", ") + bones.at(j);
  }
  if (!uncertain.empty())
    warnings.push_back("scan '" + scan +
                       "': these bones may be turned by more than a degree or lie half a voxel off; " +
                       "look before relying on them: " + uncertain);
  return warnings;
}

}  // namespace kvx
