// Each thing once.
#include "pipeline/bones/template/bone_template.h"

#include "pipeline/bones/images/even_light.h"
#include "pipeline/bones/images/levels.h"

namespace kvx {

SeenTemplate::SeenTemplate(const BoneSet& bones, Volume seen, const WeightMap& weights)
    : image(std::move(seen)), tissue(SampleTissue(bones, image, weights)) {}

const Volume& BoneTemplate::Lit() {
  if (!lit_) lit_ = EvenlyLit(*scan_);
  return *lit_;
}

const SoughtBones& BoneTemplate::Sought(double finest_mm) {
  if (sought_ && finest_mm == finest_mm_) return *sought_;
  sought_.reset();
  tree_ = TreeToSearch(*bones_);
  finest_mm_ = finest_mm;
  return sought_.emplace(tree_ ? tree_->bones : *bones_, Lit(), finest_mm);
}

BoneFits BoneTemplate::InOrder(BoneFits sought) const { return tree_ ? tree_->InOrder(sought) : sought; }

const SeenTemplate& BoneTemplate::Seen() {
  if (!seen_) seen_.emplace(*bones_, Normalised(Lit()), *weights_);
  return *seen_;
}

void BoneTemplate::Forget() {
  lit_.reset();
  sought_.reset();
  tree_.reset();
  seen_.reset();
}

}  // namespace kvx
