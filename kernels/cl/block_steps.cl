// The cells of blocks, brought up to date when blocks take a step. Supports of the blocks of one launch are
// disjoint. One work-item per ball cell (x) and block (y). CPU twin: kernels/reference/block_moments.cpp.
#include "block.cl.h"
#include "block_step.cl.h"

kernel void add_steps(global const int4* blocks, const int block_count, global const int4* ball,
                      global const float8* basis, const int ball_count, const int4 cells,
                      global const float* steps, global const float* cell_mobility, global float* moments,
                      global float4* cell_steps, global float4* cell_field, global uchar* touched) {
  const int c = get_global_id(0), b = get_global_id(1);
  if (c >= ball_count || b >= block_count) return;
  const int4 at = blocks[b] / 2 + ball[c];
  const int cell = kvx_voxel(cells, at.x, at.y, at.z);
  if (cell < 0) return;
  const float8 phi = basis[c];
  global const float* f = steps + 24 * b;  // x of the 8 control points, then y, then z
  const float8 x = phi * vload8(0, f), y = phi * vload8(1, f), z = phi * vload8(2, f);
  const float4 x4 = x.lo + x.hi, y4 = y.lo + y.hi, z4 = z.lo + z.hi;
  const float3 p = (float3)(x4.x + x4.y + x4.z + x4.w, y4.x + y4.y + y4.z + y4.w, z4.x + z4.y + z4.z + z4.w);
  touched[cell] = 1;
  kvx_take_step(cell, p, cell_mobility, moments, cell_steps, cell_field);
}
