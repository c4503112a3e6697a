// Each example predicted from the others, as far as the pose space decides it.
#include "pipeline/evaluate/leave_one_out.h"

namespace kvx {
namespace {

constexpr size_t kPoints = 20000;  // body voxels looked at, spread evenly in memory order

// `scan` taken out: a smaller pose space, its coefficients put back in their places with a zero for the scan
// left out.
ResolvedPose ResolveWithout(const Model& model, int scan, const std::vector<PoseVector>& poses,
                            DeformationMode mode) {
  SkeletonFit fit = model.fit();
  std::vector<std::string> names = model.scan_names();
  std::vector<PoseVector> others = poses;
  fit.scan_angles.erase(fit.scan_angles.begin() + scan);
  fit.scan_residuals.erase(fit.scan_residuals.begin() + scan);
  fit.scan_roots.erase(fit.scan_roots.begin() + scan);
  names.erase(names.begin() + scan);
  others.erase(others.begin() + scan);
  const PoseSpace space(fit, {}, model.moments().Without(scan));
  const PoseResolver resolver{model.bone_names(), names, model.manifest().template_scan, fit, others, space};
  BonePose bones;
  for (size_t j = 0; j < model.bone_names().size(); ++j)
    bones.scan_from_template[model.bone_names()[j]] = poses[size_t(scan)][j];
  ResolvedPose pose = resolver.Resolve(bones, mode);
  Eigen::MatrixXf wide = Eigen::MatrixXf::Zero(pose.coefficients.rows(), pose.coefficients.cols() + 1);
  wide.leftCols(scan) = pose.coefficients.leftCols(scan);
  wide.rightCols(pose.coefficients.cols() - scan) =
      pose.coefficients.rightCols(pose.coefficients.cols() - scan);
  pose.coefficients = wide;
  return pose;
}

std::vector<PointMm> BodyPoints(const Mask& body) {
  std::vector<PointMm> points;
  for (const size_t v : SpreadVoxels(body, kPoints))
    points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
  return points;
}

double MeanDistance(const std::vector<PointMm>& a, const std::vector<PointMm>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i].lps - b[i].lps).norm();
  return a.empty() ? 0.0 : sum / double(a.size());
}

}  // namespace

std::vector<LeftOutEvaluation> LeaveOneOut(const Model& model, const PosingEngine& engine,
                                           const Progress& progress) {
  const std::vector<PointMm> points = BodyPoints(model.body());
  std::vector<PoseVector> poses;
  for (const BoneFits& fits : model.scan_fits()) poses.push_back(PoseOf(fits));
  std::vector<LeftOutEvaluation> out;
  for (int k = 0; k < int(poses.size()); ++k) {
    progress.Report("leave one out", double(k) / double(poses.size()));
    const Artifact<RegisteredScan> registered = model.LoadRegistered(k);
    const Grid& grid = registered->scan_from_template.grid;
    std::vector<PointMm> reached = points;
    for (PointMm& x : reached) x.lps += SampleTrilinear(registered->scan_from_template, grid.ToVox(x));
    LeftOutEvaluation row{model.scan_names()[size_t(k)], {}};
    for (const auto& [mode, name] : kDeformationModes) {
      const ResolvedPose pose = ResolveWithout(model, k, poses, mode);
      row.distance_mm[mode] = MeanDistance(reached, engine.MapPoints(pose, points));
    }
    out.push_back(row);
  }
  return out;
}

}  // namespace kvx
