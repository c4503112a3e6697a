// Which degrees of freedom the joint of each bone has: as the study lists it, else by the region's preset,
// whose names count in any case and whose joints may be turned round. What neither knows turns freely, but
// not where the study lists some joints: then it is fixed.
#pragma once
#include <string>
#include <vector>

#include "core/bone.h"
#include "core/study.h"

namespace kvx {

// As of ParallelAxis, in the study's bones.
struct ParallelJoint {
  int bone;
  double spread_rad;
  bool learnt = false;
  double along_rad = 0;
};

struct JointPlan {
  std::vector<std::string> dofs;  // empty for the root, rigid and dependent bones
  std::string driver;             // the bone whose angles a dependent bone follows; none where it is listed
  bool turns_about_head = false;  // of the parent: see UsualCentre
  std::vector<ParallelJoint> parallel;  // as the preset has them
  bool conjunct_rotation = false;       // see JointKnowledge; so for the presets' joints
};

// One per bone. Throws InputError: a joint of an unknown bone or of the root, four, five or more than six
// degrees of freedom.
std::vector<JointPlan> PlanJoints(const BoneSet& bones, Region region, const std::vector<StudyJoint>& joints);

}  // namespace kvx
