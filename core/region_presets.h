// What is known of a region before any scan: bone names and tree,
// degrees of freedom of each joint, drivers of dependent bones.
#pragma once
#include <functional>
#include <string_view>

#include "core/study.h"

namespace kvx {

Region RegionFromName(std::string_view name);  // hand, knee, custom; throws InputError
std::string_view NameOf(Region region);

// The first axis of a joint is near parallel to that of another.
struct ParallelAxis {
  std::string of;        // the other joint's bone; empty: of the joint above
  double spread_rad;     // of the angle between both, per direction
  bool learnt = false;   // a study's own scans may show another spread than this usual one
  double along_rad = 0;  // spread of both about the line of their row, from base to base; 0: they are in none
};

struct PresetBone {
  std::string name, parent;  // parent empty: root
  std::vector<std::string>
      dofs;            // of the joint to the parent; empty: rigid to it, or dependent when `driver` is set
  std::string driver;  // bone whose joint angles this bone's own motion follows (patella, fibula: tibia)
  bool turns_about_head = false;       // the parent ends in a rounded head that the bone slides around
  std::vector<ParallelAxis> parallel;  // to its first axis
};

// hand: carpals + 19 bones, 23 degrees of freedom;
// knee: femur, tibia, fibula, patella, 1 degree (paper, section 6). custom: empty.
const std::vector<PresetBone>& RegionPreset(Region region);

// By name, in any case; nullptr where the preset has none of that name.
const PresetBone* FindPreset(Region region, std::string_view name);

// The preset's bones that `held(bone, label)` says are there, numbered 1, 2, ... in the preset's order with
// the others. A bone whose parent is not there hangs on its parent.
std::vector<StudyBone> HeldBones(Region region, const std::function<bool(const PresetBone&, int)>& held);

}  // namespace kvx
