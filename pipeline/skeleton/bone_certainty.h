// How well the pose of a bone in a scan is known: as numbers, and as one of four words.
#pragma once
#include <string>
#include <string_view>

#include "core/bone.h"
#include "core/pose.h"

namespace kvx {

// Standard deviations of the turn about the axis that is known least, of the centroid, and of the surface
// where it is known least (the middles of the box's faces; both root mean squares of a distance).
double WeakestTurnRad(const BoneFit& fit);
double CentreSdMm(const BoneFit& fit);
double SurfaceSdMm(const Bone& bone, const BoneFit& fit);
// Of a place that goes with the bone, summed over the axes; where it lies is given in the template's frame.
double PlaceVarianceMm2(const BoneFit& fit, const Eigen::Vector3d& from_centroid_mm);

// What turn and surface stay within in 19 scans of 20.
struct PoseBounds {
  double turn_rad = 0, surface_mm = 0;
};
PoseBounds BoundsOf(const Bone& bone, const BoneFit& fit);
std::string Text(const PoseBounds& bounds);  // part of a sentence

// A pose is right when the bone's turn is so to 1.5 degrees (of bones of 300 voxels and more; a smaller one's
// shows in its surface only) and its surface to half a voxel.
enum class Certainty {
  kSure,       // right by three standard deviations
  kCoarse,     // as the scan's voxels and noise allow: most likely right, and within its bounds
  kUncertain,  // one in ten such bones is not right
  kDoubtful,   // it may be somewhere else altogether
};
Certainty CertaintyOf(const Bone& bone, const BoneFit& fit, double voxel_mm);
std::string_view NameOf(Certainty certainty);

}  // namespace kvx
