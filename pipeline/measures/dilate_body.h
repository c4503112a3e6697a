// Stage `measured_region`: where measures are taken.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

// The region in which measures are taken: the body and 3 mm around it.
struct DilateBody {
  static constexpr std::string_view kName = "measured_region";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<Mask>& body;
    std::vector<Digest> Keys() const { return {body.key}; }
  };
  struct Options {
    double margin_mm = 3.0;
  };
  using Output = Mask;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, DilateBody::Options& v) {
  a(v.margin_mm);
}

}  // namespace kvx
