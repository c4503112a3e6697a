// Expectation maximisation on linearised poses: settle every scan, then measure how far its joints stray.
#include "pipeline/skeleton/joint_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/joint_values.h"
#include "core/local_motion.h"
#include "pipeline/skeleton/joint_angles.h"
#include "pipeline/skeleton/joint_axes.h"
#include "pipeline/skeleton/joint_chain.h"

namespace kvx {
namespace {

constexpr int kMostRounds = 30;
constexpr double kAtRest = 0.01;  // part of itself: a round that moves no stray farther is the last one
constexpr int kFewestScans = 3;   // fewer cannot tell a joint from an accident
constexpr double kFirstStrayRad = RadFromDeg(2), kFirstStrayMm = 1.0;
constexpr double kLeastStrayRad = RadFromDeg(0.5), kLeastStrayMm = 0.2;
constexpr double kPooled = 6;       // observations that the mean over all joints counts as
constexpr double kTailDegrees = 4;  // of Student's t: a scan that strays far pulls and counts less
constexpr double kFreeRad = 1;      // spread of an axis's direction that nothing speaks of
constexpr double kFloorRad = RadFromDeg(0.05), kFloorMm = 0.02;  // no estimate is better than this

Eigen::Matrix<double, 6, 6> WithFloor(Eigen::Matrix<double, 6, 6> covariance) {
  covariance.diagonal().head<3>().array() += kFloorRad * kFloorRad;
  covariance.diagonal().tail<3>().array() += kFloorMm * kFloorMm;
  return covariance;
}

// Small turns only: the least information is that of a radian.
Eigen::Matrix3d NoFartherThanFree(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d parts = covariance / (kFreeRad * kFreeRad) + Eigen::Matrix3d::Identity();
  return parts.ldlt().solve(covariance);
}

// Standard deviation from a sum of squares, drawn towards the mean square over all joints.
double Pooled(double squares, double count, double mean_square) {
  return std::sqrt((squares + kPooled * mean_square) / (count + kPooled));
}

// Whether that is hardly a move.
bool MoveTo(double value, double& stray) {
  const double before = std::exchange(stray, value);
  return std::abs(value - before) <= kAtRest * before;
}

}  // namespace

// Rows: how the joint strays (across its axes in rad, then its centre in mm); columns of the Jacobians: the
// local motions of parent and child, and a small turn of all axes.
struct SettledPoses::Stray {
  Eigen::VectorXd value;
  Eigen::MatrixXd by_parent, by_child;  // rows x 6
  Eigen::MatrixXd by_axes;              // rows x 3
  Eigen::MatrixXd ByPair() const {      // child and parent together
    return (Eigen::MatrixXd(value.size(), 12) << by_child, by_parent).finished();
  }
  int turns = 0;  // first rows
};

struct SettledPoses::Settled {
  size_t scan;
  Stray stray;
  Eigen::MatrixXd spread, by_axes;                    // of the stray; with the bones following
  Eigen::Matrix3d of_axes = Eigen::Matrix3d::Zero();  // information
};

bool SettledPoses::Applies(const BoneFits& scan, int bone) const {
  const int parent = bones_.bones[bone].parent;
  return parent != kNoParent && joints_[bone].known && !scan[bone].Doubtful() && !scan[parent].Doubtful();
}

SettledPoses::Stray SettledPoses::StrayOf(const BoneFits& scan, int bone) const {
  const JointModel& joint = joints_[bone];
  const int parent = bones_.bones[bone].parent;
  const Eigen::Vector3d child_centre = bones_.bones[bone].centroid.lps,
                        parent_centre = bones_.bones[parent].centroid.lps;
  const RigidTransform motion = scan[parent].scan_from_template.Inverse() * scan[bone].scan_from_template;
  const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
  const Eigen::VectorXd angles = AnglesOf(joint.axes, motion.rotation);
  const int dofs = int(joint.axes.size());
  Eigen::Quaterniond product = Eigen::Quaterniond::Identity();
  Eigen::Matrix3Xd free(3, dofs);  // directions that the joint turns freely, in the child
  for (int d = dofs - 1; d >= 0; --d) {
    free.col(d) = product.conjugate() * joint.axes[d];
    product = Eigen::AngleAxisd(angles[d], joint.axes[d]) * product;
  }
  Eigen::MatrixXd held(3, 3 - dofs);
  if (dofs == 0) {
    held = Eigen::Matrix3d::Identity();
  } else {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr{Eigen::MatrixXd(free)};
    held = Eigen::MatrixXd(qr.householderQ() * Eigen::Matrix3d::Identity()).rightCols(3 - dofs);
  }
  const Eigen::Vector3d centre = joint.centre.lps, moved = (motion * joint.centre).lps;
  Stray out;
  out.turns = 3 - dofs;
  out.value.resize(out.turns + 3);
  out.value << held.transpose() * RotationVector(product.conjugate() * motion.rotation), moved - centre;
  // As if nothing strayed: a hinge that turns about itself is the same.
  out.by_axes = Eigen::MatrixXd::Zero(out.turns + 3, 3);
  out.by_axes.topRows(out.turns) =
      held.transpose() * (Eigen::Matrix3d::Identity() - product.conjugate().toRotationMatrix());
  out.by_child = out.by_parent = Eigen::MatrixXd::Zero(out.turns + 3, 6);
  out.by_child.topLeftCorner(out.turns, 3) = held.transpose();
  out.by_parent.topLeftCorner(out.turns, 3) = -held.transpose() * rotation.transpose();
  out.by_child.bottomRows(3) << -rotation * Skew(centre - child_centre), rotation;
  out.by_parent.bottomRows(3) << Skew(moved - parent_centre), -Eigen::Matrix3d::Identity();
  return out;
}

SettledPoses::SettledPoses(const BoneSet& bones, const std::vector<JointPlan>& plans,
                           const std::vector<const BoneFits*>& measured)
    : bones_(bones), plans_(plans), measured_(measured) {
  for (const BoneFits* scan : measured) settled_.push_back(*scan);
  covariance_.resize(measured.size());
  trust_.assign(measured.size(), std::vector<double>(bones.size(), 1.0));
  joints_.resize(bones.size());
  usual_centres_.resize(bones.size());
  without_joint_.assign(measured.size(), std::vector<RelativeMotion>(joints_.size()));
  for (int b = 0; b < bones.size(); ++b) {
    const Bone& bone = bones.bones[b];
    if (bone.parent == kNoParent) continue;
    usual_centres_[b] = UsualCentre(bones, b, plans[b].turns_about_head);
    joints_[b].stray_rad = kFirstStrayRad, joints_[b].stray_mm = kFirstStrayMm;
    for (size_t k = 0; k < measured.size(); ++k)
      without_joint_[k][size_t(b)] = MotionOf(settled_[k][bone.parent], settled_[k][b], 1);
  }
  bool at_rest = false;
  for (int round = 0; round < kMostRounds && !at_rest; ++round) {
    FitJoints();
    for (size_t k = 0; k < settled_.size(); ++k) SettleScan(k);
    at_rest = MeasureStray();
  }
  for (size_t k = 0; k < settled_.size(); ++k) AddAxisSpread(k);
}

void SettledPoses::FitJoints() {
  std::vector<std::vector<RelativeMotion>> all_measured(joints_.size());
  for (int b = 0; b < bones_.size(); ++b) {
    const int parent = bones_.bones[b].parent;
    if (parent == kNoParent || !plans_[b].driver.empty()) continue;
    // The axes from what is known without them, each scan by what it knows; the centre from where the bones
    // are put.
    std::vector<RelativeMotion> motions, measured;
    for (size_t k = 0; k < settled_.size(); ++k) {
      const BoneFits& scan = settled_[k];
      if (scan[b].Doubtful() || scan[parent].Doubtful()) continue;
      motions.push_back(MotionOf(scan[parent], scan[b], trust_[k][b]));
      measured.push_back(without_joint_[k][size_t(b)]);
      measured.back().weight = trust_[k][b];
      measured.back().play_rad = joints_[b].stray_rad;
    }
    JointModel& joint = joints_[b];
    const bool shifts = plans_[b].dofs.size() > kMostTurns;  // free in all directions
    joint.known = int(motions.size()) >= kFewestScans && !shifts;
    joint.centre = FitCentre(motions, usual_centres_[b]);
    all_measured[b] = std::move(measured);
  }
  const std::vector<FittedAxes> fitted = FitAllAxes(bones_, plans_, all_measured);
  for (int b = 0; b < bones_.size(); ++b) {
    joints_[b].axes.clear();
    for (int d = 0; d < TurnsAmong(plans_[b].dofs.size()); ++d)
      joints_[b].axes.push_back(fitted[size_t(b)].axes.col(d));
    joints_[b].axis_spread = NoFartherThanFree(fitted[size_t(b)].covariance);
  }
}

// Of small motions of all bones of a scan, each about its own centroid: normal * motions = right.
struct SettledPoses::Equations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

// Each bone where it was measured, as surely as it was.
void SettledPoses::AddMeasured(size_t k, Equations& out) const {
  const BoneFits &measured = *measured_[k], &scan = settled_[k];
  for (int b = 0; b < bones_.size(); ++b) {
    const Eigen::Matrix<double, 6, 6> information =
        WithFloor(measured[b].covariance).ldlt().solve(Eigen::Matrix<double, 6, 6>::Identity());
    const Twist off =
        LocalMotion(scan[b].scan_from_template, measured[b].scan_from_template, bones_.bones[b].centroid);
    out.normal.block<6, 6>(6 * b, 6 * b) += information;
    out.right.segment<6>(6 * b) += information * off;
  }
}

// Each joint as all scans show it, as closely as they keep to it.
void SettledPoses::AddJoints(size_t k, Equations& out) const {
  const BoneFits& scan = settled_[k];
  for (int b = 0; b < bones_.size(); ++b) {
    if (!Applies(scan, b)) continue;
    const int p = bones_.bones[b].parent;
    const Stray stray = StrayOf(scan, b);
    const Eigen::VectorXd certainty = CertaintyOf(k, b, stray);
    const auto weight = certainty.asDiagonal();
    out.normal.block<6, 6>(6 * b, 6 * b) += stray.by_child.transpose() * weight * stray.by_child;
    out.normal.block<6, 6>(6 * p, 6 * p) += stray.by_parent.transpose() * weight * stray.by_parent;
    const Eigen::MatrixXd mixed = stray.by_child.transpose() * weight * stray.by_parent;
    out.normal.block<6, 6>(6 * b, 6 * p) += mixed;
    out.normal.block<6, 6>(6 * p, 6 * b) += mixed.transpose();
    out.right.segment<6>(6 * b) -= stray.by_child.transpose() * weight * stray.value;
    out.right.segment<6>(6 * p) -= stray.by_parent.transpose() * weight * stray.value;
  }
}

// One for each row of a stray.
Eigen::VectorXd SettledPoses::CertaintyOf(size_t k, int b, const Stray& stray) const {
  Eigen::VectorXd certainty(stray.value.size());
  certainty.head(stray.turns).setConstant(1 / (joints_[b].stray_rad * joints_[b].stray_rad));
  certainty.tail(3).setConstant(1 / (joints_[b].stray_mm * joints_[b].stray_mm));
  return certainty * trust_[k][b];
}

// Gauss-Newton: the measured poses with their covariances against the joints with theirs.
void SettledPoses::SettleScan(size_t k) {
  constexpr int kSteps = 3;
  const int size = 6 * bones_.size();
  BoneFits& scan = settled_[k];
  Eigen::MatrixXd normal;
  for (int step = 0; step < kSteps; ++step) {
    Equations equations{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    AddMeasured(k, equations);
    AddJoints(k, equations);
    const Eigen::VectorXd move = equations.normal.ldlt().solve(equations.right);
    for (int b = 0; b < bones_.size(); ++b) {
      if (scan[b].Doubtful()) continue;
      scan[b].scan_from_template =
          MovedLocally(scan[b].scan_from_template, move.segment<6>(6 * b), bones_.bones[b].centroid);
    }
    normal = std::move(equations.normal);
  }
  covariance_[k] = normal.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
  for (int b = 0; b < bones_.size(); ++b) {
    if (!scan[b].Doubtful()) scan[b].covariance = covariance_[k].block<6, 6>(6 * b, 6 * b);
    if (bones_.bones[b].parent != kNoParent) without_joint_[k][size_t(b)] = WithoutJoint(k, b);
  }
}

// Of a bone and its parent.
Eigen::Matrix<double, 12, 12> SettledPoses::SpreadOfPair(size_t k, int b) const {
  const int at[2] = {6 * b, 6 * bones_.bones[b].parent};
  Eigen::Matrix<double, 12, 12> both;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) both.block<6, 6>(6 * i, 6 * j) = covariance_[k].block<6, 6>(at[i], at[j]);
  }
  return both;
}

