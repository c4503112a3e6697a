// The intensity of air and its noise, read from a scan's histogram.
#pragma once
#include <optional>

#include "core/scan.h"

namespace kvx {

struct AirLevel {
  double air = 0;     // typical intensity of air
  double spread = 0;  // standard deviation of air
  double tissue = 0;  // typical intensity of what is not air
};

// `volume`: lightly smoothed. None when the scan shows no air: two classes whose darker one is no noise
// floor. Metal in CT counts as dense bone.
std::optional<AirLevel> FindAirLevel(const Volume& volume, const std::string& modality);

// Hounsfield units: by the file's word, or where it has none by what every CT shows: a hundredth of the
// voxels below -500 (air), tissue no denser than bone. A few voxels of air prove nothing: resampling by
// splines undershoots. Nor do many of one value where hardly a voxel is between that and -50 (fat, skin):
// tools fill corners.
bool IsHounsfield(const Volume& volume, const std::string& modality);

// Whether greys of which a file says CT are no Hounsfield units: hardly one is as light as fat, which is in
// every body. So it is where the rescale slope and intercept were lost on the way.
bool ContradictsCt(const Volume& volume);

// What no signal reads as. 0 but for images that a tool has shifted: all of their greys lie far above 0
// (signed numbers read as unsigned ones), or many below (signed or standardised greys).
double ZeroLevelOf(const Volume& mr);

// The zero level of a scan's other greys, where none that is scanned with them reads as `value`: it lies
// below zero and they do not, or farther beyond them than three times their range. Masked air of 0 may.
std::optional<double> ZeroInPlaceOf(float value, const Volume& scan);

// A magnitude image can be shaded; one with values far below zero, more than strays, is none (CT).
bool IsMagnitude(const Volume& volume);

// The threshold between the classes of least variance within (Otsu 1979). Values far from nearly all others
// count as less far ones.
double OtsuThreshold(const std::vector<float>& values);

}  // namespace kvx
