// Self-contact: air beside the skin that a pose closes, as between the fingers of a fist.
#pragma once
#include <span>

#include "core/image.h"

namespace kvx {

// Air voxels of the template that the start carries to where it carries tissue of another place too. There
// the scan shows that tissue, and says nothing about the air. `start`: scan voxels, at least three numbers a
// voxel.
Mask ClosedAir(const Mask& body, std::span<const Eigen::Vector4f> start, const Grid& scan);

}  // namespace kvx
