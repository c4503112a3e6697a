// One volume scan of the subject in one pose.
#pragma once
#include <string>
#include <utility>

#include "core/image.h"

namespace kvx {

// The scalar type of the file a scan came from, kept so that posed volumes are written as they were read.
enum class ScalarType { kUint8, kInt8, kUint16, kInt16, kUint32, kInt32, kFloat32, kFloat64 };

struct Scan {
  Volume volume;  // intensities as stored, but for evened slices and impossible filling
  ScalarType stored_as = ScalarType::kFloat32;
  std::string modality;  // "MR", "CT" or "" when the file does not say, or its greys deny it
  // By which part every other slice was brighter than those beside it, before it was evened out; mostly 0
  double evened_slices = 0;
  bool denied_ct = false;  // the file says CT, which its greys deny (ContradictsCt)
};

// Another volume in the place of the scan's.
inline Scan With(Volume volume, const Scan& scan) {
  return {std::move(volume), scan.stored_as, scan.modality, scan.evened_slices, scan.denied_ct};
}

}  // namespace kvx
