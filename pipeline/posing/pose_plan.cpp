// Eigenposes are principal components of joint angles.
// The next scan is the pose that leaves least uncertainty, greedily.
#include "pipeline/posing/pose_plan.h"

#include <algorithm>

#include "core/errors.h"
#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr size_t kCandidates = 64;   // poses tried as the next scan
constexpr double kLeastGain = 1e-3;  // of a typical displacement: no scan is worth less

std::vector<double> Explained(const std::vector<JointAngles>& poses) {
  Eigen::MatrixXd rows(Eigen::Index(poses.size()), poses[0].size());
  for (size_t p = 0; p < poses.size(); ++p) rows.row(Eigen::Index(p)) = poses[p].transpose();
  rows.rowwise() -= rows.colwise().mean().eval();
  const Eigen::VectorXd variance = Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues().array().square();
  std::vector<double> out;
  double sum = 0;
  for (const double v : variance) {
    sum += v;
    out.push_back(variance.sum() > 0 ? std::min(1.0, sum / variance.sum()) : 1.0);
  }
  return out;
}

double MeanUncertainty(const PoseSpace& space, const std::vector<JointAngles>& poses) {
  double sum = 0;
  for (const JointAngles& pose : poses) sum += space.Uncertainty(pose).mean();
  return sum / double(poses.size());
}

}  // namespace

int EigenposesFor(const PosePlan& plan, double share) {
  for (size_t n = 0; n < plan.explained.size(); ++n) {
    if (plan.explained[n] >= share - 1e-12) return int(n) + 1;
  }
  return int(plan.explained.size());
}

PosePlan PlanPoses(const PoseSpace& space, const std::vector<JointAngles>& poses, int scans) {
  if (poses.empty()) throw InputError("the motions hold no pose");
  if (poses[0].size() == 0)
    throw InputError("none of the model's joints moves, so there is no pose to plan; see 'kinevox info'");
  PosePlan plan;
  plan.explained = Explained(poses);
  plan.uncertainty = MeanUncertainty(space, poses);
  PoseSpace known = space;
  double left = plan.uncertainty;
  const size_t step = (poses.size() + kCandidates - 1) / kCandidates;
  for (int n = 0; n < scans; ++n) {
    std::vector<double> after((poses.size() + step - 1) / step);
    ParallelFor(after.size(),
                [&](size_t c) { after[c] = MeanUncertainty(known.With(poses[c * step]), poses); });
    const size_t best = size_t(std::min_element(after.begin(), after.end()) - after.begin());
    if (after[best] > left - kLeastGain) break;
    left = after[best];
    plan.next.push_back({int(best * step), left});
    known = known.With(poses[best * step]);
  }
  return plan;
}

std::vector<JointAngles> AnglesAlong(const PoseResolver& model, const KeyFrames& frames, int most,
                                     std::vector<double>& times_s) {
  const Motion motion(model, frames, DeformationMode::kVbd);
  const int count = frames.FrameCount(), step = (count + most - 1) / most;
  std::vector<JointAngles> out;
  for (int f = 0; f < count; f += step) {
    times_s.push_back(frames.TimeOf(f));
    out.push_back(motion.AnglesAt(times_s.back()));
  }
  return out;
}

}  // namespace kvx
