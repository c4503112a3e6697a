#include "pipeline/io/dicom/dicom_segments.h"

#include <algorithm>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_files.h"
#include "pipeline/io/dicom/dicom_slices.h"
#include "pipeline/io/dicom/segment_frames.h"
#include "pipeline/io/voxel_values.h"

namespace kvx {
namespace {

// The grid with the size in the plane, which all files must share.
Grid WholeGrid(const std::vector<DicomFile>& files, const DicomSlices& placed) {
  const Grid grid = placed.GridOf(files.front().columns, files.front().rows);
  RequirePlausible(grid, VoxelType::kUint16, 0);
  for (const DicomFile& file : files) {
    if (file.columns != grid.size.x() || file.rows != grid.size.y())
      throw InputError("the frames of the DICOM segmentation (SEG) differ in size; give one segmentation");
  }
  return grid;
}

// The label that the stored value of a voxel means, 0 outside.
uint16_t LabelOf(uint16_t stored, int segment, const DicomFile& file) {
  if (file.numbered) return stored;
  const bool inside = file.certain > 0 ? 2 * size_t(stored) >= file.certain : stored > 0;
  return inside ? uint16_t(segment) : uint16_t(0);
}

// Whatever the order of frames, the first segment keeps what several hold.
void Enter(const std::vector<uint16_t>& stored, const DicomSlice& slice, const DicomFile& file,
           LayeredLabels& out) {
  uint16_t* const plane = &out.labels.values[slice.plane * stored.size()];
  for (size_t v = 0; v < stored.size(); ++v) {
    const uint16_t label = LabelOf(stored[v], slice.place.segment, file);
    if (label == 0) continue;
    if (plane[v] != 0) ++out.shared_voxels[std::max(plane[v], label)];
    plane[v] = plane[v] == 0 ? label : std::min(plane[v], label);
  }
}

}  // namespace

std::optional<LayeredLabels> FindDicomSegments(const std::vector<DicomFile>& headers) {
  const std::vector<DicomFile> files = SegmentationFiles(headers);
  if (files.empty()) return std::nullopt;
  const DicomSlices placed = PlaceSegments(files);
  LayeredLabels out{LabelMap(WholeGrid(files, placed)), {}};
  for (size_t f = 0; f < files.size(); ++f) {
    const SegmentFrames frames(files[f]);
    for (const DicomSlice& slice : placed.slices)
      if (slice.file == f) Enter(frames.Frame(slice.frame), slice, files[f], out);
  }
  return out;
}

std::optional<Grid> FindDicomSegmentsGrid(const std::vector<DicomFile>& headers) {
  const std::vector<DicomFile> files = SegmentationFiles(headers);
  if (files.empty()) return std::nullopt;
  return WholeGrid(files, PlaceSegments(files));
}

}  // namespace kvx
