// Samples `moving` at x + u(x); one work-item per fixed voxel. u in mm, LPS, three floats per fixed voxel.
// Outside the moving grid, and where `wanted` is 0: `outside`. CPU twin: kernels/reference/warp.cpp.
#include "grid.cl.h"

kernel void warp_trilinear(global const float* moving, const KvxGrid moving_grid,
                           global const float* moving_from_fixed, const KvxGrid fixed_grid,
                           global const uchar* wanted, const float outside, global float* out) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i >= fixed_grid.size.x || j >= fixed_grid.size.y || k >= fixed_grid.size.z) return;
  const size_t at = ((size_t)k * fixed_grid.size.y + j) * fixed_grid.size.x + i;
  if (!wanted[at]) {
    out[at] = outside;
    return;
  }
  const float3 x = kvx_to_mm(fixed_grid, (float3)(i, j, k)) + vload3(at, moving_from_fixed);
  out[at] = kvx_sample(moving, moving_grid.size, kvx_to_vox(moving_grid, x), outside);
}
