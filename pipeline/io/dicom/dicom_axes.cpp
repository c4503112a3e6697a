// An entry that is off by r turns neither axis by more than sqrt(3) r, nor their normal by more than
// sqrt(6) r; lengths and angles of two such axes are off by 2 sqrt(3) r at most.
#include "pipeline/io/dicom/dicom_axes.h"

#include <Eigen/SVD>
#include <cmath>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr double kUsualRounding = 1e-2;  // of what axes are to each other, in headers with many digits

bool AllMultiplesOf(double unit, const DicomFrame& frame) {
  Eigen::Matrix<double, 6, 1> in_units;
  in_units << frame.along_row / unit, frame.along_column / unit;
  return (in_units - in_units.array().round().matrix()).cwiseAbs().maxCoeff() < 1e-6;
}

// How far an entry may be from what was meant: of two to four digits. Whole numbers are meant as they are.
double RoundingOf(const DicomFrame& frame) {
  if (AllMultiplesOf(1.0, frame)) return 0;
  for (const double unit : {1e-2, 1e-3, 1e-4})
    if (AllMultiplesOf(unit, frame)) return unit / 2;
  return 0;
}

Eigen::Vector3d Beside(const Eigen::Vector3d& normal, const Eigen::Vector3d& axis) {
  return axis - normal * normal.dot(axis);
}

}  // namespace

Eigen::Matrix3d AxesOf(const DicomFrame& frame, const Eigen::Vector3d& along_slices) {
  const Eigen::Vector3d normal = frame.along_row.cross(frame.along_column).normalized();
  const Eigen::Vector3d across = along_slices.normalized();
  const double rounding = RoundingOf(frame);
  Eigen::Matrix3d axes;
  axes << frame.along_row, frame.along_column, normal;
  if (rounding > 0 && normal.dot(across) > 0 && normal.cross(across).norm() <= std::sqrt(6) * rounding)
    axes << Beside(across, frame.along_row), Beside(across, frame.along_column), across;
  if (!(axes.transpose() * axes).isIdentity(std::max(kUsualRounding, 2 * std::sqrt(3) * rounding))) {
    throw InputError(
        "the DICOM series gives axes that are not at right angles; export it again or convert it to NIfTI");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();  // the nearest ones at right angles
}

}  // namespace kvx