// What the joint has said of its bones is taken back: its own axes are fitted to what is left.
RelativeMotion SettledPoses::WithoutJoint(size_t k, int b) const {
  using Pair = Eigen::Matrix<double, 12, 12>;
  const int p = bones_.bones[b].parent;
  const BoneFits& scan = settled_[k];
  Pair spread = SpreadOfPair(k, b);
  Eigen::Matrix<double, 12, 1> move = Eigen::Matrix<double, 12, 1>::Zero();
  if (Applies(scan, b)) {
    const Stray stray = StrayOf(scan, b);
    const Eigen::MatrixXd by = stray.ByPair(), said = by.transpose() * CertaintyOf(k, b, stray).asDiagonal();
    const Pair rest = spread.inverse() - Pair(said * by);
    spread = rest.ldlt().solve(Pair::Identity());
    move = spread * (said * stray.value);
  }
  const auto at = [&](int bone, const Twist& by) {
    return MovedLocally(scan[bone].scan_from_template, by, bones_.bones[bone].centroid);
  };
  RelativeMotion out{at(p, move.tail<6>()).Inverse() * at(b, move.head<6>())};
  Eigen::Matrix<double, 3, 12> by_turns = Eigen::Matrix<double, 3, 12>::Zero();
  by_turns.leftCols<3>().setIdentity();
  by_turns.middleCols<3>(6) = -out.motion.rotation.toRotationMatrix().transpose();
  out.turn_spread = by_turns * spread * by_turns.transpose();
  return out;
}

