// The last stage of a build: what the posing engine reads of body, weights and examples, cut in bricks. A
// tenth of their size, so a model is ready to pose without them.
#pragma once
#include <functional>

#include "kernels/bricked_body.h"
#include "pipeline/runner.h"

namespace kvx {

struct CutBricks {
  static constexpr std::string_view kName = "bricks";
  static constexpr int kVersion =
      2;  // of the layout, too: bricks of another version are cut anew when needed
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<BoneSet>& bones;
    const Artifact<WeightMap>& weights;
    std::vector<Digest> examples;  // of d_k per training scan, template grid
    std::function<std::shared_ptr<const DisplacementField>(size_t k)> load_example;  // one is held at a time
    std::vector<Digest> Keys() const;
  };
  using Options = NoOptions;
  using Output = BrickedBody;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

template <class A>
void Fields(A& a, BrickedBody::Example& v) {
  a(v.k, v.scale);
}
template <class A>
void Fields(A& a, BrickedBody& v) {
  std::vector<int32_t> first_nodes;
  for (const cl_int4& node : v.first_nodes) first_nodes.insert(first_nodes.end(), node.s, node.s + 3);
  a(v.bricks, v.brick_at, first_nodes, v.cell_bricks, v.body, v.tissue, v.cuts);
  v.first_nodes.assign(first_nodes.size() / 3, {});
  for (size_t n = 0; n < first_nodes.size(); ++n) v.first_nodes[n / 3].s[n % 3] = first_nodes[n];
  a(v.palette_first, v.palette, v.weights, v.weight_ranges);
  a(v.example_count, v.example_first, v.example_refs, v.examples, v.example_ranges);
  if constexpr (A::kReads) {
    if (!v.IsConsistent()) throw Unavailable("a stored artefact is damaged");
  }
}

}  // namespace kvx
