// Attributes: DICOM PS3.3, A.51 and C.8.20.
#include "pipeline/io/dicom/segmentation_writer.h"

#include <array>
#include <span>
#include <vector>

#include "core/errors.h"
#include "core/version.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/dicom/dicom_elements.h"

namespace kvx {
namespace {

constexpr DicomCode kStructure{"SCT", "123037004", "Anatomical Structure"}, kBone{"SCT", "272673000", "Bone"},
    kSegmented{"DCM", "113076", "Segmentation"},
    kSource{"DCM", "121322", "Source image for image processing operation"};
// The standard asks for a day and a time, of which nothing here tells.
constexpr char kNoDay[] = "19000101", kNoTime[] = "000000";

struct SegmentPlane {
  int number;  // of the segment
  int label, plane;
};

// By segment, then by plane.
std::vector<SegmentPlane> PlanesOf(const LabelMap& labels, const std::map<int, std::string>& names) {
  std::map<int, std::vector<char>> is_in;
  for (const auto& [label, name] : names) is_in[label].resize(size_t(labels.grid.size.z()));
  const size_t plane = size_t(labels.grid.size.x()) * size_t(labels.grid.size.y());
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const auto found = labels.values[v] == 0 ? is_in.end() : is_in.find(labels.values[v]);
    if (found != is_in.end()) found->second[v / plane] = 1;
  }
  std::vector<SegmentPlane> planes;
  int number = 0;
  for (auto& [label, in_plane] : is_in) {
    ++number;
    const size_t before = planes.size();
    for (size_t k = 0; k < in_plane.size(); ++k)
      if (in_plane[k]) planes.push_back({number, label, int(k)});
    if (planes.size() == before) planes.push_back({number, label, 0});
  }
  return planes;
}

// Frames follow each other without a gap, the first voxel in the lowest bit (PS3.5, 8.1.1).
std::vector<Uint8> BitsOf(const LabelMap& labels, const std::vector<SegmentPlane>& planes) {
  const size_t voxels = size_t(labels.grid.size.x()) * size_t(labels.grid.size.y());
  const size_t bytes = (voxels * planes.size() + 7) / 8;
  std::vector<Uint8> bits(bytes + bytes % 2);
  size_t at = 0;
  for (const SegmentPlane& plane : planes) {
    const uint16_t* const from = &labels.values[size_t(plane.plane) * voxels];
    for (size_t v = 0; v < voxels; ++v, ++at)
      if (from[v] == plane.label) bits[at / 8] |= Uint8(1 << at % 8);
  }
  return bits;
}

void PutImages(DcmItem& set, const DicomImages& of) {
  DcmItem& series = AddItem(set, DCM_ReferencedSeriesSequence);
  Put(series, DCM_SeriesInstanceUID, EVR_UI, of.series);
  for (const std::string& image : of.images) {
    DcmItem& item = AddItem(series, DCM_ReferencedInstanceSequence);
    Put(item, DCM_ReferencedSOPClassUID, EVR_UI, of.sop_class);
    Put(item, DCM_ReferencedSOPInstanceUID, EVR_UI, image);
  }
}

void PutSegments(DcmItem& set, const std::map<int, std::string>& names) {
  int number = 0;
  for (const auto& [label, name] : names) {
    DcmItem& segment = AddItem(set, DCM_SegmentSequence);
    Put(segment, DCM_SegmentNumber, ++number);
    Put(segment, DCM_SegmentLabel, EVR_LO, name);
    Put(segment, DCM_SegmentAlgorithmType, EVR_CS, "SEMIAUTOMATIC");
    Put(segment, DCM_SegmentAlgorithmName, EVR_LO, "Kinevox");
    PutCode(segment, DCM_SegmentedPropertyCategoryCodeSequence, kStructure);
    PutCode(segment, DCM_SegmentedPropertyTypeCodeSequence, kBone);
  }
}

void PutAttribute(DcmItem& item, const DcmTagKey& key, const DcmTagKey& names) {
  Require(item.putAndInsertTagKey(DcmTag(key, EVR_AT), names));
}

// Frames are in order of segments, then of places.
void PutDimensions(DcmItem& set, const std::string& uid) {
  Put(AddItem(set, DCM_DimensionOrganizationSequence), DCM_DimensionOrganizationUID, EVR_UI, uid);
  using Pair = std::array<DcmTagKey, 2>;
  for (const auto& [what, group] : {Pair{DCM_ReferencedSegmentNumber, DCM_SegmentIdentificationSequence},
                                    Pair{DCM_ImagePositionPatient, DCM_PlanePositionSequence}}) {
    DcmItem& index = AddItem(set, DCM_DimensionIndexSequence);
    Put(index, DCM_DimensionOrganizationUID, EVR_UI, uid);
    PutAttribute(index, DCM_DimensionIndexPointer, what);
    PutAttribute(index, DCM_FunctionalGroupPointer, group);
  }
}

void PutShared(DcmItem& set, const Grid& grid) {
  DcmItem& shared = AddItem(set, DCM_SharedFunctionalGroupsSequence);
  PutOrientation(AddItem(shared, DCM_PlaneOrientationSequence), grid);
  DcmItem& measures = AddItem(shared, DCM_PixelMeasuresSequence);
  Put(measures, DCM_SliceThickness, EVR_DS, Decimal(grid.spacing_mm.z()));
  Put(measures, DCM_SpacingBetweenSlices, EVR_DS, Decimal(grid.spacing_mm.z()));
  PutPixelSpacing(measures, grid);
}

void PutSource(DcmItem& frame, const DicomImages& of, int plane) {
  DcmItem& derived = AddItem(frame, DCM_DerivationImageSequence);
  PutCode(derived, DCM_DerivationCodeSequence, kSegmented);
  DcmItem& source = AddItem(derived, DCM_SourceImageSequence);
  Put(source, DCM_ReferencedSOPClassUID, EVR_UI, of.sop_class);
  Put(source, DCM_ReferencedSOPInstanceUID, EVR_UI, of.images[size_t(plane)]);
  Put(source, DCM_SpatialLocationsPreserved, EVR_CS, "YES");
  PutCode(source, DCM_PurposeOfReferenceCodeSequence, kSource);
}

void PutFrame(DcmItem& set, const Grid& grid, const SegmentPlane& plane, const DicomImages& of) {
  DcmItem& frame = AddItem(set, DCM_PerFrameFunctionalGroupsSequence);
  PutSource(frame, of, plane.plane);
  const Uint32 indices[] = {Uint32(plane.number), Uint32(plane.plane + 1)};
  Require(AddItem(frame, DCM_FrameContentSequence)
              .putAndInsertUint32Array(DcmTag(DCM_DimensionIndexValues, EVR_UL), indices, 2));
  PutPosition(AddItem(frame, DCM_PlanePositionSequence), grid, plane.plane);
  Put(AddItem(frame, DCM_SegmentIdentificationSequence), DCM_ReferencedSegmentNumber, plane.number);
}

void PutVoxels(DcmItem& set, const Grid& grid, size_t frames, const std::vector<Uint8>& bits) {
  Put(set, DCM_NumberOfFrames, EVR_IS, std::to_string(frames));
  PutPixels(set, grid, 1, false);
  Require(set.putAndInsertUint8Array(DcmTag(DCM_PixelData, EVR_OB), bits.data(), bits.size()));
}

void PutKind(DcmItem& set) {
  Put(set, DCM_ManufacturerModelName, EVR_LO, "Kinevox");
  Put(set, DCM_DeviceSerialNumber, EVR_LO, ProgramVersion());
  Put(set, DCM_ImageType, EVR_CS, "DERIVED\\PRIMARY");
  Put(set, DCM_InstanceNumber, EVR_IS, "1");
  Put(set, DCM_ContentDate, EVR_DA, kNoDay);
  Put(set, DCM_ContentTime, EVR_TM, kNoTime);
  Put(set, DCM_ContentLabel, EVR_CS, "BONES");
  Put(set, DCM_ContentDescription, EVR_LO, "");
  Put(set, DCM_ContentCreatorName, EVR_PN, "");
  Put(set, DCM_LossyImageCompression, EVR_CS, "00");
  Put(set, DCM_SegmentationType, EVR_CS, "BINARY");
  Put(set, DCM_SegmentsOverlap, EVR_CS, "NO");
}

Digest ContentOf(const Grid& grid, const std::vector<Uint8>& bits, const std::map<int, std::string>& names,
                 const DicomSeries& series, const DicomImages& of) {
  Hasher hasher;
  AddOrigin(hasher, series).Add(of.series);
  for (const auto& [label, name] : names) hasher.Add(int64_t(label)).Add(name);
  for (const int number : grid.size) hasher.Add(int64_t(number));
  return hasher.Raw(std::as_bytes(std::span(bits))).Finish();
}

}  // namespace

void WriteDicomSegmentation(const std::filesystem::path& path, const LabelMap& labels,
                            const std::map<int, std::string>& names, DicomSeries series,
                            const DicomImages& of) {
  const Grid& grid = labels.grid;
  if (names.empty()) throw InputError("a model without bones has no labels that could be DICOM");
  series.modality = "SEG";
  const std::vector<SegmentPlane> planes = PlanesOf(labels, names);
  const std::vector<Uint8> bits = BitsOf(labels, planes);
  const Digest content = ContentOf(grid, bits, names, series, of);
  DcmFileFormat file;
  DcmItem& set = *file.getDataset();
  Put(set, DCM_SOPClassUID, EVR_UI, UID_SegmentationStorage);
  Put(set, DCM_SOPInstanceUID, EVR_UI, UidOf(content, "segmentation"));
  PutOrigin(set, series, content);
  PutKind(set);
  PutImages(set, of);
  PutSegments(set, names);
  PutDimensions(set, UidOf(content, "dimensions"));
  PutShared(set, grid);
  for (const SegmentPlane& plane : planes) PutFrame(set, grid, plane, of);
  PutVoxels(set, grid, planes.size(), bits);
  WriteFileAtomically(path, FileBytes(file));
}

}  // namespace kvx
