// Composition of block steps with the displacement field, d'(v) = u(v) + d(v + u(v)), and its acceptance.
// u = mobility * sum_a phi_a F_a in mm. Supports of the blocks of one launch are disjoint; `trial` is written, `field` read.
// One work-item per ball voxel (x) and block (y). CPU twin: kernels/reference/block_steps.cpp.
#include "block.cl.h"
#include "grid.cl.h"

kernel void apply_steps(global const int4* blocks, const int block_count, global const int4* voxels,
                        global const float8* basis, const int voxel_count, const KvxGrid grid,
                        global const float* steps, global const float* mobility, global const float4* field,
                        global float4* trial) {
  const int n = get_global_id(0), b = get_global_id(1);
  if (n >= voxel_count || b >= block_count) return;
  const int4 at = blocks[b] + voxels[n];
  const int v = kvx_voxel(grid.size, at.x, at.y, at.z);
  if (v < 0) return;
  const float8 phi = basis[n];
  global const float* f = steps + 24 * b;  // x of the 8 control points, then y, then z
  const float8 x = phi * vload8(0, f), y = phi * vload8(1, f), z = phi * vload8(2, f);
  const float4 x4 = x.lo + x.hi, y4 = y.lo + y.hi, z4 = z.lo + z.hi;
  const float3 u = mobility[v] * (float3)(x4.x + x4.y + x4.z + x4.w, y4.x + y4.y + y4.z + y4.w, z4.x + z4.y + z4.z + z4.w);
  const float3 shift = (float3)(dot(grid.vox_from_mm[0].xyz, u), dot(grid.vox_from_mm[1].xyz, u),
                                dot(grid.vox_from_mm[2].xyz, u));
  const float3 p = clamp(convert_float3(at.xyz) + shift, (float3)(0.0f), convert_float3(grid.size.xyz - 1));
  trial[v] = (float4)(u, 0.0f) + kvx_sample4(field, grid.size, p);
}

kernel void accept_steps(global const int4* blocks, const int block_count, global const int4* voxels, const int voxel_count,
                         const int4 size, global const int* accepted, global const float4* trial, global float4* field) {
  const int n = get_global_id(0), b = get_global_id(1);
  if (n >= voxel_count || b >= block_count || !accepted[b]) return;
  const int4 at = blocks[b] + voxels[n];
  const int v = kvx_voxel(size, at.x, at.y, at.z);
  if (v >= 0) field[v] = trial[v];
}
