// A study: the scans of one person's articulated region and what
// is known of its bones (study.json of the contract).
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/rigid_transform.h"

namespace kvx {

enum class Region { kHand, kKnee, kCustom };

struct StudyScan {
  std::string name;
  std::filesystem::path volume;  // a file, or a folder with one DICOM series
};

struct StudyBone {
  int label = 0;
  std::string name;
  std::string parent;  // empty: the root
};

struct StudyJoint {
  std::string child;
  std::vector<std::string> dofs;
};

struct Study {
  std::string name;
  Region region = Region::kCustom;
  std::string template_scan;
  std::vector<StudyScan> scans;
  // A study gives a label map, or strokes, or a threshold.
  std::filesystem::path bone_labels;    // a finished label map, or a folder with a mask of each of `bones`
  std::filesystem::path bone_seeds;     // strokes: bone labels, 255 = background
  bool bones_by_threshold = false;      // CT
  std::optional<double> bone_level_hu;  // of the threshold; none: found in the template
  std::vector<StudyBone> bones;         // empty: the region's preset names for labels 1, 2, ...
  std::vector<StudyJoint> joints;       // empty: the region's preset
  std::map<std::string, std::map<std::string, RigidTransform>>
      initial_poses;  // scan -> bone -> scan_from_template
  std::vector<std::string> unread_fields;  // that the file has and nobody asks for: misspelt, perhaps
};

}  // namespace kvx
