// From a label map and a bone list to the template's BoneSet.
#include "pipeline/bones/build_bone_set.h"

#include "core/errors.h"
#include "pipeline/bones/bone_tree.h"
#include "pipeline/bones/region_presets.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/segmentation/names/propose_names.h"

namespace kvx {
namespace {

// Nearest label at every voxel of the template's grid.
LabelMap Resampled(const LabelMap& labels, const Grid& grid) {
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

// The preset's bones for labels 1, 2, ...; bones that the map does not hold are left out (their children must
// be, too).
std::vector<StudyBone> PresetBones(Region region, const std::vector<size_t>& voxels_of_label) {
  std::vector<StudyBone> bones;
  int label = 0;
  for (const PresetBone& bone : RegionPreset(region)) {
    ++label;
    if (voxels_of_label[label] > 0) bones.push_back({label, bone.name, bone.parent});
  }
  return bones;
}

void KeepOnly(const std::vector<Bone>& bones, LabelMap& labels) {
  std::vector<uint8_t> listed(65536, 0);
  for (const Bone& bone : bones) listed[bone.label] = 1;
  for (uint16_t& value : labels.values) {
    if (!listed[value]) value = 0;
  }
}

void MeasureBones(const LabelMap& labels, std::vector<Bone>& bones) {
  std::vector<int> bone_of_label(65536, -1);
  for (size_t b = 0; b < bones.size(); ++b) bone_of_label[bones[b].label] = int(b);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const int b = bone_of_label[labels.values[v]];
    if (b < 0) continue;
    bones[b].voxels += 1;
    bones[b].centroid.lps += labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps;
  }
  for (Bone& bone : bones) bone.centroid.lps /= double(bone.voxels);
}

// The root's base is the end away from its children.
PointMm TowardsParent(const std::vector<Bone>& bones, size_t b) {
  if (bones[b].parent != kNoParent) return bones[bones[b].parent].centroid;
  Eigen::Vector3d children = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Bone& bone : bones) {
    if (bone.parent == int(b)) children += bone.centroid.lps, ++count;
  }
  if (count == 0) return bones[b].centroid;
  return PointMm{2 * bones[b].centroid.lps - children / count};
}

}  // namespace

BoneSet BuildBoneSet::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  BoneSet out;
  const LabelMap& labels = inputs.segmented ? (*inputs.segmented)->labels : ReadLabels(inputs.labels_path);
  out.labels = Resampled(labels, inputs.template_scan->volume.grid);
  std::vector<size_t> voxels_of_label(65536, 0);
  for (const uint16_t value : out.labels.values) ++voxels_of_label[value];
  if (!options.bones.empty()) {
    out.bones = OrderedBones(options.bones);
  } else if (inputs.segmented && (*inputs.segmented)->numbered_by_size) {
    out.bones = OrderedBones(SurelyNamed(ProposeNames(out.labels, options.region)));
  } else {
    out.bones = OrderedBones(PresetBones(options.region, voxels_of_label));
  }
  for (const Bone& bone : out.bones) {
    if (voxels_of_label[bone.label] > 0) continue;
    throw InputError(
        "label " + std::to_string(bone.label) + " of bone '" + bone.name +
        "' has no voxels on the template's grid; check the label map and its place in the world");
  }
  context.progress.Report(kName, 0.3);
  KeepOnly(out.bones, out.labels);
  MeasureBones(out.labels, out.bones);
  for (size_t b = 0; b < out.bones.size(); ++b) {
    out.bones[b].box = FitOrientedBox(out.labels, out.bones[b].label, TowardsParent(out.bones, b));
    context.progress.Report(kName, 0.3 + 0.7 * double(b + 1) / double(out.bones.size()));
  }
  return out;
}

}  // namespace kvx
