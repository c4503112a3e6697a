// A bone that turns about its length as it bends, in proportion, would tilt its hinge towards itself if that
// were left out.
#include "pipeline/skeleton/joint_axes.h"

#include <Eigen/Cholesky>
#include <limits>
#include <optional>

#include "pipeline/skeleton/joint_angles.h"

namespace kvx {
namespace {

constexpr double kAcrossRad = RadFromDeg(10);  // how far from a right angle to the bone an axis usually is
// Of a joint with conjunct rotation: the same, and that rotation in parts of the bending.
constexpr double kConjunctAcrossRad = RadFromDeg(7), kConjunct = 0.1;
constexpr double kElongated = 1.6;  // over the shortest side alone, as BoneShape: a bone has a length

// In scans that show the joint well.
double WidestTurn(std::span<const RelativeMotion> motions, const Eigen::Vector3d& axis) {
  double widest = 0;
  for (const RelativeMotion& m : motions) {
    if (m.weight < 0.5) continue;
    widest = std::max(widest, std::abs(axis.dot(RotationVector(m.motion.rotation))));
  }
  return widest;
}

// Dominant direction of the rotation vectors across `first` (zero: in space), when it turns far enough.
std::optional<Eigen::Vector3d> DominantAxis(std::span<const RelativeMotion> motions,
                                            const Eigen::Vector3d& first) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - first * first.transpose();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const RelativeMotion& m : motions) {
    const Eigen::Vector3d r = across * RotationVector(m.motion.rotation);
    scatter += m.weight * r * r.transpose();
  }
  // Where nothing turns across `first` the eigenvector is noise of rounding and may lie along it.
  const Eigen::Vector3d axis =
      across * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  if (axis.norm() < 0.5 || WidestTurn(motions, axis) < kShownTurnRad) return std::nullopt;
  return axis.normalized();
}

Eigen::Matrix3d FrameOf(const Eigen::Vector3d& first, Eigen::Vector3d second) {
  second = (second - first * first.dot(second)).normalized();
  Eigen::Matrix3d frame;
  frame << first, second, first.cross(second);
  return frame;
}

bool IsElongated(const OrientedBox& box) {
  return box.extent_mm.maxCoeff() > kElongated * box.extent_mm.minCoeff();
}

// What is fitted: the axes as columns, and a hinge's conjunct rotation, in parts of the bending.
struct Turning {
  Eigen::Matrix3d axes;
  double conjunct = 0;
};

// What the joint and what is known of it leave unexplained, in standard deviations.
class AxisProblem {
 public:
  AxisProblem(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
              const JointKnowledge& known)
      : motions_(motions), dof_count_(dof_count), known_(known) {
    for (const RelativeMotion& m : motions) {
      const Eigen::Matrix3d spread = m.turn_spread + m.play_rad * m.play_rad * Eigen::Matrix3d::Identity();
      roots_.emplace_back(spread);
    }
    if (IsElongated(box)) long_axis_ = box.axes.col(0);
  }

  Eigen::VectorXd At(const Turning& turning) const {
    std::vector<Eigen::Vector3d> axes;
    for (int d = 0; d < dof_count_; ++d) axes.push_back(turning.axes.col(d));
    Eigen::VectorXd rest(3 * int(motions_.size() + known_.near.size()) + dof_count_ + 1);
    int row = 0;
    for (size_t k = 0; k < motions_.size(); ++k) {
      const Eigen::Quaterniond& rotation = motions_[k].motion.rotation;
      const Eigen::Vector3d off =
          RotationVector(Explained(axes, turning.conjunct, rotation).conjugate() * rotation);
      rest.segment<3>(row) = std::sqrt(motions_[k].weight) * roots_[k].matrixL().solve(off);
      row += 3;
    }
    for (const AxisBelief& belief : known_.near) {
      rest.segment<3>(row) = axes[0].cross(belief.axis) / belief.spread_rad;
      row += 3;
    }
    const double across_rad = HasConjunct() ? kConjunctAcrossRad : kAcrossRad;
    for (const Eigen::Vector3d& axis : axes) rest[row++] = axis.dot(long_axis_) / across_rad;
    rest[row] = turning.conjunct / kConjunct;
    return rest;
  }

