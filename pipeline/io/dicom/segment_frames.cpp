// By GDCM, but for its reader of images: that knows no segmentations of numbers, and ends the process where
// the table of their colours is not as it expects.
#include "pipeline/io/dicom/segment_frames.h"

#include <gdcmPixmap.h>
#include <gdcmReader.h>
#include <gdcmTrace.h>

#include <cmath>
#include <fstream>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_tags.h"

namespace kvx {
namespace {

constexpr double kMostBytes = 4e9;  // of packed voxels, which a small file can hold many of
const gdcm::Tag kBitsAllocated(0x0028, 0x0100), kPixelData(0x7fe0, 0x0010);
const char kUndecoded[] =
    "the voxels of the DICOM segmentation (SEG) are damaged, or packed in a way that is not read here; save "
    "it again, uncompressed (Explicit VR Little Endian), or as a label map (.nii.gz, .nrrd)";

// As grey values, whatever colours they are shown in.
std::string Decoded(const gdcm::File& file, const DicomFile& of, size_t bits, double bytes) {
  if (!(bytes < kMostBytes)) {
    throw InputError(
        "the DICOM segmentation (SEG) is too large as it is packed; save it uncompressed (Explicit VR Little "
        "Endian), or as a label map (.nii.gz, .nrrd)");
  }
  gdcm::Pixmap packed;
  packed.SetNumberOfDimensions(3);
  packed.SetDimension(0, unsigned(of.columns));
  packed.SetDimension(1, unsigned(of.rows));
  packed.SetDimension(2, unsigned(of.frames.size()));
  const auto depth = uint16_t(bits);
  packed.SetPixelFormat(gdcm::PixelFormat(1, depth, depth, uint16_t(depth - 1), 0));
  packed.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  packed.SetTransferSyntax(file.GetHeader().GetDataSetTransferSyntax());
  packed.SetDataElement(file.GetDataSet().GetDataElement(kPixelData));
  std::string voxels(packed.GetBufferLength(), '\0');
  if (double(voxels.size()) < bytes || !packed.GetBuffer(voxels.data())) throw InputError(kUndecoded);
  return voxels;
}

std::string Stored(const gdcm::File& file, double bytes) {
  const gdcm::ByteValue* value = file.GetDataSet().GetDataElement(kPixelData).GetByteValue();
  if (!value || double(value->GetLength()) < bytes) throw InputError(kUndecoded);
  return {value->GetPointer(), value->GetLength()};
}

}  // namespace

SegmentFrames::SegmentFrames(const DicomFile& file) : voxels_(size_t(file.columns) * size_t(file.rows)) {
  gdcm::Trace::DebugOff(), gdcm::Trace::WarningOff(), gdcm::Trace::ErrorOff();
  std::ifstream in(file.path, std::ios::binary);
  gdcm::Reader reader;
  reader.SetStream(in);
  try {
    if (!reader.Read()) throw InputError(kUndecoded);
    const gdcm::TransferSyntax& syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
    bits_ = NumberAt(reader.GetFile().GetDataSet(), kBitsAllocated);
    const bool packed = syntax.IsEncapsulated();
    if (syntax.GetSwapCode() == gdcm::SwapCode::BigEndian || (packed && bits_ == 1) ||
        (bits_ != 1 && bits_ != 8 && bits_ != 16))
      throw InputError(kUndecoded);
    const double bytes = std::ceil(double(voxels_) * double(file.frames.size()) * double(bits_) / 8);
    stored_ = packed ? Decoded(reader.GetFile(), file, bits_, bytes) : Stored(reader.GetFile(), bytes);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception&) {  // GDCM's words quote tags
    throw InputError(kUndecoded);
  }
}

std::vector<uint16_t> SegmentFrames::Frame(size_t frame) const {
  std::vector<uint16_t> values(voxels_);
  const auto byte = [&](size_t at) { return uint16_t(uint8_t(stored_[at])); };
  const size_t begin = frame * voxels_;
  for (size_t v = 0; v < voxels_ && bits_ == 1; ++v) {
    const uint16_t eight = byte((begin + v) / 8);
    values[v] = eight >> (begin + v) % 8 & 1;
    if (eight == 0) v += 7 - (begin + v) % 8;  // on to the next byte: most are empty
  }
  for (size_t v = 0; v < voxels_ && bits_ == 8; ++v) values[v] = byte(begin + v);
  for (size_t v = 0; v < voxels_ && bits_ == 16; ++v)
    values[v] = uint16_t(byte(2 * (begin + v)) | byte(2 * (begin + v) + 1) << 8);
  return values;
}

}  // namespace kvx
