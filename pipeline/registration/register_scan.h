// Stage 6: Algorithm 1. The template, initialised by VBD, is registered to one scan block by block with the biharmonic
// clamped plate spline (eq. 3 to 5).
#pragma once
#include "pipeline/runner.h"

namespace kvx {

enum class RegistrationMethod { kAdaptive, kPaper };

struct RegisteredScan {
  DisplacementField scan_from_template;    // on the template grid, mm: v-hat = v + u(v); smooth beyond the body
  int64_t control_points = 0;              // allocated over all levels, as the paper counts them (8 per registered block)
  std::vector<int64_t> control_points_per_level;
  double folded_fraction = 0;              // of body voxels whose Jacobian determinant is not positive
};
template <class A> void Fields(A& a, RegisteredScan& v) {
  a(v.scan_from_template, v.control_points, v.control_points_per_level, v.folded_fraction);
}

struct RegisterScan {
  static constexpr std::string_view kName = "register";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<Scan>& template_scan;
    const Artifact<Mask>& body;              // of the template
    const Artifact<BoneSet>& bones;
    const Artifact<WeightMap>& weights;
    const Artifact<BoneFits>& fits;          // of this scan
    const Artifact<Scan>& scan;
    std::vector<Digest> Keys() const {
      return {template_scan.key, body.key, bones.key, weights.key, fits.key, scan.key};
    }
  };
  struct Options {
    RegistrationMethod method = RegistrationMethod::kAdaptive;
  };
  using Output = RegisteredScan;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A> void Fields(A& a, RegisterScan::Options& v) { a(v.method); }

}  // namespace kvx
