// Key-framed motion: poses at times, and what lies between them.
#pragma once
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

enum class Interpolation {
  kLinear,  // joint angles, straight between key frames
  kSlerp,   // each bone's motion against its parent turns evenly about one axis
  kCubic    // joint angles, smooth in time, without overshoot between two key frames
};
Interpolation InterpolationFromName(std::string_view name);  // throws InputError

struct KeyFrame {
  double time_s = 0;
  PoseRequest pose;
};

struct KeyFrames {
  double fps = 25;
  Interpolation interpolation = Interpolation::kLinear;
  std::vector<KeyFrame> frames;  // times grow

  double Duration() const { return frames.empty() ? 0 : frames.back().time_s - frames.front().time_s; }
  // At `fps`, the first and the last key frame included.
  int FrameCount() const;
  double TimeOf(int frame) const;  // whose pose it shows: of the last frame the last key frame's
};
void Validate(const KeyFrames& motion);  // throws InputError

// Poses between key frames. Where frames hold bone transforms or scans,
// or slerp is asked for, bones are interpolated, else angles.
class Motion {
 public:
  Motion(const PoseResolver& model, KeyFrames frames, DeformationMode mode);
  // Held before the first and after the last key frame; at a key frame's time exactly that frame's pose.
  ResolvedPose At(double time_s) const;
  // Of that pose: those that are asked for, as `At` looks them up in pose space; where bones are
  // interpolated, those that the bones show.
  JointAngles AnglesAt(double time_s) const;

 private:
  struct Place {
    size_t before;  // key frame
    bool on_frame;
  };
  Place PlaceOf(double time_s) const;
  bool IsByAngles() const;
  JointAngles AnglesBetween(size_t after, double time_s) const;
  BonePose BonesBetween(size_t after, double share) const;

  const PoseResolver model_;
  KeyFrames frames_;
  DeformationMode mode_;
  std::vector<PoseVector> bones_;    // of every key frame
  std::vector<JointAngles> angles_;  // when all frames are given by angles
};

}  // namespace kvx
