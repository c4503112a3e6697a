// What the bones of all scans are compared with. Found when first asked for, and kept.
#pragma once
#include <optional>

#include "core/scan.h"
#include "pipeline/artifacts/stage_cache.h"
#include "pipeline/bones/template/bone_tissue.h"
#include "pipeline/bones/template/search_tree.h"
#include "pipeline/bones/template/sought_bones.h"

namespace kvx {

// The template as a scan shows it, and samples of it.
struct SeenTemplate {
  CubicImage image;
  std::vector<BoneTissue> tissue;

  SeenTemplate(const BoneSet& bones, Volume seen, const WeightMap& weights);
};

// Refers to its arguments, whose values need not be there before something is asked for.
class BoneTemplate {
 public:
  BoneTemplate(const Artifact<Scan>& scan, const Artifact<BoneSet>& bones, const Artifact<WeightMap>& weights)
      : scan_(scan), bones_(bones), weights_(weights) {}

  const Artifact<Scan>& scan() const { return scan_; }
  const Artifact<BoneSet>& bones() const { return bones_; }
  const Artifact<WeightMap>& weights() const { return weights_; }  // on the scan's grid

  const Volume& Lit();  // the scan without shading
  // For searches whose finest voxels are of this size. Kept until one of another size is asked for. Its bones
  // may hang on others than the study says (search_tree.h).
  const SoughtBones& Sought(double finest_mm);
  // Fits of the bones as they are sought, in the order of bones().
  BoneFits InOrder(BoneFits sought) const;
  // In the scan's own contrast, its greys as Normalised.
  const SeenTemplate& Seen();
  void Forget();  // takes little room until something is asked for again

 private:
  const Artifact<Scan>& scan_;
  const Artifact<BoneSet>& bones_;
  const Artifact<WeightMap>& weights_;
  std::optional<Volume> lit_;
  std::optional<SearchTree> tree_;  // where it is not the study's
  double finest_mm_ = 0;
  std::optional<SoughtBones> sought_;
  std::optional<SeenTemplate> seen_;
};

}  // namespace kvx
