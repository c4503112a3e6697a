// Each part is made under its own once-flag.
#include "pipeline/posing/posed_surfaces.h"

#include <mutex>

#include "core/host/parallel.h"
#include "core/voxels/label_mask.h"

namespace kvx {
namespace {

constexpr size_t kPointsAtOnce = 4096;
// Of the largest, by volume: crumbs of tissue at a cut end and cavities are no skin
constexpr double kLeastPiece = 0.01;

TriangleMesh Mapped(const PosingEngine& engine, const ResolvedPose& pose, const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  const size_t parts = (mesh.vertices_mm.size() + kPointsAtOnce - 1) / kPointsAtOnce;
  ParallelFor(parts, [&](size_t part) {
    const size_t begin = part * kPointsAtOnce, end = std::min(begin + kPointsAtOnce, mesh.vertices_mm.size());
    std::vector<PointMm> points;
    for (size_t v = begin; v < end; ++v) points.push_back({mesh.vertices_mm[v].cast<double>()});
    points = engine.MapPoints(pose, points);
    for (size_t v = begin; v < end; ++v) out.vertices_mm[v] = points[v - begin].lps.cast<float>();
  });
  return out;
}

}  // namespace

struct TemplateSurfaces::State {
  struct Part {
    std::once_flag once;
    TriangleMesh mesh;
  };
  State(const BoneSet& b, const Mask& m, const SurfaceOptions& o)
      : bones(b), body(m), options(o), parts(b.bones.size()) {}
  const BoneSet& bones;
  const Mask& body;
  const SurfaceOptions options;
  std::vector<Part> parts;
  Part skin;
};

TemplateSurfaces::TemplateSurfaces(const BoneSet& bones, const Mask& body, const SurfaceOptions& options)
    : state_(std::make_unique<State>(bones, body, options)) {}
TemplateSurfaces::~TemplateSurfaces() = default;

const TriangleMesh& TemplateSurfaces::Bone(int bone) const {
  State::Part& part = state_->parts[size_t(bone)];
  std::call_once(part.once, [&] {
    part.mesh = MaskSurface(MaskOfLabel(state_->bones.labels, state_->bones.bones[size_t(bone)].label),
                            state_->options);
  });
  return part.mesh;
}

const TriangleMesh& TemplateSurfaces::Skin() const {
  std::call_once(state_->skin.once, [&] {
    state_->skin.mesh = LargePieces(MaskSurface(state_->body, state_->options), kLeastPiece);
  });
  return state_->skin.mesh;
}

std::vector<NamedSurface> TemplateSurfaces::Posed(const PosingEngine& engine, const ResolvedPose& pose,
                                                  const SurfaceChoice& choice) const {
  std::vector<int> bones;
  for (const std::string& name : choice.bones) bones.push_back(state_->bones.IndexOf(name));
  for (int bone = 0; choice.Everything() && bone < state_->bones.size(); ++bone) bones.push_back(bone);
  std::vector<NamedSurface> out;
  for (const int bone : bones) {
    out.push_back({state_->bones.bones[size_t(bone)].name, Bone(bone),
                   pose.scan_from_template[size_t(bone)].Matrix(), false});
  }
  if (choice.skin || choice.Everything())
    out.push_back({"skin", Mapped(engine, pose, Skin()), Eigen::Matrix4d::Identity(), true});
  return out;
}

}  // namespace kvx
