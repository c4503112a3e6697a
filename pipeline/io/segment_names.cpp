// Names are in the headers of DICOM segmentations and of 3D Slicer's NRRD files.
#include "pipeline/io/segment_names.h"

#include "core/text/extension.h"
#include "pipeline/io/dicom/dicom_files.h"
#include "pipeline/io/segment_layers.h"
#include "pipeline/io/text_header.h"
#include "pipeline/io/volume_file.h"

namespace kvx {
namespace {

std::map<int, std::string> NamesInNrrd(const std::filesystem::path& nrrd) {
  const std::vector<Segment> segments = SegmentsOf(ReadTextHeader(FileFormat::kNrrd, nrrd));
  const bool layered = !segments.empty() && HoldsSegmentLayers(nrrd);
  std::map<int, std::string> names;
  for (size_t s = 0; s < segments.size(); ++s)
    names[layered ? int(s + 1) : segments[s].value] = segments[s].name;
  return names;
}

}  // namespace

std::map<int, std::string> ReadSegmentNames(const std::filesystem::path& labels) {
  if (HasExtension(labels, ".nrrd") || HasExtension(labels, ".nhdr")) return NamesInNrrd(labels);
  std::map<int, std::string> names;
  if (!HoldsDicom(labels)) return names;
  for (const DicomFile& file : SegmentationFiles(ReadDicomHeaders(labels)))
    names.insert(file.segment_names.begin(), file.segment_names.end());
  return names;
}

}  // namespace kvx
