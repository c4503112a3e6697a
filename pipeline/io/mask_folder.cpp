// A file per bone, named after it.
#include "pipeline/io/mask_folder.h"

#include <algorithm>
#include <optional>

#include "core/errors.h"
#include "pipeline/io/dicom/series_folder.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/io/voxel_values.h"

namespace kvx {
namespace {

constexpr const char* kEndings[] = {".nii.gz", ".nii", ".seg.nrrd", ".nrrd", ".nhdr", ".mha", ".mhd", ".dcm"};
constexpr double kMostAstray = 0.25;  // of a voxel, of any voxel of a mask from its place among the first's

// What `read` makes of the bone's file.
template <class Read>
auto OfMask(const std::filesystem::path& folder, const std::string& bone, const Read& read) try {
  const std::filesystem::path file = MaskOf(folder, bone);
  if (file.empty()) throw InputError("is not in the folder");
  return read(file);
} catch (const InputError& error) {
  throw InputError("the mask of bone '" + bone + "': " + error.what());
}

// From the first voxel of `grid` to that of `mask`; nothing where the mask's voxels lie between the grid's.
std::optional<Eigen::Vector3i> StepsBetween(const Grid& grid, const Grid& mask) {
  constexpr double kFarthest = 1e6;
  const Eigen::Vector3d begin = grid.ToVox(mask.origin).ijk, whole = begin.array().round();
  if (!(begin.cwiseAbs().maxCoeff() < kFarthest)) return std::nullopt;
  const Eigen::Matrix3d astray = grid.VoxFromMm() * mask.MmFromVox() - Eigen::Matrix3d::Identity();
  const double most = (begin - whole).cwiseAbs().maxCoeff() +
                      (astray.cwiseAbs() * (mask.size.array() - 1).matrix().cast<double>()).maxCoeff();
  if (most > kMostAstray) return std::nullopt;
  return whole.cast<int>();
}

struct SharedGrid {
  Grid grid;
  std::vector<Eigen::Vector3i> first_voxel;  // of each bone's mask
};

// Of all masks: those of DICOM lack slices, and may lack rows and columns, without their bone.
SharedGrid GridOfAll(const std::filesystem::path& folder, const std::vector<StudyBone>& bones) {
  SharedGrid shared;
  Eigen::Vector3i least = Eigen::Vector3i::Zero(), end = least;
  for (const StudyBone& bone : bones) {
    const Grid mask = OfMask(folder, bone.name, ReadLabelsGrid);
    if (shared.first_voxel.empty()) shared.grid = mask;
    const auto steps = StepsBetween(shared.grid, mask);
    if (!steps)
      throw InputError("the masks of bones '" + bones.front().name + "' and '" + bone.name +
                       "' lie on different grids; export them all on one");
    shared.first_voxel.push_back(*steps);
    least = least.cwiseMin(*steps);
    end = end.cwiseMax(*steps + mask.size);
  }
  shared.grid.origin = shared.grid.ToMm(PointVox{least.cast<double>()});
  shared.grid.size = end - least;
  RequirePlausible(shared.grid, VoxelType::kUint16, 0);
  for (Eigen::Vector3i& voxel : shared.first_voxel) voxel -= least;
  return shared;
}

// Voxels of the mask, the first of which lies at `first`, that are no bone's yet become the bone's.
void Enter(const LabelMap& mask, const Eigen::Vector3i& first, const StudyBone& bone, LayeredLabels& out) {
  uint16_t inside = 0;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    const uint16_t value = mask.values[v];
    if (value == 0) continue;
    if (inside == 0) inside = value;
    if (value != inside)
      throw InputError("the mask of bone '" + bone.name +
                       "' has several values inside; a folder holds one mask a bone, 0 outside");
    const Eigen::Vector3i at = first + mask.grid.Ijk(v);
    uint16_t& label = out.labels(at.x(), at.y(), at.z());
    if (label == 0)
      label = uint16_t(bone.label);
    else
      ++out.shared_voxels[bone.label];
  }
}

bool HoldsDicomImage(const std::filesystem::path& folder) {
  return std::ranges::any_of(SeriesFiles(folder), [](const std::filesystem::path& file) {
    return SeriesFileAt(file) == SeriesFile::kImage;
  });
}

}  // namespace

std::filesystem::path MaskOf(const std::filesystem::path& folder, const std::string& bone) {
  std::filesystem::path found;
  for (const char* ending : kEndings) {
    std::error_code ignored;
    const std::filesystem::path file = folder / (bone + ending);
    if (!std::filesystem::is_regular_file(file, ignored)) continue;
    if (!found.empty())
      throw InputError("the folder of bones.labels holds two masks of bone '" + bone + "', " +
                       found.filename().string() + " and " + file.filename().string() +
                       "; leave there the one that is meant");
    found = file;
  }
  return found;
}

bool HoldsMasks(const std::filesystem::path& path, const std::vector<StudyBone>& bones) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return false;
  const auto has_mask = [&](const StudyBone& bone) { return !MaskOf(path, bone.name).empty(); };
  return std::ranges::any_of(bones, has_mask) || !HoldsDicomImage(path);
}

LayeredLabels ReadMasks(const std::filesystem::path& folder, const std::vector<StudyBone>& bones) {
  if (bones.empty()) return {};
  const SharedGrid shared = GridOfAll(folder, bones);
  LayeredLabels out{LabelMap(shared.grid), {}};
  for (size_t b = 0; b < bones.size(); ++b)
    Enter(OfMask(folder, bones[b].name, ReadLabels), shared.first_voxel[b], bones[b], out);
  return out;
}

LayeredLabels ReadLabelsOrMasks(const std::filesystem::path& path, const std::vector<StudyBone>& bones) {
  return HoldsMasks(path, bones) ? ReadMasks(path, bones) : ReadLayeredLabels(path);
}

}  // namespace kvx
