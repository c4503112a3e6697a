// Cells twice as wide, for blocks twice as wide on the same images: what they hold of the cells, and their
// steps given back (coarse-grid correction: Briggs, Henson and McCormick, A Multigrid Tutorial, 2000). `wide`
// and `cells`: how many there are along each axis. CPU twin:
// kernels/reference/block_moments.cpp.
#include "block.cl.h"
#include "block_step.cl.h"

// A cell of a wide cell's eight; below 0 where there is none.
static int kvx_inner_cell(const int4 wide, const int4 cells, const int n, const int corner) {
  const int3 at = 2 * kvx_cell(wide, n) + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
  return kvx_voxel(cells, at.x, at.y, at.z);
}

// The sums of eight cells, and their mean field. One work-item per wide cell.
kernel void restrict_cells(const int count, const int4 wide, const int4 cells, global const float* moments,
                           global const float4* cell_field, global float* wide_moments,
                           global float4* wide_field) {
  const int n = get_global_id(0);
  if (n >= count) return;
  float8 second = 0.0f, cross = 0.0f, sums = 0.0f;
  float4 field = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int c = kvx_inner_cell(wide, cells, n, corner);
    if (c < 0) continue;
    global const float* m = moments + CHANNELS * (size_t)c;
    second += vload8(0, m);
    cross += vload8(1, m);
    sums += vload8(2, m);
    field += cell_field[c];
  }
  global float* to = wide_moments + CHANNELS * (size_t)n;
  vstore8(second, 0, to);
  vstore8(cross, 1, to);
  vstore8(sums, 2, to);
  wide_field[n] = 0.125f * field;
}

// As above, of what cell_sums gives.
kernel void restrict_sums(const int count, const int4 wide, const int4 cells, global const float8* cell_sums,
                          global float8* wide_sums) {
  const int n = get_global_id(0);
  if (n >= count) return;
  float8 sums = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int c = kvx_inner_cell(wide, cells, n, corner);
    if (c >= 0) sums += cell_sums[c];
  }
  wide_sums[n] = sums;
}

// Every cell takes the wide cells' steps as they are at its centre, linear between theirs. One work-item per
// cell.
kernel void prolong_steps(const int count, const int4 wide, const int4 cells, global const float4* wide_steps,
                          global const float* cell_mobility, global float* moments, global float4* cell_steps,
                          global float4* cell_field, global uchar* touched) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const float3 at = 0.5f * convert_float3(kvx_cell(cells, n)) - 0.25f;
  const float3 p =
      kvx_sample4(wide_steps, wide, clamp(at, (float3)(0.0f), convert_float3(wide.xyz - 1))).xyz;
  if (p.x == 0.0f && p.y == 0.0f && p.z == 0.0f) return;
  touched[n] = 1;
  kvx_take_step(n, p, cell_mobility, moments, cell_steps, cell_field);
}
