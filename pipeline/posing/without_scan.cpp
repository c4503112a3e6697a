// A smaller pose space, its coefficients put back in their places with a zero for the scan left out.
#include "pipeline/posing/without_scan.h"

namespace kvx {

ResolvedPose ResolveWithout(const PoseResolver& model, const PoseSpaceOptions& options,
                            const ExampleMoments& moments, int scan) {
  SkeletonFit fit = model.fit;
  std::vector<std::string> names = model.scan_names;
  std::vector<PoseVector> others = model.scan_poses;
  fit.scan_angles.erase(fit.scan_angles.begin() + scan);
  fit.scan_residuals.erase(fit.scan_residuals.begin() + scan);
  fit.scan_roots.erase(fit.scan_roots.begin() + scan);
  names.erase(names.begin() + scan);
  others.erase(others.begin() + scan);
  const PoseSpace space(fit, options, moments.Without(scan));
  const BoneResiduals none;  // bones are where they are asked to be
  BonePose bones;
  for (size_t j = 0; j < model.bone_names.size(); ++j)
    bones.scan_from_template[model.bone_names[j]] = model.scan_poses[size_t(scan)][j];
  ResolvedPose pose =
      PoseResolver{model.bone_names, names, model.template_scan, fit, others, space, none}.Resolve(
          bones, DeformationMode::kEvd);
  Eigen::MatrixXf wide = Eigen::MatrixXf::Zero(pose.coefficients.rows(), pose.coefficients.cols() + 1);
  wide.leftCols(scan) = pose.coefficients.leftCols(scan);
  wide.rightCols(pose.coefficients.cols() - scan) =
      pose.coefficients.rightCols(pose.coefficients.cols() - scan);
  pose.coefficients = wide;
  return pose;
}

}  // namespace kvx