// A joint's stray in a settled scan and how well that is known. An axis that lies elsewhere takes the bones
// along in part; the rest is stray.
SettledPoses::Settled SettledPoses::SettledStray(size_t k, int b) const {
  Settled out{k, StrayOf(settled_[k], b)};
  const Eigen::MatrixXd by = out.stray.ByPair();
  out.spread = by * SpreadOfPair(k, b) * by.transpose();
  const Eigen::MatrixXd weighted = CertaintyOf(k, b, out.stray).asDiagonal() * out.stray.by_axes;
  out.by_axes = out.stray.by_axes - out.spread * weighted;
  out.of_axes = weighted.transpose() * out.by_axes;
  return out;
}

// Expected squares of a joint's strays, and what each scan is to be trusted.
SettledPoses::Squares SettledPoses::ExpectedSquares(int b) {
  std::vector<Settled> scans;
  Eigen::Matrix3d of_axes = Eigen::Matrix3d::Identity() / (kFreeRad * kFreeRad);
  for (size_t k = 0; k < settled_.size(); ++k) {
    if (!Applies(settled_[k], b)) continue;
    scans.push_back(SettledStray(k, b));
    of_axes += scans.back().of_axes;
  }
  const Eigen::Matrix3d axis_spread = of_axes.inverse();
  Squares out;
  for (const auto& [k, stray, spread, by_axes, information] : scans) {
    const Eigen::VectorXd expected = stray.value.cwiseAbs2() + spread.diagonal() +
                                     (by_axes * axis_spread * by_axes.transpose()).diagonal();
    const double turn = expected.head(stray.turns).sum(), shift = expected.tail(3).sum();
    const double odd = turn / std::pow(joints_[b].stray_rad, 2) + shift / std::pow(joints_[b].stray_mm, 2);
    const double trust = (kTailDegrees + double(stray.value.size())) / (kTailDegrees + odd);
    trust_[k][b] = std::min(1.0, trust);
    out.turn += trust * turn, out.turns += stray.turns;
    out.shift += trust * shift, out.shifts += 3;
  }
  if (!scans.empty()) out.shifts -= 3;  // what the fit of the centre has used up
  return out;
}

