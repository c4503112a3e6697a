// A file per bone, named after it.
#include "pipeline/io/mask_folder.h"

#include "core/errors.h"
#include "pipeline/io/volume_file.h"

namespace kvx {
namespace {

constexpr const char* kEndings[] = {".nii.gz", ".nii", ".seg.nrrd", ".nrrd", ".nhdr", ".mha", ".mhd"};

LabelMap ReadMask(const std::filesystem::path& folder, const std::string& bone) try {
  const std::filesystem::path file = MaskOf(folder, bone);
  if (file.empty()) throw InputError("is not in the folder");
  return ReadLabels(file);
} catch (const InputError& error) {
  throw InputError("the mask of bone '" + bone + "': " + error.what());
}

// Voxels of the mask that are no bone's yet become `label`.
void Enter(const LabelMap& mask, const StudyBone& bone, LayeredLabels& out) {
  uint16_t inside = 0;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    const uint16_t value = mask.values[v];
    if (value == 0) continue;
    if (inside == 0) inside = value;
    if (value != inside)
      throw InputError("the mask of bone '" + bone.name +
                       "' has several values inside; a folder holds one mask a bone, 0 outside");
    uint16_t& label = out.labels.values[v];
    if (label == 0)
      label = uint16_t(bone.label);
    else
      ++out.shared_voxels[bone.label];
  }
}

}  // namespace

std::filesystem::path MaskOf(const std::filesystem::path& folder, const std::string& bone) {
  for (const char* ending : kEndings) {
    std::error_code ignored;
    const std::filesystem::path file = folder / (bone + ending);
    if (std::filesystem::is_regular_file(file, ignored)) return file;
  }
  return {};
}

LayeredLabels ReadMasks(const std::filesystem::path& folder, const std::vector<StudyBone>& bones) {
  LayeredLabels out;
  for (const StudyBone& bone : bones) {
    const LabelMap mask = ReadMask(folder, bone.name);
    if (out.labels.values.empty()) out.labels = LabelMap(mask.grid);
    if (mask.grid != out.labels.grid)
      throw InputError("the masks of bones '" + bones.front().name + "' and '" + bone.name +
                       "' lie on different grids; export them all on one");
    Enter(mask, bone, out);
  }
  return out;
}

LayeredLabels ReadLabelsOrMasks(const std::filesystem::path& path, const std::vector<StudyBone>& bones) {
  return is_directory(path) ? ReadMasks(path, bones) : ReadLayeredLabels(path);
}

}  // namespace kvx