 private:
  bool HasConjunct() const { return known_.conjunct_rotation && dof_count_ < 3 && !long_axis_.isZero(); }

  // The joint's rotation that is nearest to one.
  Eigen::Quaterniond Explained(std::vector<Eigen::Vector3d> axes, double conjunct,
                               const Eigen::Quaterniond& rotation) const {
    if (HasConjunct()) axes.push_back(long_axis_);
    Eigen::VectorXd angles = AnglesOf(axes, rotation);
    if (HasConjunct()) angles[dof_count_] = conjunct * angles[0];
    Eigen::Quaterniond product = Eigen::Quaterniond::Identity();
    for (size_t d = 0; d < axes.size(); ++d)
      product = product * Eigen::AngleAxisd(angles[Eigen::Index(d)], axes[d]);
    return product;
  }

  std::span<const RelativeMotion> motions_;
  int dof_count_;
  const JointKnowledge known_;
  std::vector<Eigen::LLT<Eigen::Matrix3d>> roots_;
  Eigen::Vector3d long_axis_ = Eigen::Vector3d::Zero();  // of the bone; zero where it has none
};

// A small turn of all axes, and of the conjunct rotation a change.
Turning Moved(const Turning& turning, const Eigen::Vector4d& by) {
  const Twist twist = (Twist() << by.head<3>(), Eigen::Vector3d::Zero()).finished();
  return {Exp(twist).rotation.toRotationMatrix() * turning.axes, turning.conjunct + by[3]};
}

Eigen::MatrixX4d JacobianOf(const AxisProblem& problem, const Turning& turning) {
  constexpr double kDifference = 1e-6;
  Eigen::MatrixX4d jacobian(problem.At(turning).size(), 4);
  for (int c = 0; c < 4; ++c) {
    const Eigen::Vector4d by = kDifference * Eigen::Vector4d::Unit(c);
    jacobian.col(c) = (problem.At(Moved(turning, by)) - problem.At(Moved(turning, -by))) / (2 * kDifference);
  }
  return jacobian;
}

struct Fitted {
  Eigen::Matrix3d axes;
  double rest;  // norm of what is left unexplained
};

// Levenberg-Marquardt; the angles are solved anew at each step (variable projection).
Fitted Refined(const AxisProblem& problem, const Eigen::Matrix3d& axes) {
  constexpr int kSteps = 40;
  constexpr double kSettledRad = 1e-8;
  double damping = 1e-3;
  Turning turning{axes};
  Eigen::VectorXd rest = problem.At(turning);
  for (int step = 0; step < kSteps && rest.norm() > 1e-13; ++step) {
    const Eigen::MatrixX4d jacobian = JacobianOf(problem, turning);
    Eigen::Matrix4d normal = jacobian.transpose() * jacobian;
    const double scale = normal.topLeftCorner<3, 3>().trace();
    normal += (damping * scale + 1e-12) * Eigen::Matrix4d::Identity();
    const Eigen::Vector4d by = -normal.ldlt().solve(jacobian.transpose() * rest);
    if (by.norm() < kSettledRad) break;
    const Turning tried = Moved(turning, by);
    const Eigen::VectorXd tried_rest = problem.At(tried);
    const bool better = tried_rest.norm() < rest.norm();
    damping = better ? std::max(1e-9, damping / 10) : damping * 10;
    if (better) turning = tried, rest = tried_rest;
    if (damping > 1e6) break;
  }
  return {turning.axes, rest.norm()};
}

// Of a frame fitted to one axis the others are taken from the box.
Eigen::Matrix3d Completed(const Eigen::Matrix3d& frame, int dof_count, const OrientedBox& box) {
  return dof_count > 1 ? frame : FrameOf(frame.col(0), SecondFromBox(frame.col(0), box));
}

// Three axes explain every rotation: any will do, and those of the bone say what each turn is.
bool OnlyHinge(const OrientedBox& box, int dof_count, const JointKnowledge& known) {
  return dof_count > 2 && known.conjunct_rotation && IsElongated(box);
}

