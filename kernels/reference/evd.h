// Plain-loop twins of evd_forward.cl, rasterise_tetrahedra.cl and evd_inverse_sample.cl.
#pragma once
#include "core/blend.h"
#include "kernels/bricked_body.h"

namespace kvx::reference {

// What the kernels leave per posed voxel and node; places in voxels.
using Places = std::vector<Eigen::Vector3d>;

// Eq. 6 at every stored node, in voxels of the posed grid.
Places EvdForward(const BrickedBody& body, const Grid& template_grid, const Grid& posed_grid,
                  const PoseVector& pose, const Eigen::MatrixXf& coefficients);

// Which bricks one linear cell describes.
std::vector<uint8_t> SmoothBricks(const BrickedBody& body, const Places& posed, double volume_ratio);

// The owner of every posed voxel; 0xFFFFFFFF where there is none.
std::vector<uint32_t> RasteriseTetrahedra(const BrickedBody& body, const Places& posed,
                                          const std::vector<uint8_t>& smooth, const Grid& template_grid,
                                          const Grid& posed_grid);

// The template's intensities at the places that land on the posed voxels.
Volume EvdInverseSample(const BrickedBody& body, const Places& posed, const std::vector<uint32_t>& owner,
                        const Grid& posed_grid, const Volume& template_volume, float air);

}  // namespace kvx::reference
