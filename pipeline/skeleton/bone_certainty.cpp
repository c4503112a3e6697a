// Errors are taken to be normal, with the spread that the refinement and the joints leave.
#include "pipeline/skeleton/bone_certainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kvx {
namespace {

constexpr double kRightTurnRad = RadFromDeg(1.5);
constexpr size_t kTurnShowsVoxels = 300;
constexpr double kRightSurfaceVoxels = 0.5;
// Standard deviations that stay within a limit in 9 of 10 cases, in 19 of 20, and as good as always.
constexpr double kNineOfTen = 1.645, kNineteenOfTwenty = 2.0, kAlways = 3.0;

bool TurnIsRightBy(double deviations, const BoneFit& fit) {
  return deviations * WeakestTurnRad(fit) <= kRightTurnRad;
}

bool SurfaceIsRightBy(double deviations, const Bone& bone, const BoneFit& fit, double voxel_mm) {
  return deviations * SurfaceSdMm(bone, fit) <= kRightSurfaceVoxels * voxel_mm;
}

bool IsMostLikelyRight(const Bone& bone, const BoneFit& fit, double voxel_mm) {
  const bool turn_shows = bone.voxels >= kTurnShowsVoxels;
  return (!turn_shows || TurnIsRightBy(kNineOfTen, fit)) && SurfaceIsRightBy(kNineOfTen, bone, fit, voxel_mm);
}

// Few voxels make no bone surer: its turn has to be right however small it is.
bool IsSurelyRight(const Bone& bone, const BoneFit& fit, double voxel_mm) {
  return TurnIsRightBy(kAlways, fit) && SurfaceIsRightBy(kAlways, bone, fit, voxel_mm);
}

}  // namespace

double WeakestTurnRad(const BoneFit& fit) {
  const Eigen::Matrix3d turns = fit.covariance.topLeftCorner<3, 3>();
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turns).eigenvalues()[2]));
}

double CentreSdMm(const BoneFit& fit) {
  return std::sqrt(std::max(0.0, fit.covariance.bottomRightCorner<3, 3>().trace()));
}

double SurfaceSdMm(const Bone& bone, const BoneFit& fit) {
  double most = 0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d face_mm = 0.5 * bone.box.extent_mm[a] * bone.box.axes.col(a);
    most = std::max({most, PlaceVarianceMm2(fit, face_mm), PlaceVarianceMm2(fit, -face_mm)});
  }
  return std::sqrt(most);
}

double PlaceVarianceMm2(const BoneFit& fit, const Eigen::Vector3d& from_centroid_mm) {
  Eigen::Matrix<double, 3, 6> moves;  // of the place, by turn and shift
  for (int a = 0; a < 3; ++a) moves.col(a) = Eigen::Vector3d::Unit(a).cross(from_centroid_mm);
  moves.rightCols<3>().setIdentity();
  return (moves * fit.covariance * moves.transpose()).trace();
}

PoseBounds BoundsOf(const Bone& bone, const BoneFit& fit) {
  const double all_turns_rad = std::sqrt(std::max(0.0, fit.covariance.topLeftCorner<3, 3>().trace()));
  return {std::min(kPi, kNineteenOfTwenty * all_turns_rad), kNineteenOfTwenty * SurfaceSdMm(bone, fit)};
}

std::string Text(const PoseBounds& bounds) {
  char text[120];
  std::snprintf(text, sizeof text,
                "turned by up to %.1f degrees, the surface up to %.1f mm off (19 times in 20)",
                DegFromRad(bounds.turn_rad), bounds.surface_mm);
  return text;
}

Certainty CertaintyOf(const Bone& bone, const BoneFit& fit, double voxel_mm) {
  if (fit.Doubtful()) return Certainty::kDoubtful;
  if (!IsMostLikelyRight(bone, fit, voxel_mm)) return Certainty::kUncertain;
  return IsSurelyRight(bone, fit, voxel_mm) ? Certainty::kSure : Certainty::kCoarse;
}

std::string_view NameOf(Certainty certainty) {
  switch (certainty) {
    case Certainty::kSure:
      return "sure";
    case Certainty::kCoarse:
      return "coarse";
    case Certainty::kUncertain:
      return "uncertain";
    default:
      return "doubtful";
  }
}

}  // namespace kvx
