// Places. World is LPS millimetres (as DICOM and ITK);
// voxel coordinates belong to one grid, integers at voxel centres.
#pragma once
#include <Eigen/Dense>

namespace kvx {

struct PointMm {
  Eigen::Vector3d lps = Eigen::Vector3d::Zero();
};
struct PointVox {
  Eigen::Vector3d ijk = Eigen::Vector3d::Zero();
};

constexpr double kPi = 3.14159265358979323846;
constexpr double RadFromDeg(double degrees) { return degrees * (kPi / 180.0); }
constexpr double DegFromRad(double radians) { return radians * (180.0 / kPi); }

}  // namespace kvx
