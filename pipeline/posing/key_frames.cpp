// Angles by Hermite polynomials (monotone, after Fritsch and Carlson 1980),
// bones by slerp against their parents.
#include "pipeline/posing/key_frames.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr int kMostFrames = 100000;
constexpr double kSameTime = 1e-9;
constexpr double kSameFrame = 1e-6;  // of a frame

// Slope at knot i of values over times: harmonic mean of the neighbours' slopes,
// 0 at turns; at the ends the first or last secant.
double SlopeAt(const std::vector<KeyFrame>& frames, const std::vector<JointAngles>& angles, size_t i,
               Eigen::Index dof) {
  const auto slope = [&](size_t a) {
    return (angles[a + 1][dof] - angles[a][dof]) / (frames[a + 1].time_s - frames[a].time_s);
  };
  if (i == 0) return slope(0);
  if (i + 1 == frames.size()) return slope(i - 1);
  const double before = slope(i - 1), after = slope(i);
  if (before * after <= 0) return 0;
  const double h0 = frames[i].time_s - frames[i - 1].time_s, h1 = frames[i + 1].time_s - frames[i].time_s;
  return 3 * (h0 + h1) / ((2 * h1 + h0) / before + (h1 + 2 * h0) / after);
}

double Hermite(double a, double slope_a, double b, double slope_b, double length, double share) {
  const double s2 = share * share, s3 = s2 * share;
  return (2 * s3 - 3 * s2 + 1) * a + (s3 - 2 * s2 + share) * length * slope_a + (3 * s2 - 2 * s3) * b +
         (s3 - s2) * length * slope_b;
}

}  // namespace

Interpolation InterpolationFromName(std::string_view name) {
  if (name == "linear") return Interpolation::kLinear;
  if (name == "slerp") return Interpolation::kSlerp;
  if (name == "cubic") return Interpolation::kCubic;
  throw InputError("interpolation must be linear, slerp or cubic");
}

int KeyFrames::FrameCount() const { return 1 + int(std::ceil(Duration() * fps - kSameFrame)); }

double KeyFrames::TimeOf(int frame) const {
  return std::min(frames.front().time_s + frame / fps, frames.back().time_s);
}

void Validate(const KeyFrames& motion) {
  if (motion.frames.empty()) throw InputError("frames is empty; give at least one key frame");
  if (!(motion.fps > 0) || !(motion.fps <= 1000)) throw InputError("fps must be above 0 and at most 1000");
  for (size_t f = 0; f < motion.frames.size(); ++f) {
    if (!std::isfinite(motion.frames[f].time_s))
      throw InputError("frames[" + std::to_string(f) + "].time is not a number");
    if (f && !(motion.frames[f].time_s > motion.frames[f - 1].time_s + kSameTime))
      throw InputError("frames[" + std::to_string(f) + "].time must be later than the frame before");
  }
  if (!(motion.Duration() * motion.fps <= kMostFrames - 1 + kSameFrame))
    throw InputError("the motion has more than 100000 frames; use a smaller fps");
}

Motion::Motion(const PoseResolver& model, KeyFrames frames, DeformationMode mode)
    : model_(model), frames_(std::move(frames)), mode_(mode) {
  Validate(frames_);
  bool all_angles = true;
  for (const KeyFrame& frame : frames_.frames) {
    bones_.push_back(model_.Resolve(frame.pose, mode_).scan_from_template);
    const auto* given = std::get_if<AnglePose>(&frame.pose);
    all_angles = all_angles && given;
    if (given) angles_.push_back(model_.AnglesOf(*given));
  }
  if (!all_angles) angles_.clear();
  if (!all_angles && frames_.interpolation == Interpolation::kCubic)
    throw InputError(
        "cubic interpolation needs key frames given as joint angles; use slerp for bones and scans");
}

JointAngles Motion::AnglesBetween(size_t after, double time_s) const {
  const KeyFrame &a = frames_.frames[after - 1], &b = frames_.frames[after];
  const double length = b.time_s - a.time_s, share = (time_s - a.time_s) / length;
  if (frames_.interpolation == Interpolation::kLinear)
    return (1 - share) * angles_[after - 1] + share * angles_[after];
  JointAngles out = angles_[after];
  for (Eigen::Index d = 0; d < out.size(); ++d) {
    out[d] = Hermite(angles_[after - 1][d], SlopeAt(frames_.frames, angles_, after - 1, d), angles_[after][d],
                     SlopeAt(frames_.frames, angles_, after, d), length, share);
  }
  return out;
}

// The joint's centre moves straight and the bone turns about it, both as seen from the parent.
BonePose Motion::BonesBetween(size_t after, double share) const {
  BonePose out;
  PoseVector posed;
  for (size_t bone = 0; bone < model_.bone_names.size(); ++bone) {
    const Joint& joint = model_.fit.skeleton.joints[bone];
    const auto against_parent = [&](const PoseVector& pose) {
      return joint.parent == kNoParent ? pose[bone] : pose[size_t(joint.parent)].Inverse() * pose[bone];
    };
    const RigidTransform a = against_parent(bones_[after - 1]), b = against_parent(bones_[after]);
    const Eigen::Vector3d centre = (1 - share) * (a * joint.centre).lps + share * (b * joint.centre).lps;
    RigidTransform between{a.rotation.slerp(share, b.rotation), Eigen::Vector3d::Zero()};
    between.translation_mm = centre - between.rotation * joint.centre.lps;
    posed.push_back(joint.parent == kNoParent ? between : posed[size_t(joint.parent)] * between);
    out.scan_from_template[model_.bone_names[bone]] = posed.back();
  }
  return out;
}

Motion::Place Motion::PlaceOf(double time_s) const {
  size_t after = 0;
  while (after < frames_.frames.size() && frames_.frames[after].time_s < time_s + kSameTime) ++after;
  const size_t before = after == 0 ? 0 : after - 1;
  const bool on_frame =
      after == 0 || after == frames_.frames.size() || time_s < frames_.frames[before].time_s + kSameTime;
  return {before, on_frame};
}

bool Motion::IsByAngles() const { return !angles_.empty() && frames_.interpolation != Interpolation::kSlerp; }

ResolvedPose Motion::At(double time_s) const {
  const auto [before, on_frame] = PlaceOf(time_s);
  if (on_frame) return model_.Resolve(frames_.frames[before].pose, mode_);
  if (IsByAngles()) return model_.ResolveAngles(AnglesBetween(before + 1, time_s), mode_);
  const double share = (time_s - frames_.frames[before].time_s) /
                       (frames_.frames[before + 1].time_s - frames_.frames[before].time_s);
  return model_.Resolve(BonesBetween(before + 1, share), mode_);
}

JointAngles Motion::AnglesAt(double time_s) const {
  if (!IsByAngles()) return AnalysePose(model_.fit.skeleton, At(time_s).scan_from_template).angles;
  const auto [before, on_frame] = PlaceOf(time_s);
  return on_frame ? angles_[before] : AnglesBetween(before + 1, time_s);
}

}  // namespace kvx
