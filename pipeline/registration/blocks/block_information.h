// The similarity of blocks at coarse levels: normalised mutual information (paper, section 4.1 and eq. 5).
#pragma once
#include "core/mutual_information.h"
#include "kernels/block_kernels.h"

namespace kvx {

// The paper goes from MI to SSD between blocks of 32^3 and 16^3, since small regions fill no histogram. Here
// a block is judged over its support of 3 x 3 x 3 blocks, so the support is what is compared with 32, in
// voxels of the template: 24 at the finest level (SSD), 48 and 96 at the coarser ones (MI).
class BlockInformation {
 public:
  struct Value {
    double normalised = 1;  // lowest where there is much detail that does not match
    double samples = 0, entropy_nats = 0;
  };

  explicit BlockInformation(const BlockLevel& level);

  bool Applies() const { return applies_; }
  std::vector<Value> Of(BlockKernels& kernels, std::span<const cl_int4> blocks,
                        BlockKernels::State state) const;
  // Of the normalised measure, in nats over all samples: comparable with numbers of parameters, as a log
  // likelihood is.
  static double GainNats(const Value& before, const Value& after);

 private:
  bool applies_;
  IntensityRange range_;  // of both images: the level's scan has the template's mean and contrast
};

}  // namespace kvx
