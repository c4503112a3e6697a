// The surfaces of a model's bones and skin, extracted once from the template, posed often.
#pragma once
#include "core/bone.h"
#include "pipeline/posing/posing_engine.h"
#include "pipeline/surface/mask_surface.h"

namespace kvx {

// What is wanted: every bone and the skin when nothing is named.
struct SurfaceChoice {
  std::vector<std::string> bones;
  bool skin = false;
  bool Everything() const { return bones.empty() && !skin; }
};

// Thread-safe; extraction happens at the first request for a part.
class TemplateSurfaces {
 public:
  TemplateSurfaces(const BoneSet& bones, const Mask& body, const SurfaceOptions& options = {});
  ~TemplateSurfaces();

  // Bones keep their template vertices and carry their motion; the skin's vertices are mapped by the engine.
  // Throws NotFound naming the bones there are.
  std::vector<NamedSurface> Posed(const PosingEngine& engine, const ResolvedPose& pose,
                                  const SurfaceChoice& choice) const;

 private:
  const TriangleMesh& Bone(int bone) const;
  const TriangleMesh& Skin() const;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
