// One bone against the rest as a minimum cut, or its parts that lie in each other: costs per voxel in nats,
// links that are cheap where the picture has an edge.
#pragma once
#include <vector>

#include "core/image.h"
#include "pipeline/segmentation/cuts/lattice_cut.h"

namespace kvx {

// A lattice's costs are whole numbers. At most 1000 nats.
int32_t CutUnits(double nats);
// The surface that a link stands for, by direction: by the inverse of the links' lengths. Of equal spacing all
// together cost one per face of a flat cut; else faces between slices cost up to a quarter too much for thick
// ones, and faces beside them too little.
std::vector<double> LinkAreas(const LatticeCut& lattice, const Eigen::Vector3d& spacing_mm);

enum class Side : uint8_t { kFree, kInside, kOutside };

struct LinkOptions {
  double strength = 1.0;   // nats per voxel face without an edge
  double contrast = 0.15;  // change of relative intensity that makes an edge
  int falls_outwards = 0;  // 1: only edges that get darker outwards are cheap; -1: brighter; 0: both
  int neighbours = 18;     // 6, 18 or 26
};

// What one region of several would be alone.
struct CutLayer {
  Image<float> inside_cost;  // of a voxel inside minus its cost outside
  Image<Side> sides;         // voxels with a side keep it
  LinkOptions links;
};

// Regions that lie in each other, cheapest together, the innermost first: a voxel in one is in all that come
// after it. Their links join the same neighbours. Surfaces of two regions may touch.
std::vector<Mask> NestedCut(const std::vector<CutLayer>& layers, const Volume& relative);
// Of one region.
Mask MinimumCut(CutLayer layer, const Volume& relative);

}  // namespace kvx
