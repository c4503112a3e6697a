// From what a user asks for to bone poses and example coefficients.
#include "pipeline/posing/resolved_pose.h"

#include <algorithm>

#include "core/errors.h"
#include "core/farthest_place.h"
#include "core/text/listed.h"

namespace kvx {
namespace {

constexpr double kLargestValue = 2 * kPi;  // of a turn, or as many mm of a shift as degrees

int IndexIn(const std::vector<std::string>& names, const std::string& name) {
  return int(std::find(names.begin(), names.end(), name) - names.begin());
}

struct Resolving {
  const PoseResolver& model;

  ResolvedPose operator()(const AnglePose& asked) const { return OfAngles(model.AnglesOf(asked)); }

  ResolvedPose OfAngles(const JointAngles& angles) const {
    return {ForwardKinematics(model.fit.skeleton, angles, RigidTransform{}, model.residuals.At(angles)),
            model.space.Coefficients(angles).cast<float>(), model.space.Extrapolation(angles)};
  }

  ResolvedPose operator()(const BonePose& asked) const {
    for (const auto& [name, motion] : asked.scan_from_template) {
      RequireBone(name);
      if (!(motion.translation_mm.cwiseAbs().maxCoeff() <= kFarthestMm))
        throw InputError("the transform of bone '" + name +
                         "' moves it by more than a kilometre; it is in mm");
    }
    PoseVector pose;
    for (size_t bone = 0; bone < model.bone_names.size(); ++bone) {  // parents come first
      const auto given = asked.scan_from_template.find(model.bone_names[bone]);
      const int parent = model.fit.skeleton.joints[bone].parent;
      if (given != asked.scan_from_template.end())
        pose.push_back(given->second);
      else
        pose.push_back(parent == kNoParent ? RigidTransform{} : pose[parent]);
    }
    const JointAngles angles = AnalysePose(model.fit.skeleton, pose).angles;
    return {pose, model.space.Coefficients(angles).cast<float>(), model.space.Extrapolation(angles)};
  }

  ResolvedPose operator()(const ScanPose& asked) const {
    const size_t bones = model.bone_names.size(), scans = model.scan_names.size();
    ResolvedPose out{PoseVector(bones), Eigen::MatrixXf::Zero(bones, scans), Eigen::VectorXd::Zero(bones)};
    if (asked.scan == model.template_scan) return out;
    const int k = IndexIn(model.scan_names, asked.scan);
    if (k == int(scans)) {
      throw NotFound("there is no scan '" + asked.scan + "'; this model has: " + model.template_scan +
                     (scans ? ", " : "") + Listed(model.scan_names));
    }
    out.scan_from_template = model.scan_poses[k];
    out.coefficients.col(k).setOnes();
    return out;
  }

  void RequireBone(const std::string& name) const {
    if (IndexIn(model.bone_names, name) < int(model.bone_names.size())) return;
    throw NotFound("there is no bone '" + name + "'; this model has: " + Listed(model.bone_names));
  }
};

}  // namespace

ResolvedPose InMode(ResolvedPose by_evd, DeformationMode mode) {
  if (mode == DeformationMode::kVbd) by_evd.coefficients.setZero();
  by_evd.elastic = mode == DeformationMode::kElastic;
  return by_evd;
}

bool IsSame(const ResolvedPose& a, const ResolvedPose& b) {
  const auto same = [](const RigidTransform& s, const RigidTransform& t) {
    return s.rotation.coeffs() == t.rotation.coeffs() && s.translation_mm == t.translation_mm;
  };
  return a.elastic == b.elastic &&
         std::equal(a.scan_from_template.begin(), a.scan_from_template.end(), b.scan_from_template.begin(),
                    b.scan_from_template.end(), same) &&
         a.coefficients.rows() == b.coefficients.rows() && a.coefficients.cols() == b.coefficients.cols() &&
         a.coefficients == b.coefficients;
}

JointAngles PoseResolver::AnglesOf(const AnglePose& asked) const {
  JointAngles angles = JointAngles::Zero(fit.skeleton.DofCount());
  for (const auto& [name, angle_rad] : asked.angles_rad) {
    if (!std::isfinite(angle_rad)) throw InputError("the angle of '" + name + "' is not a number");
    if (std::abs(angle_rad) > kLargestValue)
      throw InputError("the value of '" + name + "' is beyond 360 degrees, or mm; give what a joint can do");
    angles[fit.skeleton.DofIndex(name, bone_names)] = angle_rad;
  }
  return angles;
}

ResolvedPose PoseResolver::ResolveAngles(const JointAngles& angles, DeformationMode mode) const {
  return InMode(Resolving{*this}.OfAngles(angles), mode);
}

ResolvedPose PoseResolver::Resolve(const PoseRequest& request, DeformationMode mode) const {
  ResolvedPose pose = InMode(std::visit(Resolving{*this}, request), mode);
  pose.elastic = pose.elastic && !std::holds_alternative<ScanPose>(request);
  return pose;
}

}  // namespace kvx
