// Searches from the root, and where that leaves most in doubt, others; the surest one stays.
#include "pipeline/bones/search/scan_searches.h"

#include <algorithm>

#include "pipeline/bones/bone_set/bone_tree.h"
#include "pipeline/bones/images/half_turned.h"
#include "pipeline/bones/images/outer_air.h"
#include "pipeline/bones/search/any_contrast.h"
#include "pipeline/bones/template/search_tree.h"

namespace kvx {
namespace {

constexpr double kSurePart = 0.5;         // of the bones' voxels, with which a search has succeeded
constexpr double kGoodCorrelation = 0.7;  // in noise, too, bones match so well where they belong
constexpr size_t kOtherRoots = 2;         // the largest bones beside the root: most easily found
// In another contrast: greys of wider voxels are means of tissues, and a curve of greys does not map means.
constexpr int kMappedLevels = 2;

FoundBones Search(const SearchScene& scene, const SoughtBones& sought, Effort effort) {
  const BoneSearch search(sought, scene.scan, scene.backend, scene.hints, scene.progress);
  return FindBones(search, effort, scene.progress);
}

// In the order of the bones before they were listed from another root.
FoundBones InOrder(FoundBones found, const SearchTree& tree) {
  found.fits = tree.InOrder(found.fits);
  return found;
}

void TakeIfClearlyBetter(FoundBones other, FoundBones& best) {
  if (other.sure_nats > best.sure_nats + kFarMoreNats) best = std::move(other);
}

// `places`: of bones that the contrast was learnt from, by index.
FoundBones SearchMapped(const SearchScene& scene, const BoneSet& bones, const ContrastMap& contrast,
                        std::map<int, RigidTransform> places) {
  const SoughtBones sought(bones, Mapped(scene.template_volume, contrast), scene.finest_mm, kMappedLevels);
  const BoneSearch search(sought, scene.scan, scene.backend, scene.hints, scene.progress);
  return FindBones(search.TryingAlso(std::move(places)), Effort::kWhilePromising, scene.progress);
}

std::map<int, RigidTransform> SurePlaces(const BoneFits& fits) {
  std::map<int, RigidTransform> places;
  for (size_t b = 0; b < fits.size(); ++b) {
    if (!fits[b].Doubtful()) places[int(b)] = fits[b].scan_from_template;
  }
  return places;
}

std::optional<LearntContrast> Learnt(const SearchScene& scene, const BoneSearch& search) {
  const double voxel_mm = search.sought().FirstLevelMm(0);
  const SeenAir air{OuterAir(scene.template_volume, scene.template_modality, voxel_mm),
                    OuterAir(scene.scan, scene.modality, voxel_mm)};
  return LearnContrast(search, scene.template_volume, scene.scan, air, scene.backend);
}

// With the template as the scan would show it, by what the root shows, then by what all bones found so do.
// Nothing where the scan's contrast is that of the template.
std::optional<FoundBones> SearchInOtherContrast(const SearchScene& scene, const SoughtBones& sought) {
  const BoneSet& bones = sought.bones();
  const SoughtBones finely(bones, scene.template_volume, scene.finest_mm, kMappedLevels);
  const BoneSearch fine(finely, scene.scan, scene.backend, {}, scene.progress);
  std::optional<LearntContrast> learnt = Learnt(scene, fine);
  if (sought.FirstLevelOf(0) != finely.FirstLevelOf(0)) {
    auto other = Learnt(scene, BoneSearch(sought, scene.scan, scene.backend, {}, scene.progress));
    if (other && (!learnt || other->nats > learnt->nats)) learnt = std::move(other);
  }
  if (!learnt) return std::nullopt;
  FoundBones best = SearchMapped(scene, bones, learnt->scan_of_template, {{0, learnt->root}});
  const bool all = std::ranges::none_of(best.fits, [](const BoneFit& fit) { return fit.Doubtful(); });
  const auto again = all ? std::nullopt : ContrastOfBones(fine, best.fits, scene.template_volume, scene.scan);
  if (again) TakeIfClearlyBetter(SearchMapped(scene, bones, *again, SurePlaces(best.fits)), best);
  return best;
}

FoundBones SearchTurned(const SearchScene& scene, const SoughtBones& sought, int axis) {
  const HalfTurned turned = TurnedByHalf(scene.scan, axis);
  auto hints = scene.hints;
  for (auto& [bone, pose] : hints) pose = turned.turned_from_scan * pose;
  const BoneSearch search(sought, turned.scan, scene.backend, hints, scene.progress);
  FoundBones found = FindBones(search, Effort::kWhilePromising, scene.progress);
  for (BoneFit& fit : found.fits)
    fit.scan_from_template = turned.turned_from_scan.Inverse() * fit.scan_from_template;
  return found;
}

// A search expects scans to be taken much alike. Half turns about three axes bring every other way to within
// its reach.
FoundBones SearchFromOtherSides(const SearchScene& scene, const SoughtBones& sought) {
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

}  // namespace

bool Succeeded(const FoundBones& found) { return found.sure_part >= kSurePart; }

bool MayLieOtherwise(const FoundBones& found) {
  return !Succeeded(found) || found.sure_correlation < kGoodCorrelation;
}

bool FindsFarMore(const FoundBones& found, const FoundBones& than) {
  return !MayLieOtherwise(found) && found.sure_nats > than.sure_nats + kFarMoreNats;
}

FoundBones SearchEveryWay(const SearchScene& scene, const SoughtBones& sought) {
  FoundBones best = Search(scene, sought, Effort::kToTheEnd);
  if (!Succeeded(best) || best.fits[0].Doubtful()) {
    if (auto found = SearchInOtherContrast(scene, sought)) TakeIfClearlyBetter(std::move(*found), best);
  }
  if (MayLieOtherwise(best)) {
    FoundBones other = SearchFromOtherSides(scene, sought);
    if (FindsFarMore(other, best)) best = std::move(other);
  }
  if (Succeeded(best)) return best;
  std::vector<SearchTree> others;
  for (const int root : LargestBut(sought.bones(), 0, kOtherRoots))
    others.push_back(RootedAt(sought.bones(), root));
  for (size_t r = 0; r < others.size() && !Succeeded(best); ++r) {
    const SoughtBones from_there(others[r].bones, scene.template_volume, scene.finest_mm);
    FoundBones found = Search(scene, from_there, Effort::kWhilePromising);
    TakeIfClearlyBetter(InOrder(std::move(found), others[r]), best);
  }
  for (size_t r = 0; r < others.size() && !Succeeded(best); ++r) {
    const SoughtBones from_there(others[r].bones, scene.template_volume, scene.finest_mm);
    if (auto found = SearchInOtherContrast(scene, from_there))
      TakeIfClearlyBetter(InOrder(std::move(*found), others[r]), best);
  }
  return best;
}

FoundBones SearchFromAnySide(const SearchScene& scene, const SoughtBones& sought) {
  FoundBones found = Search(scene, sought, Effort::kWhilePromising);
  return MayLieOtherwise(found) ? SearchFromOtherSides(scene, sought) : found;
}

}  // namespace kvx
