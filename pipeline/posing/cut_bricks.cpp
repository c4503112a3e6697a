// The stage around BrickBody.
#include "pipeline/posing/cut_bricks.h"

#include "pipeline/posing/brick_body.h"

namespace kvx {

std::vector<Digest> CutBricks::Inputs::Keys() const {
  std::vector<Digest> keys{body.key, bones.key, weights.key};
  keys.insert(keys.end(), examples.begin(), examples.end());
  return keys;
}

BrickedBody CutBricks::Run(const Inputs& in, const Options&, StageContext&) {
  return BrickBody(*in.body, *in.bones, *in.weights, in.examples.size(), in.load_example);
}

}  // namespace kvx
