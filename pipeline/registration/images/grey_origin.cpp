// Every limb in MR shows something dark: air, cortical bone.
#include "pipeline/registration/images/grey_origin.h"

#include <cmath>

#include "core/host/parallel.h"
#include "core/numbers/value_range.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

constexpr float kFarFromZero = 0.02f;  // of the range of greys; noise and interpolation reach less far

std::vector<float> Outside(const Mask& filled, const Volume& volume) {
  std::vector<float> values;
  for (size_t v = 0; v < volume.values.size(); ++v)
    if (!filled.values[v]) values.push_back(volume.values[v]);
  return values;
}

float Origin(std::span<const float> greys) {
  const ValueRange usual = UsualRangeOf(greys);
  return std::abs(usual.least) > kFarFromZero * (usual.most - usual.least) ? usual.least : 0;
}

}  // namespace

float GreyOriginOf(const Volume& measured, const Mask& filled, const std::string& modality) {
  if (IsHounsfield(measured, modality)) return 0;
  return filled.values.empty() ? Origin(measured.values) : Origin(Outside(filled, measured));
}

Volume FromOrigin(Volume volume, float origin) {
  if (origin != 0) ParallelEach(volume.values.size(), [&](size_t v) { volume.values[v] -= origin; });
  return volume;
}

}  // namespace kvx
