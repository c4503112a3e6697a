// Rounds of damped Gauss-Newton steps; every round sees the poses of the round before, so bones run side by
// side.
#include "pipeline/bones/refine/articulated_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "core/host/parallel.h"
#include "core/local_motion.h"
#include "pipeline/bones/refine/bone_problem.h"

namespace kvx {
namespace {

constexpr int kRounds = 3, kMostRounds = 12, kSteps = 8;
constexpr double kAtRestVoxels = 0.2;  // a bone that a round moves farther is still on its way

double Length(const Twist& step, double radius_mm) {
  return std::max(step.tail<3>().norm(), step.head<3>().norm() * radius_mm);
}

RigidTransform Fitted(const BoneTissue& tissue, RigidTransform pose, BoneProblem& problem) {
  problem.Look(pose);
  for (int n = 0; n < kSteps; ++n) {
    problem.Trust();
    BoneProblem::Row right;
    const BoneProblem::Normal normal = problem.Equations(right);
    BoneProblem::Row step = normal.ldlt().solve(right);
    const double length = Length(step.head<6>(), tissue.radius_mm), limit_mm = 0.5 * tissue.voxel_mm;
    if (!std::isfinite(length)) break;
    if (length > limit_mm) step *= limit_mm / length;
    pose = MovedLocally(pose, step.head<6>(), tissue.centre);
    problem.Look(pose);
    if (length < 1e-3 * tissue.voxel_mm) break;
  }
  return pose;
}

BoneEstimate FitOne(const BoneTissue& tissue, BoneProblem& problem, const RigidTransform& from,
                    const RigidTransform& start, double reach_mm, bool last) {
  BoneEstimate out{Fitted(tissue, from, problem)};
  const Twist off = LocalMotion(start, out.scan_from_template, tissue.centre);
  out.left_reach = Length(off, tissue.radius_mm) > reach_mm;
  if (out.left_reach) out.scan_from_template = start;
  if (!last) return out;
  out.covariance = problem.Covariance();
  if (out.left_reach) {
    out.covariance += off * off.transpose();
    problem.Look(start);
  }
  out.correlation = problem.Correlation();
  out.seen = problem.SeenPart();
  return out;
}

}  // namespace

std::vector<BoneEstimate> FitArticulated(const std::vector<BoneTissue>& tissue,
                                         const CubicImage& template_image, const CubicImage& scan,
                                         const PoseVector& start, const std::vector<double>& reach_mm,
                                         const std::vector<bool>& in_doubt) {
  PoseVector poses = start;
  std::vector<BoneEstimate> fits(tissue.size());
  bool at_rest = false;
  for (int round = 0; round < kRounds || (!at_rest && round < kMostRounds); ++round) {
    ParallelFor(tissue.size(), [&](size_t b) {
      BoneProblem problem(tissue[b], template_image, scan, poses, int(b));
      fits[b] = FitOne(tissue[b], problem, poses[b], start[b], reach_mm[b], round + 1 >= kRounds);
    });
    at_rest = true;
    for (size_t b = 0; b < tissue.size(); ++b) {
      const Twist moved = LocalMotion(poses[b], fits[b].scan_from_template, tissue[b].centre);
      poses[b] = fits[b].scan_from_template;
      const bool rests = Length(moved, tissue[b].radius_mm) <= kAtRestVoxels * tissue[b].voxel_mm;
      if (rests || (!in_doubt.empty() && in_doubt[b])) continue;
      fits[b].covariance += moved * moved.transpose();
      at_rest = false;
    }
  }
  return fits;
}

}  // namespace kvx
