// Layers are the components of a voxel to ITK.
#include "pipeline/io/segment_layers.h"

#include "core/errors.h"
#include "pipeline/io/itk_image.h"
#include "pipeline/io/text_header.h"

namespace kvx {
namespace {

// Labels are 16 bits wide.
void RequireFitting(const std::vector<Segment>& segments, int layers) {
  if (segments.size() > 65535) throw InputError("the segmentation has more than 65535 segments");
  for (const Segment& segment : segments) {
    if (segment.layer >= layers)
      throw InputError("the segmentation names layers that it does not have; save it again");
  }
}

}  // namespace

bool HoldsSegmentLayers(const std::filesystem::path& nrrd) {
  return NamesSegments(ReadTextHeader(FileFormat::kNrrd, nrrd)) && ReadItkLayers(nrrd, false).count > 1;
}

Grid SegmentLayersGrid(const std::filesystem::path& nrrd) { return ReadItkLayers(nrrd, false).grid; }

LayeredLabels ReadSegmentLayers(const std::filesystem::path& nrrd) {
  const std::vector<Segment> segments = SegmentsOf(ReadTextHeader(FileFormat::kNrrd, nrrd));
  const ItkLayers layers = ReadItkLayers(nrrd, true);
  RequireFitting(segments, layers.count);
  LayeredLabels out{LabelMap(layers.grid), {}};
  for (size_t s = 0; s < segments.size(); ++s) {
    const auto label = uint16_t(s + 1);
    for (size_t v = 0; v < out.labels.values.size(); ++v) {
      const float value = layers.values[v * size_t(layers.count) + size_t(segments[s].layer)];
      if (value != float(segments[s].value)) continue;
      if (out.labels.values[v] == 0)
        out.labels.values[v] = label;
      else
        ++out.shared_voxels[label];
    }
  }
  return out;
}

}  // namespace kvx
