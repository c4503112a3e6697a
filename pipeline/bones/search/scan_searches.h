// The ways to look for the bones in a scan: as it is, in other greys, from other sides, from other bones.
#pragma once
#include <map>
#include <string>

#include "kernels/device/backend.h"
#include "pipeline/bones/search/find_bones.h"

namespace kvx {

// What all searches of one scan share. Both images are without shading.
struct SearchScene {
  const Volume& template_volume;
  Volume scan;  // about as fine as the template
  const std::string &template_modality, &modality;
  double finest_mm;                                    // of the searches' voxels
  const std::map<std::string, RigidTransform>& hints;  // scan_from_template by bone name
  Backend& backend;
  const Progress& progress;
};

// By so much evidence a search is better than another for certain.
constexpr double kFarMoreNats = 12;

bool Succeeded(const FoundBones& found);  // at most half of the bones' voxels are in doubt
// A leg upside down has bones where it seeks them, but they match badly.
bool MayLieOtherwise(const FoundBones& found);
// Has succeeded, and by so much better that the scan is what that search took it to be.
bool FindsFarMore(const FoundBones& found, const FoundBones& than);

// As it is; then in other greys, from other sides and from other bones, until one way has succeeded.
FoundBones SearchEveryWay(const SearchScene& scene, const SoughtBones& sought);
// In its own greys from the root: as it is, and, where it may lie otherwise, from other sides.
FoundBones SearchFromAnySide(const SearchScene& scene, const SoughtBones& sought);

}  // namespace kvx
