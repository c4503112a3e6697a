// Elements of DICOM files that are written by DCMTK, and identifiers made of what they hold.
#pragma once
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <initializer_list>
#include <string>
#include <string_view>

#include "core/digest.h"
#include "core/grid.h"

namespace kvx {

// All throw Unavailable where there is no memory for it. Value representations are named with every tag, so
// no data dictionary is needed at run time.
void Put(DcmItem& item, const DcmTagKey& key, DcmEVR vr, const std::string& value);
void Put(DcmItem& item, const DcmTagKey& key, int value);  // 16 bits without a sign
// A further item of the sequence.
DcmItem& AddItem(DcmItem& item, const DcmTagKey& sequence);
void Require(const OFCondition& done);

struct DicomCode {
  const char *scheme, *value, *meaning;
};
void PutCode(DcmItem& item, const DcmTagKey& sequence, const DicomCode& code);

// At most 16 letters each, as DS asks for.
std::string Decimal(double value);
std::string Decimals(std::initializer_list<double> values);

// Where the plane k of the grid lies, and how all of them do.
void PutPosition(DcmItem& item, const Grid& grid, int k);
void PutOrientation(DcmItem& item, const Grid& grid);
void PutPixelSpacing(DcmItem& item, const Grid& grid);
// How the voxels of such a plane are stored: whole numbers of `bits` bits.
void PutPixels(DcmItem& item, const Grid& grid, int bits, bool with_sign);

// A UUID of version 8 (RFC 9562) out of the digest, as PS3.5 B.2 writes it.
std::string UidOf(const Digest& digest, std::string_view what, int number = 0);

// The whole file, explicit and little-endian.
std::string FileBytes(DcmFileFormat& file);

}  // namespace kvx
