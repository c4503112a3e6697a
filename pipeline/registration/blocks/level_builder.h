// The resolution levels that the block registration works on, from wherever it starts.
#pragma once
#include <optional>
#include <span>

#include "pipeline/registration/blocks/block_prior.h"
#include "pipeline/registration/images/level_images.h"

namespace kvx {

// The finest levels. Coarser ones are there for starts from far off alone: what they find only has to be
// within reach of these.
constexpr size_t kNearLevels = 2;

// Around the body, of a size that every level can be made of: an even number of voxels on each.
WorkRegion RegionOfLevels(const Mask& body);

class LevelBuilder {
 public:
  // The inputs must outlive the builder. `times`: as LevelImages has it.
  LevelBuilder(const RegistrationInputs& inputs, const Eigen::Vector3i& times, const Volume& beyond_coat_mm,
               const WorkRegion& region, Backend& backend);

  // Levels from fine to coarse, each half the resolution of the one before. `start_mm`: where every voxel of
  // the region starts, in scan mm. How stiff the field is lies between what this start says and those before.
  std::vector<BlockLevel> Build(std::span<const Eigen::Vector3f> start_mm);
  const LevelImages& images() const { return images_; }

 private:
  const RegistrationInputs& inputs_;
  WorkRegion region_;
  Pyramid pyramid_;
  LevelImages images_;
  std::optional<Firmness> firmness_;
};

}  // namespace kvx
