// Tags by GDCM, read up to the pixel data. Frames of an enhanced image carry their place in functional
// groups.
#include "pipeline/io/dicom/dicom_header.h"

#include <gdcmMediaStorage.h>
#include <gdcmReader.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <set>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_tags.h"
#include "pipeline/io/dicom/series_folder.h"

namespace kvx {
namespace {

using gdcm::DataSet;
using gdcm::Tag;

const Tag kTransferSyntax(0x0002, 0x0010);
const Tag kImageType(0x0008, 0x0008), kModality(0x0008, 0x0060), kSeriesUid(0x0020, 0x000e),
    kEcho(0x0018, 0x0086), kRows(0x0028, 0x0010), kColumns(0x0028, 0x0011), kBitsAllocated(0x0028, 0x0100),
    kSamples(0x0028, 0x0002);
const Tag kFrameCount(0x0028, 0x0008), kPixelSpacing(0x0028, 0x0030), kPixelData(0x7fe0, 0x0010);
const Tag kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037), kIntercept(0x0028, 0x1052),
    kSlope(0x0028, 0x1053), kShown(0x0028, 0x0004), kBitsStored(0x0028, 0x0101), kSigned(0x0028, 0x0103),
    kHighBit(0x0028, 0x0102);
const Tag kFloatPixels(0x7fe0, 0x0008), kDoublePixels(0x7fe0, 0x0009);  // of parametric maps alone
const Tag kSopClass(0x0008, 0x0016), kSegmentSequence(0x0062, 0x0002), kSegmentationType(0x0062, 0x0001),
    kMostFraction(0x0062, 0x000e), kSpacingBetween(0x0018, 0x0088);
const Tag kSegmentOfFrame(0x0062, 0x000a), kSegmentReferred(0x0062, 0x000b), kSegmentNumber(0x0062, 0x0004),
    kSegmentLabel(0x0062, 0x0005);
const Tag kPlanePosition(0x0020, 0x9113), kPlaneOrientation(0x0020, 0x9116), kPixelMeasures(0x0028, 0x9110);
const Tag kPixelValues(0x0028, 0x9145), kModalityTable(0x0028, 0x3000);

// Segmentation storage; of a label map; RT dose; RT image (PS3.4, B.5).
const char kSegmentation[] = "1.2.840.10008.5.1.4.1.1.66.4", kLabelMap[] = "1.2.840.10008.5.1.4.1.1.66.7",
           kRtDose[] = "1.2.840.10008.5.1.4.1.1.481.2", kRtImage[] = "1.2.840.10008.5.1.4.1.1.481.1";
const std::set<std::string> kModalitiesOfOthers{"RTDOSE", "RTIMAGE", "RTSTRUCT", "RTPLAN", "PR", "KO",
                                                "SR",     "REG",     "DOC",      "FID",    "RWV"};

constexpr size_t kMetaHead = 1 << 16;  // bytes that hold group 2

const char kNoPreamble[] =
    "a file of the DICOM series holds no image, or does not begin as DICOM files do (128 bytes, then DICM); "
    "copy or export it again, or bring one of an old program up to date with dcmconv or gdcmconv";
const char kDamaged[] = "a DICOM file is damaged or holds no image; export or copy the images again";
const char kOtherVoxels[] =
    "a DICOM image is damaged: it does not hold as many voxels as its rows, columns and number of frames "
    "say; export or copy the images again";
const char kUnknownPacking[] =
    "the voxels of a DICOM image are packed in a way that is not read here (its transfer syntax); export the "
    "images again, uncompressed (Explicit VR Little Endian)";
const char kInverted[] =
    "the DICOM images are shown inverted (MONOCHROME1) and stored in a way that is not read here; convert "
    "them to NIfTI (dcm2niix) or to MONOCHROME2";

std::optional<DicomFrame> FrameOf(FrameTags& tags, size_t frame) {
  const auto position = Numbers(tags.Text(frame, kPlanePosition, kPosition), 3);
  const auto axes = Numbers(tags.Text(frame, kPlaneOrientation, kOrientation), 6);
  const auto spacing = Numbers(tags.Text(frame, kPixelMeasures, kPixelSpacing), 2);
  if (!position || !axes || !spacing) return std::nullopt;
  return DicomFrame{
      Eigen::Vector3d(position->data()), Eigen::Vector3d(axes->data()), Eigen::Vector3d(axes->data() + 3),
      Eigen::Vector2d(spacing->at(1), spacing->at(0))};  // DICOM gives the distance between rows first
}

size_t DeclaredFrames(const DataSet& set) {
  const std::string declared = TextOf(set, kFrameCount);
  if (declared.empty()) return 1;
  const auto count = Numbers(declared, 1);
  if (!count || !(count->front() >= 1 && count->front() <= 100000)) throw InputError(kDamaged);
  return size_t(count->front());
}

// Taken for absent, a factor with a decimal comma would leave greys that are times too large.
double FactorOf(const std::string& text, double usual) {
  if (text.empty()) return usual;
  if (const auto number = Numbers(text, 1)) return number->front();
  throw InputError(
      "the rescale slope or intercept of a DICOM image is not a number; export the images again, or convert "
      "them to NIfTI");
}

Rescale RescaleOf(FrameTags& tags, size_t frame) {
  const double slope = FactorOf(tags.Text(frame, kPixelValues, kSlope), 1.0);
  if (slope == 0) {
    throw InputError(
        "the rescale slope of a DICOM image is 0, which leaves nothing of its greys; export the images "
        "again or convert them to NIfTI");
  }
  return {slope, FactorOf(tags.Text(frame, kPixelValues, kIntercept), 0.0)};
}

// No frames where one or more do not say where they lie.
void ReadFrames(const DataSet& set, FrameTags& tags, DicomFile& file) {
  const size_t count = DeclaredFrames(set), placed = tags.frame_count();
  if (placed > 0 && placed != count) file.miscounted = {count, placed};
  if (file.miscounted || (count > 1 && placed == 0)) return;
  std::vector<DicomFrame> frames;
  std::set<std::pair<double, double>> rescales;
  for (size_t f = 0; f < count; ++f) {
    const auto frame = FrameOf(tags, f);
    if (!frame) return;
    frames.push_back(*frame);
    file.rescale = RescaleOf(tags, f);
    rescales.emplace(file.rescale.slope, file.rescale.intercept);
  }
  if (rescales.size() > 1) {
    throw InputError("the frames of the DICOM image are rescaled differently; convert it to NIfTI first");
  }
  if (const auto between = Numbers(tags.Text(0, kPixelMeasures, kSpacingBetween), 1))
    file.between_mm = between->front();
  file.frames = std::move(frames);
}

// Walks the elements of group 2 (explicit, little-endian) to the first of another group. Distributions build
// GDCM with its assertions on, and a file that ends inside this group would end the process.
bool HasSoundMeta(std::string_view head) {
  const auto u16 = [&](size_t at) { return size_t(uint8_t(head[at])) | size_t(uint8_t(head[at + 1])) << 8; };
  size_t at = 132;
  while (at + 12 <= head.size()) {
    if (u16(at) != 2) return at > 132;
    const std::string_view vr = head.substr(at + 4, 2);
    if (!std::isupper(uint8_t(vr[0])) || !std::isupper(uint8_t(vr[1]))) return false;
    const bool longer = vr == "OB" || vr == "OW" || vr == "UN" || vr == "SQ" || vr == "UT" || vr == "OF";
    const size_t length = longer ? u16(at + 8) | u16(at + 10) << 16 : u16(at + 6);
    at += (longer ? 12 : 8) + length;
  }
  return false;
}

// Without it GDCM takes the lowest bit for the highest, and makes every voxel 0 or 1. Values that do not
// begin at the lowest bit (PS3.5, 8.1.1 forbids them now) it leaves where they are, many times too large.
void RequireHighBit(const DataSet& set) {
  if (!HasNumber(set, kBitsStored)) return;
  if (!HasNumber(set, kHighBit)) {
    throw InputError(
        "a DICOM image does not say which bits of a voxel hold its value (high bit); export the images "
        "again, or convert them to NIfTI");
  }
  if (NumberAt(set, kHighBit) + 1 == NumberAt(set, kBitsStored)) return;
  throw InputError(
      "a DICOM image says that its values do not begin at the lowest bit of a voxel (high bit is not bits "
      "stored less one), which is not read here; export the images again, or convert them to NIfTI");
}

// GDCM gives the numbers of the table's entries.
void RequireNoTable(const DataSet& set) {
  DicomSequences alive;
  if (ItemsOf(set, kModalityTable, alive).empty()) return;
  throw InputError(
      "what the greys of the DICOM images mean stands in a table (modality LUT), which is not read here; "
      "export them with a rescale slope and intercept, or convert them to NIfTI");
}

// GDCM inverts bytes and 16 bits, from the greatest value that the stored bits hold without a sign; of signed
// ones all bits. Twelve signed ones end the process where its assertions are on.
std::optional<double> InvertedFrom(const DataSet& set) {
  if (TextOf(set, kShown) != "MONOCHROME1") return std::nullopt;
  const size_t allocated = NumberAt(set, kBitsAllocated), stored = NumberAt(set, kBitsStored);
  const bool with_sign = NumberAt(set, kSigned) != 0;
  if ((allocated != 8 && allocated != 16) || stored < 1 || stored > allocated ||
      (with_sign && stored == 12)) {
    throw InputError(kInverted);
  }
  if (with_sign) return -1.0;
  return allocated == 8 ? 255.0 : double((uint32_t(1) << stored) - 1);
}

// Bits of a voxel by the first codestream (ISO/IEC 15444-1, A.5.1) of the value that begins where `in`
// stands; 0 where none begins soon.
size_t CodestreamBits(std::istream& in) {
  constexpr size_t kFromMarkers = 42;
  uint8_t item[8] = {};  // the table of offsets: a tag, a length
  in.read(reinterpret_cast<char*>(item), 8);
  in.seekg(std::streamoff(item[4]) | item[5] << 8 | item[6] << 16, std::ios::cur);
  std::string head(4096, '\0');
  in.read(head.data(), std::streamsize(head.size()));
  head.resize(size_t(in.gcount()));
  const size_t at = head.find("\xff\x4f\xff\x51");
  if (at == head.npos || at + kFromMarkers >= head.size()) return 0;
  return (uint8_t(head[at + kFromMarkers]) & 0x7f) + size_t(1);
}

// Of JPEG 2000 GDCM inverts the bits of the codestream, which may hold more than the header says.
void RequireInvertedAsStored(const gdcm::File& file, std::istream& at_voxels) {
  using gdcm::TransferSyntax;
  const DataSet& set = file.GetDataSet();
  const TransferSyntax::TSType syntax = file.GetHeader().GetDataSetTransferSyntax();
  const bool jpeg2000 = syntax >= TransferSyntax::JPEG2000Lossless && syntax <= TransferSyntax::JPEG2000Part2;
  if (!jpeg2000 || NumberAt(set, kSigned) != 0 || NumberAt(set, kBitsAllocated) == 8) return;
  if (CodestreamBits(at_voxels) != NumberAt(set, kBitsStored)) throw InputError(kInverted);
}

// What the file holds of the value that begins where `in` stands, its length before it.
double HeldBytes(std::istream& in, bool swapped) {
  const std::streamoff begin = in.tellg();
  uint8_t length[4] = {};
  if (begin < 4 || !in.seekg(begin - 4).read(reinterpret_cast<char*>(length), 4)) return 0;
  if (swapped) std::reverse(std::begin(length), std::end(length));
  const double declared = length[0] + 256.0 * length[1] + 65536.0 * length[2] + 16777216.0 * length[3];
  in.seekg(0, std::ios::end);
  return std::min(declared, double(std::streamoff(in.tellg()) - begin));
}

// GDCM fills plain voxels that are not there with zeros, and takes the first of too many; packed ones fail in
// their decoder.
void RequireAllVoxels(const gdcm::File& file, std::istream& at_voxels, size_t frames) {
  const gdcm::TransferSyntax& syntax = file.GetHeader().GetDataSetTransferSyntax();
  if (syntax.IsEncapsulated() || syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) return;
  const DataSet& set = file.GetDataSet();
  const double voxels = double(NumberAt(set, kRows)) * double(NumberAt(set, kColumns)) * double(frames);
  const double needed = std::floor(voxels * double(NumberAt(set, kBitsAllocated)) / 8);
  if (!(needed > 0)) return;
  const double held = HeldBytes(at_voxels, syntax.GetSwapCode() == gdcm::SwapCode::BigEndian);
  const double beyond = held - needed * double(std::max<size_t>(1, NumberAt(set, kSamples)));
  const bool one_more = beyond >= std::max(2.0, needed / double(frames));  // one byte fills up
  if (needed > held || one_more) throw InputError(kOtherVoxels);
}

DicomContent ContentOf(const DataSet& set) {
  const std::string modality = TextOf(set, kModality), sop_class = TextOf(set, kSopClass);
  if (modality == "SEG" || sop_class == kSegmentation || sop_class == kLabelMap)
    return DicomContent::kSegments;
  const bool parameters = set.FindDataElement(kFloatPixels) || set.FindDataElement(kDoublePixels);
  const bool other =
      parameters || kModalitiesOfOthers.contains(modality) || sop_class == kRtDose || sop_class == kRtImage;
  return other ? DicomContent::kOther : DicomContent::kBody;
}

void ReadSegments(const DataSet& set, FrameTags& tags, DicomFile& file) {
  DicomSequences alive;
  const auto segments = ItemsOf(set, kSegmentSequence, alive);
  for (const DataSet* segment : segments)
    file.segment_names[int(NumberAt(*segment, kSegmentNumber))] = TextOf(*segment, kSegmentLabel);
  file.numbered = TextOf(set, kSopClass) == kLabelMap || TextOf(set, kSegmentationType) == "LABELMAP";
  if (file.numbered) return;
  if (TextOf(set, kSegmentationType) == "FRACTIONAL")
    file.certain = std::max<size_t>(1, NumberAt(set, kMostFraction));
  const size_t only = segments.size() == 1 ? std::max<size_t>(1, NumberAt(*segments[0], kSegmentNumber)) : 0;
  for (size_t f = 0; f < file.frames.size(); ++f) {
    const size_t segment = tags.Number(f, kSegmentOfFrame, kSegmentReferred);
    file.frames[f].segment = int(segment > 0 ? segment : only);
  }
}

// Leaves `in` where the voxels begin, which it does not read.
bool ReadTags(gdcm::Reader& reader, std::istream& in) {
  try {
    reader.SetStream(in);
    return reader.ReadUpToTag(kPixelData, {kPixelData});
  } catch (const std::exception&) {  // GDCM's words quote tags
    return false;
  }
}

bool IsPackedOtherwise(const gdcm::File& file) {
  const std::string syntax = TextOf(file.GetHeader(), kTransferSyntax);
  return !syntax.empty() && gdcm::TransferSyntax::GetTSType(syntax.c_str()) == gdcm::TransferSyntax::TS_END;
}

// By a palette, or three or four values (PS3.3, C.7.6.3.1.2).
bool IsColour(const std::string& shown) {
  return shown == "PALETTE COLOR" || shown == "RGB" || shown.starts_with("YBR_") || shown == "HSV" ||
         shown == "ARGB" || shown == "CMYK";
}

// A file that names none is told by other tags.
bool IsOfKnownKind(const DataSet& set) {
  const std::string kind = TextOf(set, kSopClass);
  return kind.empty() || gdcm::MediaStorage::IsImage(gdcm::MediaStorage::GetMSType(kind.c_str()));
}

}  // namespace

