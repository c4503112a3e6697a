// Counts voxels; nothing here changes the model.
#include "pipeline/model/label_warnings.h"

#include <algorithm>
#include <cmath>

#include "pipeline/segmentation/names/propose_names.h"

namespace kvx {
namespace {

// A map's border may stand a voxel out from the skin, where a thin finger's bone comes near it
constexpr double kMostBeside = 0.1;  // of the body's voxels
constexpr double kMostOutside = 0.1;
constexpr size_t kMostNamed = 12;
constexpr double kFarMm = 10, kMuchNearer = 0.33;  // from a parent; another bone, times that distance
constexpr size_t kSurfaceVoxels = 400;             // of a bone, that distances are measured from

// "3, 7, 12 and 4 more"
std::string Listed(const std::vector<std::string>& names) {
  std::string out;
  for (size_t n = 0; n < std::min(names.size(), kMostNamed); ++n) out += (n ? ", " : "") + names[n];
  if (names.size() > kMostNamed) out += " and " + std::to_string(names.size() - kMostNamed) + " more";
  return out;
}

// "femur (3)" for every bone that has such voxels, after what is said of them all.
void Tell(const std::string& what, const BoneSet& bones, const std::vector<size_t>& voxels,
          std::vector<std::string>& out) {
  std::vector<std::string> names;
  for (size_t b = 0; b < voxels.size(); ++b) {
    if (voxels[b] > 0) names.push_back(bones.bones[b].name + " (" + std::to_string(voxels[b]) + ")");
  }
  if (!names.empty()) out.push_back("the label map " + what + ": " + Listed(names));
}

bool AtSurface(const LabelMap& labels, const Eigen::Vector3i& at) {
  const uint16_t label = labels(at.x(), at.y(), at.z());
  for (int a = 0; a < 3; ++a) {
    for (const int step : {-1, 1}) {
      const Eigen::Vector3i beside = at + step * Eigen::Vector3i::Unit(a);
      if (!labels.grid.Contains(beside) || labels(beside.x(), beside.y(), beside.z()) != label) return true;
    }
  }
  return false;
}

// Some voxels of each bone's surface, mm.
std::vector<std::vector<Eigen::Vector3d>> Surfaces(const BoneSet& bones) {
  std::vector<int> bone_of(65536, kNoParent);
  for (int b = 0; b < bones.size(); ++b) bone_of[size_t(bones.bones[size_t(b)].label)] = b;
  std::vector<std::vector<Eigen::Vector3d>> all(size_t(bones.size()));
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    const int b = bone_of[bones.labels.values[v]];
    if (bones.labels.values[v] == 0 || b == kNoParent) continue;
    const Eigen::Vector3i at = bones.labels.grid.Ijk(v);
    if (AtSurface(bones.labels, at))
      all[size_t(b)].push_back(bones.labels.grid.ToMm(PointVox{at.cast<double>()}).lps);
  }
  for (auto& surface : all) {
    const size_t step = surface.size() / kSurfaceVoxels + 1;
    size_t kept = 0;
    for (size_t n = 0; n < surface.size(); n += step) surface[kept++] = surface[n];
    surface.resize(kept);
  }
  return all;
}

double ApartMm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double squared = 1e30;
  for (const Eigen::Vector3d& x : a) {
    for (const Eigen::Vector3d& y : b) squared = std::min(squared, (x - y).squaredNorm());
  }
  return std::sqrt(squared);
}

}  // namespace

std::vector<std::string> LabelWarnings(const BoneSet& bones) {
  std::vector<std::string> warnings;
  if (!bones.mending.unused_labels.empty()) {
    std::vector<std::string> unused;
    for (const int label : bones.mending.unused_labels) unused.push_back(std::to_string(label));
    warnings.push_back(
        "the label map also holds labels that the list gives no bone, so they are soft tissue here, or bone "
        "where a bone encloses them: " +
        Listed(unused));
  }
  Tell("holds stray voxels apart from the rest of their bones, which are soft tissue here", bones,
       bones.mending.stray_voxels, warnings);
  Tell("encloses voxels of no bone, which are bone here", bones, bones.mending.enclosed_voxels, warnings);
  return warnings;
}

std::vector<std::string> NameWarnings(const BoneSet& bones, Region region) {
  const std::vector<std::string> otherwise = LooksOtherwise(bones, region);
  if (otherwise.empty()) return {};
  return {"by how bones lie to each other some look like others of the region; check which label is which: " +
          Listed(otherwise)};
}

std::vector<std::string> ParentWarnings(const BoneSet& bones) {
  const std::vector<std::vector<Eigen::Vector3d>> surfaces = Surfaces(bones);
  std::vector<std::string> far;
  for (size_t b = 0; b < surfaces.size(); ++b) {
    const int parent = bones.bones[b].parent;
    if (parent == kNoParent) continue;
    const double to_parent_mm = ApartMm(surfaces[b], surfaces[size_t(parent)]);
    if (to_parent_mm <= kFarMm) continue;
    for (size_t other = 0; other < surfaces.size(); ++other) {
      if (other == b || bones.bones[other].parent == int(b)) continue;
      if (ApartMm(surfaces[b], surfaces[other]) > kMuchNearer * to_parent_mm) continue;
      far.push_back(bones.bones[b].name + " (" + bones.bones[size_t(parent)].name + " is " +
                    std::to_string(std::lround(to_parent_mm)) + " mm away)");
      break;
    }
  }
  if (far.empty()) return {};
  return {
      "these bones lie far from their parents, with other bones much nearer; a bone's parent is the one that "
      "it meets at a joint: " +
      Listed(far)};
}

std::vector<std::string> BonesOutsideBody(const BoneSet& bones, const Mask& body) {
  std::vector<size_t> outside(65536, 0);
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    if (!body.values[v]) ++outside[bones.labels.values[v]];
  }
  std::vector<std::string> names;
  for (const Bone& bone : bones.bones) {
    const double share = double(outside[size_t(bone.label)]) / double(bone.voxels);
    if (share > kMostOutside)
      names.push_back(bone.name + " (" + std::to_string(std::lround(100 * share)) + " %)");
  }
  if (names.empty()) return {};
  return {
      "these bones lie partly outside the body of the template; was the label map made on this scan, and not "
      "mirrored or moved since? " +
      Listed(names)};
}

std::vector<std::string> TissueBesideBody(const Volume& scan, const Mask& body) {
  std::vector<float> inside;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (body.values[v]) inside.push_back(scan.values[v]);
  }
  if (inside.empty()) return {};
  const auto middle = inside.begin() + std::ptrdiff_t(inside.size() / 2);
  std::ranges::nth_element(inside, middle);
  size_t beside = 0;
  for (size_t v = 0; v < body.values.size(); ++v) beside += !body.values[v] && scan.values[v] > *middle;
  if (double(beside) <= kMostBeside * double(inside.size())) return {};
  return {
      "the template shows tissue that no bone of the label map moves (another limb?); the model leaves it "
      "out. Label its bones if it belongs to the study"};
}

}  // namespace kvx
