// The stage around BrickBody.
#include "pipeline/posing/cut_bricks.h"

#include "pipeline/posing/brick_body.h"

namespace kvx {

std::vector<Digest> CutBricks::Inputs::Keys() const {
  std::vector<Digest> keys{body.key, bones.key, weights.key};
  for (const Artifact<DisplacementField>& example : examples) keys.push_back(example.key);
  return keys;
}

BrickedBody CutBricks::Run(const Inputs& in, const Options&, StageContext&) {
  std::vector<const DisplacementField*> examples;
  for (const Artifact<DisplacementField>& example : in.examples) examples.push_back(example.value.get());
  return BrickBody(*in.body, *in.bones, *in.weights, examples);
}

}  // namespace kvx