std::optional<DicomFile> ReadDicomHeader(const std::filesystem::path& path) {
  gdcm::Trace::DebugOff(), gdcm::Trace::WarningOff(), gdcm::Trace::ErrorOff();  // they quote the header
  const std::string head = HeadOf(path, kMetaHead);
  const SeriesFile kind = SeriesFileOf(path.filename().string(), head);
  if (kind == SeriesFile::kBroken) throw InputError(kNoPreamble);
  if (kind == SeriesFile::kAside) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  gdcm::Reader reader;
  if (!HasSoundMeta(head)) throw InputError(kDamaged);
  if (!ReadTags(reader, in))
    throw InputError(IsPackedOtherwise(reader.GetFile()) ? kUnknownPacking : kDamaged);
  const DataSet& set = reader.GetFile().GetDataSet();
  if (!set.FindDataElement(kRows)) return std::nullopt;
  const std::string modality = TextOf(set, kModality);
  const DicomContent content = ContentOf(set);
  DicomFile file{path,
                 TextOf(set, kSeriesUid),
                 TextOf(set, kEcho),
                 modality == "MR" || modality == "CT" ? modality : "",
                 TextOf(set, kImageType).find("LOCALIZER") != std::string::npos,
                 content,
                 int(NumberAt(set, kColumns)),
                 int(NumberAt(set, kRows))};
  if (content == DicomContent::kOther) return file;  // nobody reads its voxels
  file.of_known_kind = IsOfKnownKind(set);
  file.coloured = IsColour(TextOf(set, kShown));
  RequireHighBit(set);
  RequireNoTable(set);
  FrameTags tags(set);
  ReadFrames(set, tags, file);
  if (content == DicomContent::kSegments) ReadSegments(set, tags, file);
  file.inverted_from = InvertedFrom(set);
  if (file.inverted_from) RequireInvertedAsStored(reader.GetFile(), in);
  RequireAllVoxels(reader.GetFile(), in, file.frames.size());
  return file;
}

}  // namespace kvx
