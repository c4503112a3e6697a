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

// The threshold between the classes of least variance within (Otsu 1979). Values far from nearly all others
// count as less far ones.
double OtsuThreshold(const std::vector<float>& values);

}  // namespace kvx
