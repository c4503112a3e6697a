// From a label map and a bone list to the template's BoneSet.
#include "pipeline/bones/build_bone_set.h"

#include <numeric>
#include <set>

#include "core/bone_of_label.h"
#include "core/errors.h"
#include "core/region_presets.h"
#include "pipeline/bones/bone_set/bone_tree.h"
#include "pipeline/bones/bone_set/oriented_box.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/segmentation/mend_labels.h"
#include "pipeline/segmentation/names/propose_names.h"
#include "pipeline/segmentation/strokes/grey_values.h"

namespace kvx {
namespace {

constexpr size_t kLeastVoxels = 20;  // of the largest bone

// Nearest label at every voxel of the template's grid.
LabelMap Resampled(LabelMap labels, const Grid& grid) {
  if (labels.grid == grid) return labels;
  LabelMap out(grid);
  const Eigen::Matrix3d label_vox_from_vox = labels.grid.VoxFromMm() * grid.MmFromVox();
  const Eigen::Vector3d shift = labels.grid.ToVox(grid.origin).ijk;
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3d p = label_vox_from_vox * grid.Ijk(v).cast<double>() + shift;
    const Eigen::Vector3i nearest = (p.array() + 0.5).floor().cast<int>().matrix();
    if (labels.grid.Contains(nearest)) out.values[v] = labels(nearest.x(), nearest.y(), nearest.z());
  }
  return out;
}

LayeredLabels LabelsOf(const BuildBoneSet::Inputs& inputs, const std::vector<StudyBone>& bones) {
  if (inputs.segmented) return {(*inputs.segmented)->labels, {}};
  LayeredLabels given = ReadLabelsOrMasks(inputs.labels_path, bones);
  RequireNoScan(given.labels);
  return given;
}

std::vector<int> LabelsWithVoxels(const std::vector<size_t>& voxels_of_label) {
  std::vector<int> labels;
  for (size_t label = 1; label < voxels_of_label.size(); ++label) {
    if (voxels_of_label[label] > 0) labels.push_back(int(label));
  }
  return labels;
}

// The preset's bones for labels 1, 2, ...
std::vector<StudyBone> PresetBones(Region region, const std::vector<size_t>& voxels_of_label) {
  const auto& preset = RegionPreset(region);
  if (!preset.empty() && voxels_of_label[1] == 0) {
    throw InputError("label 1, the " + preset.front().name +
                     ", has no voxels; say in bones.list which label is which bone, and what is its parent");
  }
  return HeldBones(region, [&](const PresetBone&, int label) { return voxels_of_label[label] > 0; });
}

// Marks at joints, say: a search for them would go on for an hour and find nothing.
void RequireBonesNotPoints(const std::vector<Bone>& bones, const std::vector<size_t>& voxels_of_label) {
  size_t most = 0;
  for (const Bone& bone : bones) most = std::max(most, voxels_of_label[size_t(bone.label)]);
  if (most < kLeastVoxels) {
    throw InputError(
        "the largest bone of the label map has " + std::to_string(most) +
        " voxels on the template's grid; label whole bones, not points, on a grid about as fine as "
        "the template's");
  }
}

std::vector<StudyBone> BonesWithoutList(const BuildBoneSet::Inputs& inputs, Region region,
                                        const LabelMap& labels, const std::vector<size_t>& voxels_of_label) {
  const bool by_size = inputs.segmented && (*inputs.segmented)->numbered_by_size;
  const bool by_number = !by_size && NumberedAsPreset(LabelsWithVoxels(voxels_of_label), region);
  return by_number ? PresetBones(region, voxels_of_label) : SurelyNamed(ProposeNames(labels, region));
}

// Clears and returns labels of no bone, in order.
std::vector<int> TakeUnusedOut(const std::vector<Bone>& bones, LabelMap& labels) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones);
  std::set<int> unused;
  for (uint16_t& value : labels.values) {
    if (value == 0 || bone_of_label[value] != kNoBone) continue;
    unused.insert(value);
    value = 0;
  }
  return {unused.begin(), unused.end()};
}