// How far joints are expected to stray, each joint drawn towards the mean over all: few scans prove little.
// Whether that is as before.
bool SettledPoses::MeasureStray() {
  std::vector<Squares> joints;
  Squares all{kPooled * kFirstStrayRad * kFirstStrayRad, kPooled * kFirstStrayMm * kFirstStrayMm, kPooled,
              kPooled};
  for (int b = 0; b < bones_.size(); ++b) {
    const Squares& of = joints.emplace_back(ExpectedSquares(b));
    all.turn += of.turn, all.turns += of.turns, all.shift += of.shift, all.shifts += of.shifts;
  }
  bool at_rest = true;
  for (size_t b = 0; b < joints.size(); ++b) {
    const auto& [turn, shift, turns, shifts] = joints[b];
    const double rad = Pooled(turn, turns, all.turn / all.turns),
                 mm = Pooled(shift, shifts, all.shift / all.shifts);
    at_rest &= MoveTo(std::max(kLeastStrayRad, rad), joints_[b].stray_rad);
    at_rest &= MoveTo(std::max(kLeastStrayMm, mm), joints_[b].stray_mm);
  }
  return at_rest;
}

// What a scan's bones owe to axes that may lie elsewhere.
void SettledPoses::AddAxisSpread(size_t k) {
  const int size = 6 * bones_.size();
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(size, size);
  for (int b = 0; b < bones_.size(); ++b) {
    if (!Applies(settled_[k], b)) continue;
    const Stray stray = StrayOf(settled_[k], b);
    const Eigen::MatrixXd weighted = CertaintyOf(k, b, stray).asDiagonal() * stray.by_axes;
    Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(size, 3);
    pull.middleRows<6>(6 * b) = stray.by_child.transpose() * weighted;
    pull.middleRows<6>(6 * bones_.bones[b].parent) = stray.by_parent.transpose() * weighted;
    const Eigen::MatrixXd move = covariance_[k] * pull;
    spread += move * joints_[b].axis_spread * move.transpose();
  }
  for (int b = 0; b < bones_.size(); ++b) {
    if (!settled_[k][b].Doubtful()) settled_[k][b].covariance += spread.block<6, 6>(6 * b, 6 * b);
  }
}

double SettledPoses::Oddness(size_t scan, int bone) const {
  if (!Applies(*measured_[scan], bone)) return 0;
  const int p = bones_.bones[bone].parent;
  const BoneFits& measured = *measured_[scan];
  const Stray stray = StrayOf(measured, bone);
  const Eigen::MatrixXd spread =
      stray.by_child * WithFloor(measured[bone].covariance) * stray.by_child.transpose() +
      stray.by_parent * WithFloor(measured[p].covariance) * stray.by_parent.transpose() +
      stray.by_axes * joints_[bone].axis_spread * stray.by_axes.transpose();
  double odd = 0;
  for (int row = 0; row < stray.value.size(); ++row) {
    const double usual = row < stray.turns ? joints_[bone].stray_rad : joints_[bone].stray_mm;
    odd = std::max(odd, std::abs(stray.value[row]) / std::sqrt(usual * usual + spread(row, row)));
  }
  return odd;
}

}  // namespace kvx
