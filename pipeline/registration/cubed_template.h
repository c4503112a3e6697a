// A template of thick slices, between its slices. Blocks, lattices and margins of the registration count
// voxels, and are as wide as they are long only where voxels are nearly cubes.
#pragma once
#include "core/host/progress.h"
#include "core/registered_scan.h"
#include "pipeline/registration/region/registration_inputs.h"

namespace kvx {

// Intensities on a cubic spline, outlines of bones and body by their distances (shape-based interpolation:
// Raya and Udupa 1990), weights linearly. What the template itself says at its voxels stays.
class CubedTemplate {
 public:
  CubedTemplate(const RegistrationInputs& given, const Eigen::Vector3i& times);
  RegistrationInputs Inputs() const;  // refers to this and to what was given

 private:
  const RegistrationInputs& given_;
  Artifact<Scan> template_scan_;
  Artifact<Mask> body_;
  Artifact<BoneSet> bones_;
  Artifact<WeightMap> weights_;
};

// On FinerGrid(labels.grid, times).
LabelMap FinerLabels(const LabelMap& labels, const Eigen::Vector3i& times);
WeightMap FinerWeights(const WeightMap& weights, const Eigen::Vector3i& times);

// What was found on the finer grid, at the voxels of the template that `given` has. Slopes over whole voxels
// may show folds that narrower ones do not: they are relaxed away.
RegisteredScan AtTemplateVoxels(const RegisteredScan& finer, const RegistrationInputs& given,
                                const Eigen::Vector3i& times, const Progress& progress);

}  // namespace kvx
