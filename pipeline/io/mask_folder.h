// Bones as one mask a file, named after its bone (`femur.nii.gz`), as TotalSegmentator and others write them:
// 0 outside the bone, one other value inside. DICOM segmentations (SEG) may be among them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/study.h"
#include "pipeline/io/layered_labels.h"

namespace kvx {

// The bone's file, of any format that ReadLabels takes; empty where the folder has none. Throws InputError
// where it has two: which one is out of date nobody can tell.
std::filesystem::path MaskOf(const std::filesystem::path& folder, const std::string& bone);

// Whether `path` is a folder of masks, of any of `bones` or no DICOM images; other folders are DICOM label
// maps.
bool HoldsMasks(const std::filesystem::path& path, const std::vector<StudyBone>& bones);

// The bones' labels on the grid of their masks, which may each be cut to where its bone is; other files in
// the folder do not matter. A voxel of two masks is the first bone's. Throws InputError where a mask is
// missing, has several values inside or has its voxels between those of the first.
LayeredLabels ReadMasks(const std::filesystem::path& folder, const std::vector<StudyBone>& bones);

// The masks of a folder, or else a label map (ReadLayeredLabels).
LayeredLabels ReadLabelsOrMasks(const std::filesystem::path& path, const std::vector<StudyBone>& bones);

}  // namespace kvx
