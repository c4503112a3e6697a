// Eq. 1 for one scan: a search from the root; where that leaves most in doubt, others, and the surest one
// stays.
#include "pipeline/bones/register_bones.h"

#include <algorithm>

#include "pipeline/bones/any_contrast.h"
#include "pipeline/bones/bone_tree.h"
#include "pipeline/bones/even_light.h"
#include "pipeline/bones/find_bones.h"
#include "pipeline/bones/half_turned.h"
#include "pipeline/bones/mirror_image.h"
#include "pipeline/bones/outer_air.h"
#include "pipeline/bones/search_tree.h"
#include "pipeline/scans/finer_scan.h"

namespace kvx {
namespace {

constexpr double kSurePart = 0.5;         // of the bones' voxels, with which a search has succeeded
constexpr double kGoodCorrelation = 0.7;  // in noise, too, bones match so well where they belong
constexpr double kClearNats = 12;         // as much better is another search than the one from the root,
                                          // or the mirror images of the bones that it found
// Below, the scan's mirror image is searched, too: a mirrored knee's bones match by 0.75 to 0.85.
constexpr double kRightCorrelation = 0.8;
constexpr size_t kOtherRoots = 2;  // the largest bones beside the root: most easily found
// In another contrast: greys of wider voxels are means of tissues, and a curve of greys does not map means.
constexpr int kMappedLevels = 2;

// What all searches of one scan share.
struct Scene {
  const Volume& template_volume;  // without shading, as the scan
  Volume scan;
  const std::string &template_modality, &modality;
  double finest_mm;
  const RegisterBones::Options& options;
  StageContext& context;
};

FoundBones Search(const Scene& scene, const SoughtBones& sought) {
  const BoneSearch search(sought, scene.scan, scene.context.backend, scene.options.initial_poses);
  return FindBones(search, scene.context.progress);
}
FoundBones Search(const Scene& scene, const BoneSet& bones, const Volume& template_volume) {
  return Search(scene, SoughtBones(bones, template_volume, scene.finest_mm));
}

// In the order of the bones before they were listed from another root.
FoundBones InOrder(FoundBones found, const SearchTree& tree) {
  found.fits = tree.InOrder(found.fits);
  return found;
}

void TakeIfClearlyBetter(FoundBones other, FoundBones& best) {
  if (other.sure_nats > best.sure_nats + kClearNats) best = std::move(other);
}

// `places`: of bones that the contrast was learnt from, by index.
FoundBones SearchMapped(const Scene& scene, const BoneSet& bones, const ContrastMap& contrast,
                        std::map<int, RigidTransform> places) {
  const SoughtBones sought(bones, Mapped(scene.template_volume, contrast), scene.finest_mm, kMappedLevels);
  const BoneSearch search(sought, scene.scan, scene.context.backend, scene.options.initial_poses);
  return FindBones(search.TryingAlso(std::move(places)), scene.context.progress);
}

std::map<int, RigidTransform> SurePlaces(const BoneFits& fits) {
  std::map<int, RigidTransform> places;
  for (size_t b = 0; b < fits.size(); ++b) {
    if (!fits[b].Doubtful()) places[int(b)] = fits[b].scan_from_template;
  }
  return places;
}

std::optional<LearntContrast> Learnt(const Scene& scene, const BoneSearch& search) {
  const double voxel_mm = search.sought().FirstLevelMm(0);
  const SeenAir air{OuterAir(scene.template_volume, scene.template_modality, voxel_mm),
                    OuterAir(scene.scan, scene.modality, voxel_mm)};
  return LearnContrast(search, scene.template_volume, scene.scan, air, scene.context.backend);
}

// With the template as the scan would show it, by what the root shows, then by what all bones found so do.
// Nothing where the scan's contrast is that of the template.
std::optional<FoundBones> SearchInOtherContrast(const Scene& scene, const SoughtBones& sought) {
  const BoneSet& bones = sought.bones();
  const SoughtBones finely(bones, scene.template_volume, scene.finest_mm, kMappedLevels);
  const BoneSearch fine(finely, scene.scan, scene.context.backend, {});
  std::optional<LearntContrast> learnt = Learnt(scene, fine);
  if (sought.FirstLevelOf(0) != finely.FirstLevelOf(0)) {
    auto other = Learnt(scene, BoneSearch(sought, scene.scan, scene.context.backend, {}));
    if (other && (!learnt || other->nats > learnt->nats)) learnt = std::move(other);
  }
  if (!learnt) return std::nullopt;
  FoundBones best = SearchMapped(scene, bones, learnt->scan_of_template, {{0, learnt->root}});
  const bool all = std::ranges::none_of(best.fits, [](const BoneFit& fit) { return fit.Doubtful(); });
  const auto again = all ? std::nullopt : ContrastOfBones(fine, best.fits, scene.template_volume, scene.scan);
  if (again) TakeIfClearlyBetter(SearchMapped(scene, bones, *again, SurePlaces(best.fits)), best);
  return best;
}

FoundBones SearchTurned(const Scene& scene, const SoughtBones& sought, int axis) {
  const HalfTurned turned = TurnedByHalf(scene.scan, axis);
  auto hints = scene.options.initial_poses;
  for (auto& [bone, pose] : hints) pose = turned.turned_from_scan * pose;
  const BoneSearch search(sought, turned.scan, scene.context.backend, hints);
  FoundBones found = FindBones(search, scene.context.progress);
  for (BoneFit& fit : found.fits)
    fit.scan_from_template = turned.turned_from_scan.Inverse() * fit.scan_from_template;
  return found;
}

// A search expects scans to be taken much alike. Half turns about three axes bring every other way to within
// its reach.
FoundBones SearchFromOtherSides(const Scene& scene, const SoughtBones& sought) {
  FoundBones best = SearchTurned(scene, sought, 0);
  for (const int axis : {1, 2}) {
    FoundBones found = SearchTurned(scene, sought, axis);
    if (found.sure_nats > best.sure_nats) best = std::move(found);
  }
  return best;
}

std::vector<int> LargestBut(const BoneSet& bones, int root, size_t count) {
  std::vector<int> order = LargestFirst(bones);
  std::erase(order, root);
  order.resize(std::min(order.size(), count));
  return order;
}

bool Succeeded(const FoundBones& found) { return found.sure_part >= kSurePart; }
// A leg upside down has bones where it seeks them, but they match badly.
bool MayLieOtherwise(const FoundBones& found) {
  return !Succeeded(found) || found.sure_correlation < kGoodCorrelation;
}

// As it is; then in other greys, from other sides and from other bones, until one way leaves less than half
// in doubt.
FoundBones SearchEveryWay(const Scene& scene, const SoughtBones& sought) {
  FoundBones best = Search(scene, sought);
  if (!Succeeded(best) || best.fits[0].Doubtful()) {
    if (auto found = SearchInOtherContrast(scene, sought)) TakeIfClearlyBetter(std::move(*found), best);
  }
  if (MayLieOtherwise(best)) {
    FoundBones other = SearchFromOtherSides(scene, sought);
    if (!MayLieOtherwise(other)) TakeIfClearlyBetter(std::move(other), best);
  }
  if (Succeeded(best)) return best;
  std::vector<SearchTree> others;
  for (const int root : LargestBut(sought.bones(), 0, kOtherRoots))
    others.push_back(RootedAt(sought.bones(), root));
  for (size_t r = 0; r < others.size() && !Succeeded(best); ++r) {
    FoundBones found = Search(scene, others[r].bones, scene.template_volume);
    TakeIfClearlyBetter(InOrder(std::move(found), others[r]), best);
  }
  for (size_t r = 0; r < others.size() && !Succeeded(best); ++r) {
    const SoughtBones from_there(others[r].bones, scene.template_volume, scene.finest_mm);
    if (auto found = SearchInOtherContrast(scene, from_there))
      TakeIfClearlyBetter(InOrder(std::move(*found), others[r]), best);
  }
  return best;
}

// Whether its mirror image shows the template's bones far better than the scan itself.
bool IsMirrored(const Scene& scene, const SoughtBones& sought, const FoundBones& as_it_is) {
  const RegisterBones::Options without_hints;
  const Scene mirrored{scene.template_volume, Mirrored(scene.scan), scene.template_modality,
                       scene.modality,        scene.finest_mm,      without_hints,
                       scene.context};
  FoundBones found = Search(mirrored, sought);
  if (MayLieOtherwise(found)) found = SearchFromOtherSides(mirrored, sought);
  return !MayLieOtherwise(found) && found.sure_nats > as_it_is.sure_nats + kClearNats;
}

const std::string kWhyMirrored =
    "the scan shows mirror images of the template's bones; it may be of the body's other side, or a tool has "
    "flipped it: export it again, or leave it out of the study";

}  // namespace

BoneFits RegisterBones::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const Grid& template_grid = inputs.shown.scan()->volume.grid;
  Volume scan = AsFineAs(EvenlyLit(*inputs.scan), template_grid.MeanSpacingMm());
  const double finest_mm = FinestMm(template_grid, scan.grid);
  const Scene scene{inputs.shown.Lit(),
                    std::move(scan),
                    inputs.shown.scan()->modality,
                    inputs.scan->modality,
                    finest_mm,
                    options,
                    context};
  const SoughtBones& sought = inputs.shown.Sought(finest_mm);
  FoundBones found = SearchEveryWay(scene, sought);
  const bool matches_badly = MayLieOtherwise(found) || found.sure_correlation < kRightCorrelation;
  if (MirrorNats(sought, scene.scan, found.fits) > kClearNats ||
      (matches_badly && IsMirrored(scene, sought, found)))
    DoubtAll(Doubt::kMirrored, kWhyMirrored, found.fits);
  return inputs.shown.InOrder(std::move(found.fits));
}

PoseVector PoseOf(const BoneFits& fits) {
  PoseVector pose;
  for (const BoneFit& fit : fits) pose.push_back(fit.scan_from_template);
  return pose;
}

}  // namespace kvx
