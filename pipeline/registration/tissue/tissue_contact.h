// Tissue that would share space with other tissue, as behind a bent knee or in a fist: where it should go.
#pragma once
#include "core/host/progress.h"
#include "core/image.h"
#include "kernels/elastic_sweeps.h"

namespace kvx {

// A node inside the other side, and the way out: half of it, as the other side goes the other half.
struct ContactPush {
  uint32_t node = 0;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // out of the other side, scan mm
  float mm = 0;
};

class TissueContact {
 public:
  // `air`: the voxels without tissue.
  explicit TissueContact(const Mask& air);

  // Of a lattice whose nodes are every step-th of those voxels, in the order of nodes. Only tissue that is
  // far apart at rest can meet.
  std::vector<ContactPush> Find(const ElasticLattice& lattice, int step) const;

 private:
  float DepthMm(const Eigen::Vector3i& voxel) const;
  Eigen::Vector3f DepthSlope(const Eigen::Vector3i& voxel, int step) const;

  Volume depth_mm_;  // at rest, below the surface; negative in air
};

// `sweeps` of `relax`; where tissue overlaps, twice as many more, with the nodes concerned held where both
// sides would just touch. Of `progress` it asks alone whether to go on.
void RelaxInContact(const ElasticSweeps& relax, const TissueContact& contact, int step, int sweeps,
                    const Progress& progress, ElasticLattice& lattice);

}  // namespace kvx
