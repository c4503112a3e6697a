// Algorithm 1. The template, initialised by VBD, is registered to one scan block by block with the
// biharmonic clamped plate spline (eq. 3, 4).
//
// kAdaptive works in the template's frame: v-hat = start(v + d(v)), where the start is VBD, relaxed as
// elastic tissue. So d is close to eq. 7's displacement, nothing is inverted and bones stay where VBD put
// them. Blocks are 8 voxels of each resolution level; they are visited in 27 colours of disjoint supports,
// while anything in reach has changed; in every sweep the colour with the worst mismatched block goes first.
// In the first sweeps blocks of 16 voxels take their turn before those, on the same images.
// Steps are Gauss-Newton steps of the SSD after a local gain and bias; within a sweep images are taken as
// linear, then each step is judged by what the scan shows: by normalised MI (eq. 5) where supports are wider
// than 32 template voxels, else by that SSD. After a first round the tissue settles elastically where the
// scan says little, and a second round starts from there. Folds that remain are relaxed away.
//
// kPaper is Algorithm 1 as published, on the scan's grid: see paper/paper_stage.h.
#pragma once
#include "core/registered_scan.h"
#include "pipeline/registration/paper/paper_options.h"
#include "pipeline/registration/region/registration_inputs.h"
#include "pipeline/runner.h"

namespace kvx {

enum class RegistrationMethod { kAdaptive, kPaper };

struct RegisterScan {
  static constexpr std::string_view kName = "register";
  static constexpr int kVersion = 44;
  using Inputs = RegistrationInputs;
  struct Options {
    RegistrationMethod method = RegistrationMethod::kAdaptive;
    PaperOptions paper;  // for kPaper alone: see paper/paper_stage.h
  };
  using Output = RegisteredScan;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, RegisterScan::Options& v) {
  a(v.method);
  if (v.method == RegistrationMethod::kPaper) a(v.paper);
}

}  // namespace kvx
