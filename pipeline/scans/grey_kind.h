// What the greys of a scan are: Hounsfield units or not, magnitudes or not, and what no signal reads as.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"

namespace kvx {

constexpr double kCtAirHu = -500;  // CT: half way between air and water; a darker class above it is tissue

// Hounsfield units: by the file's word, or where it has none by what every CT shows: a hundredth of the
// voxels below -500 (air), tissue no denser than bone. A few voxels of air prove nothing: resampling by
// splines undershoots. Nor do many of one value where hardly a voxel is between that and -50 (fat, skin):
// tools fill corners. Nothing is lighter than air: greys all below -1024 are no Hounsfield units.
bool IsHounsfield(const Volume& volume, const std::string& modality);
bool IsHounsfield(const std::vector<float>& greys, const std::string& modality);  // of a sample of them

// Whether greys of which a file says CT are no Hounsfield units: hardly one is as light as fat, which is in
// every body, or hardly one as dense as air. So it is where the rescale slope and intercept were lost on the
// way.
bool ContradictsCt(const Volume& volume);

// What no signal reads as. 0 but for images that a tool has shifted: all of their greys lie far above 0
// (signed numbers read as unsigned ones), or many below (signed or standardised greys).
double ZeroLevelOf(const Volume& mr);
double ZeroLevelOf(std::vector<float> greys);  // of a sample of them

// The zero level of a scan's other greys, where none that is scanned with them reads as `value`: it lies
// below zero and they do not, or farther beyond them than three times their range. Masked air of 0 may.
std::optional<double> ZeroInPlaceOf(float value, const Volume& scan);

// A magnitude image can be shaded; one with values far below zero, more than strays, is none (CT).
bool IsMagnitude(const Volume& volume);

}  // namespace kvx
