// What the scanner would see of each material point: tissue classes with MR-like means and seeded texture
// inside them.
#pragma once
#include <array>

#include "pipeline/phantom/anatomy/anatomy.h"

namespace kvx::phantom {

struct TissueSample {
  Tissue tissue = Tissue::kAir;  // of the point itself
  double intensity = 0;          // edges softened over `edge_mm`
};

class TissueModel {
 public:
  TissueModel(const Anatomy& anatomy, uint64_t seed);
  TissueSample At(const Eigen::Vector3d& rest, double edge_mm) const;
  int BoneAt(const Eigen::Vector3d& rest) const;  // index, -1: none
  const std::array<double, kTissueCount>& means() const { return means_; }
  double FluidIntensity() const { return means_[size_t(Tissue::kCapsule)]; }

 private:
  struct Layers;
  double Textured(Tissue tissue, const Eigen::Vector3d& rest, int part) const;
  void PaintSoft(const Eigen::Vector3d& rest, double depth, Layers& layers) const;
  void PaintBones(const Eigen::Vector3d& rest, Layers& layers) const;

  const Anatomy& anatomy_;
  uint64_t seed_;
  std::array<double, kTissueCount> means_{};
  std::vector<Box> muscle_boxes_, cord_boxes_, bone_boxes_;  // grown by what can matter
};

// The template, sampled finely over the body once; all scans are looked up in it.
class MaterialMap {
 public:
  MaterialMap(const Anatomy& anatomy, const TissueModel& tissues, double step_mm);
  double Intensity(const Eigen::Vector3d& rest) const;  // trilinear; 0 outside
  double step_mm() const { return step_mm_; }
  double MeanInBody() const;

 private:
  double step_mm_;
  Box box_;
  Eigen::Vector3i size_;
  std::vector<float> intensities_;
};

}  // namespace kvx::phantom