size_t CountOf(const VoxelsByLabel& voxels, int label) {
  const auto found = voxels.find(label);
  return found == voxels.end() ? 0 : found->second.size();
}

void MeasureBones(const LabelMap& labels, std::vector<Bone>& bones) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const int b = bone_of_label[labels.values[v]];
    if (b == kNoBone) continue;
    bones[b].voxels += 1;
    bones[b].centroid.lps += labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps;
  }
  for (Bone& bone : bones) bone.centroid.lps /= double(bone.voxels);
}

// The root's base is the end away from its children; a bone by itself has the world to go by.
BoxGuide GuideOfRoot(const std::vector<Bone>& bones, size_t root) {
  const Eigen::Vector3d here = bones[root].centroid.lps;
  std::vector<Eigen::Vector3d> children;
  for (const Bone& bone : bones)
    if (bone.parent == int(root)) children.push_back(bone.centroid.lps);
  if (children.empty()) return {PointMm{here + Eigen::Vector3d::UnitZ()}, Eigen::Vector3d::UnitX()};
  const Eigen::Vector3d mean =
      std::accumulate(children.begin(), children.end(), Eigen::Vector3d::Zero().eval()) /
      double(children.size());
  return {PointMm{2 * here - mean}, Eigen::Vector3d::Zero(), children.back() - children.front()};
}

BoxGuide GuideOf(const std::vector<Bone>& bones, size_t b) {
  if (bones[b].parent == kNoParent) return GuideOfRoot(bones, b);
  const Bone& parent = bones[size_t(bones[b].parent)];
  return {parent.centroid, parent.box.axes.col(0), parent.box.axes.col(1)};
}

}  // namespace

BoneSet BuildBoneSet::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  BoneSet out;
  const Grid& grid = inputs.template_scan->volume.grid;
  LayeredLabels given = LabelsOf(inputs, options.bones);
  MendedLabels mended =
      inputs.segmented ? MendedLabels{std::move(given.labels), {}, {}} : MendLabels(std::move(given.labels));
  out.labels = Resampled(std::move(mended.labels), grid);
  std::vector<size_t> voxels_of_label(65536, 0);
  for (const uint16_t value : out.labels.values) ++voxels_of_label[value];
  if (voxels_of_label[0] == out.labels.values.size()) {
    throw InputError("the label map has no bone on the template's grid; check its place in the world");
  }
  out.bones = OrderedBones(options.bones.empty()
                               ? BonesWithoutList(inputs, options.region, out.labels, voxels_of_label)
                               : options.bones);
  for (const Bone& bone : out.bones) {
    if (voxels_of_label[bone.label] > 0) continue;
    throw InputError(
        "label " + std::to_string(bone.label) + " of bone '" + bone.name +
        "' has no voxels on the template's grid; check the label map and its place in the world");
  }
  RequireBonesNotPoints(out.bones, voxels_of_label);
  context.progress.Report(kName, 0.3);
  out.mending.unused_labels = TakeUnusedOut(out.bones, out.labels);
  const VoxelsByLabel within = out.mending.unused_labels.empty() ? VoxelsByLabel{} : FillEnclosed(out.labels);
  for (const Bone& bone : out.bones) {
    out.mending.shared_voxels.push_back(given.shared_voxels[bone.label]);
    out.mending.stray_voxels.push_back(CountOf(mended.strays, bone.label));
    out.mending.enclosed_voxels.push_back(CountOf(mended.filled, bone.label) + CountOf(within, bone.label));
  }
  MeasureBones(out.labels, out.bones);
  for (size_t b = 0; b < out.bones.size(); ++b) {
    out.bones[b].box = FitOrientedBox(out.labels, out.bones[b].label, GuideOf(out.bones, b));
    context.progress.Report(kName, 0.3 + 0.7 * double(b + 1) / double(out.bones.size()));
  }
  return out;
}

}  // namespace kvx