// How many axes are fitted to the rotations; the others follow from these and the bone's box. Of two axes of
// which the scans show one alone, that one.
int FittedCount(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                const JointKnowledge& known) {
  if (dof_count > 2) return OnlyHinge(box, dof_count, known) ? 1 : 0;
  if (dof_count < 2 || !known.near.empty()) return dof_count;
  const auto first = DominantAxis(motions, Eigen::Vector3d::Zero());
  return first && DominantAxis(motions, *first) ? 2 : 1;
}

Eigen::Vector3d MeanOf(std::span<const AxisBelief> beliefs) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const AxisBelief& belief : beliefs) {
    const double sign = belief.axis.dot(beliefs.front().axis) < 0 ? -1 : 1;
    sum += sign / (belief.spread_rad * belief.spread_rad) * belief.axis;
  }
  return sum.normalized();
}

}  // namespace

Eigen::Vector3d SecondFromBox(const Eigen::Vector3d& first, const OrientedBox& box) {
  const Eigen::Vector3d across = box.axes.col(0).cross(first);
  return across.norm() > 0.3 ? across.normalized() : Eigen::Vector3d(box.axes.col(1));
}

bool ShowsAnAxis(std::span<const RelativeMotion> motions) {
  return DominantAxis(motions, Eigen::Vector3d::Zero()).has_value();
}

Eigen::Matrix3d FitAxes(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                        const JointKnowledge& known, const std::optional<Eigen::Matrix3d>& before) {
  if (!known.near.empty() && dof_count < 3) {
    const AxisProblem problem(motions, box, dof_count, known);
    const Eigen::Vector3d start = MeanOf(known.near);
    Fitted best = Refined(problem, FrameOf(start, SecondFromBox(start, box)));
    if (before) {
      const Fitted other = Refined(problem, *before);
      if (other.rest < best.rest) best = other;
    }
    return Completed(best.axes, dof_count, box);
  }
  const auto first = DominantAxis(motions, Eigen::Vector3d::Zero());
  if (!first) return FrameOf(box.axes.col(1), box.axes.col(2));
  const int fitted = FittedCount(motions, box, dof_count, known);
  if (fitted == 1) {
    const Eigen::Matrix3d start = FrameOf(*first, SecondFromBox(*first, box));
    return Completed(Refined(AxisProblem(motions, box, 1, known), start).axes, 1, box);
  }
  const auto second = DominantAxis(motions, *first);
  const Eigen::Matrix3d frame = FrameOf(*first, second ? *second : SecondFromBox(*first, box));
  return fitted == 2 ? Refined(AxisProblem(motions, box, 2, known), frame).axes : frame;
}

AxisCertainty CertaintyOf(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                          const JointKnowledge& known, const Eigen::Matrix3d& axes) {
  AxisCertainty out;
  const int fitted = FittedCount(motions, box, dof_count, known);
  if (fitted == 0 || ((known.near.empty() || dof_count > 2) && !ShowsAnAxis(motions))) return out;
  out.fitted = fitted;
  const AxisProblem problem(motions, box, fitted, {{}, known.conjunct_rotation});
  const Eigen::MatrixX4d jacobian = JacobianOf(problem, {axes});
  const Eigen::Matrix4d all = jacobian.transpose() * jacobian;
  // What the conjunct rotation may be instead is taken out (Schur's complement).
  const Eigen::Vector3d with_conjunct = all.topRightCorner<3, 1>();
  out.information = all.topLeftCorner<3, 3>() - with_conjunct * with_conjunct.transpose() / all(3, 3);
  if (fitted < dof_count) {
    const double tilt_rad = kShownTurnRad / std::max(kShownTurnRad, WidestTurn(motions, axes.col(0)));
    out.variance = tilt_rad * tilt_rad;
  }
  return out;
}

Eigen::Vector3d AxisVariances(const AxisCertainty& certainty, const Eigen::Matrix3d& covariance,
                              const Eigen::Matrix3d& axes) {
  Eigen::Vector3d out = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (int d = 0; d < certainty.fitted; ++d) {
    const Eigen::Vector3d axis = axes.col(d);
    out[d] = 0.5 * (covariance.trace() - axis.dot(covariance * axis)) + certainty.variance;
  }
  return out;
}

}  // namespace kvx
