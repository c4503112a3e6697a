// The border of a bone in a CT, as a minimum cut whose links are cheap where density falls outwards.
#pragma once
#include "pipeline/segmentation/cuts/binary_cut.h"

namespace kvx {

constexpr float kDensityUnitHu = 400;

// In units, between fat and cortex: fat is no less outside than muscle, metal no more bone than cortex.
Volume DensityOf(Volume scan_hu);

// Of what neighbours along i in soft tissue differ by, the normal deviation of one voxel. HU.
double NoiseHu(const Volume& scan_hu);

// `lean`: 1 where it is bone for sure, -1 where not. Voxels with a side keep it. `detail`: edge of a voxel,
// in edges of those that the bone was found on first.
Mask CtBorder(const Volume& density, const Image<float>& lean, const Image<Side>& sides, double noise_hu,
              double detail = 1);

}  // namespace kvx
