#include "pipeline/io/dicom/dicom_elements.h"

#include <dcmtk/dcmdata/dcostrmb.h>

#include <cstdio>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr E_TransferSyntax kCoding = EXS_LittleEndianExplicit;

}  // namespace

void Require(const OFCondition& done) {
  if (done.bad()) throw Unavailable("a DICOM image cannot be made; is there memory left?");
}

void Put(DcmItem& item, const DcmTagKey& key, DcmEVR vr, const std::string& value) {
  Require(item.putAndInsertString(DcmTag(key, vr), value.c_str()));
}

void Put(DcmItem& item, const DcmTagKey& key, int value) {
  Require(item.putAndInsertUint16(DcmTag(key, EVR_US), Uint16(value)));
}

std::string Decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value == 0 ? 0.0 : value);
  return text;
}

std::string Decimals(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : "\\") + Decimal(value);
  return text;
}

void PutPosition(DcmItem& item, const Grid& grid, int k) {
  const Eigen::Vector3d at = grid.ToMm(0, 0, k).lps;
  Put(item, DCM_ImagePositionPatient, EVR_DS, Decimals({at.x(), at.y(), at.z()}));
}

void PutOrientation(DcmItem& item, const Grid& grid) {
  const Eigen::Vector3d right = grid.direction.col(0), down = grid.direction.col(1);
  Put(item, DCM_ImageOrientationPatient, EVR_DS,
      Decimals({right.x(), right.y(), right.z(), down.x(), down.y(), down.z()}));
}

void PutPixelSpacing(DcmItem& item, const Grid& grid) {
  Put(item, DCM_PixelSpacing, EVR_DS, Decimals({grid.spacing_mm.y(), grid.spacing_mm.x()}));  // rows first
}

void PutPixels(DcmItem& item, const Grid& grid, int bits, bool with_sign) {
  Put(item, DCM_SamplesPerPixel, 1);
  Put(item, DCM_PhotometricInterpretation, EVR_CS, "MONOCHROME2");
  Put(item, DCM_Rows, grid.size.y());
  Put(item, DCM_Columns, grid.size.x());
  Put(item, DCM_BitsAllocated, bits);
  Put(item, DCM_BitsStored, bits);
  Put(item, DCM_HighBit, bits - 1);
  Put(item, DCM_PixelRepresentation, with_sign ? 1 : 0);
}

std::string UidOf(const Digest& digest, std::string_view what, int number) {
  Digest bits = Hasher().Add(digest).Add(what).Add(int64_t(number)).Finish();
  bits.bytes[6] = (bits.bytes[6] & 0x0f) | 0x80;
  bits.bytes[8] = (bits.bytes[8] & 0x3f) | 0x80;
  unsigned __int128 value = 0;
  for (int b = 0; b < 16; ++b) value = value << 8 | bits.bytes[b];
  std::string digits;
  for (; value; value /= 10) digits.insert(digits.begin(), char('0' + int(value % 10)));
  return "2.25." + digits;
}

DcmItem& AddItem(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem* added = nullptr;
  Require(item.findOrCreateSequenceItem(DcmTag(sequence, EVR_SQ), added, -2));
  return *added;
}

void PutCode(DcmItem& item, const DcmTagKey& sequence, const DicomCode& code) {
  DcmItem& put = AddItem(item, sequence);
  Put(put, DCM_CodeValue, EVR_SH, code.value);
  Put(put, DCM_CodingSchemeDesignator, EVR_SH, code.scheme);
  Put(put, DCM_CodeMeaning, EVR_LO, code.meaning);
}

std::string FileBytes(DcmFileFormat& file) {
  constexpr size_t kHead = 65536;  // more than what is put before the data set
  std::string bytes(file.getDataset()->calcElementLength(kCoding, EET_ExplicitLength) + kHead, '\0');
  DcmOutputBufferStream out(bytes.data(), offile_off_t(bytes.size()));
  file.transferInit();
  Require(file.write(out, kCoding, EET_ExplicitLength, nullptr));
  file.transferEnd();
  bytes.resize(size_t(out.filled()));
  return bytes;
}

}  // namespace kvx
