// Sums over the voxels of every cell from which the blocks' normal equations are built: the spline is smooth
// across a cell, so it is evaluated once per cell. One work-item per visible cell; 24 numbers per cell, 6 of 8
// for sums alone. CPU twin: kernels/reference/block_moments.cpp.
#include "block.cl.h"
#include "grid.cl.h"

// What both images show, or what they show at `v` where the scan shows nothing at `beside`.
static float kvx_sum_beside(global const float* seen, global const float* intensity, const int v,
                            const int beside) {
  const int at = seen[beside] == KVX_UNSEEN ? v : beside;
  return seen[at] + intensity[at];
}

// Mean slope of both images per voxel along the axis of `stride`, on which voxel v is the nth of `size`.
// Differences over two voxels and over four are put together to what splines through the images have for
// waves of four voxels, and within 5 % for longer ones. Beside borders of what was seen the former stand
// alone; at one, the difference to the only neighbour.
static float kvx_slope(global const float* seen, global const float* intensity, const int v, const int stride,
                       const int n, const int size) {
  const int before = n > 0 ? v - stride : v, after = n + 1 < size ? v + stride : v;
  const bool ends = before == v || after == v || seen[before] == KVX_UNSEEN || seen[after] == KVX_UNSEEN;
  const float near = (ends ? 0.5f : 0.25f) * (kvx_sum_beside(seen, intensity, v, after) -
                                              kvx_sum_beside(seen, intensity, v, before));
  if (n < 2 || n + 2 >= size) return near;
  const int first = v - 2 * stride, last = v + 2 * stride;
  if (seen[first] == KVX_UNSEEN || seen[before] == KVX_UNSEEN || seen[after] == KVX_UNSEEN ||
      seen[last] == KVX_UNSEEN)
    return near;
  const float far = 0.125f * (seen[last] + intensity[last] - seen[first] - intensity[first]);
  return 1.5f * near - 0.5f * far;
}

// Channels: 0-5 w JJ^T (xx xy xz yy yz zz), 6-8 w J s, 9-11 w J t, 12-14 w J, 15-17 left at 0, 18-23 as
// cell_sums. J = mobility * mean slope per mm of the intensities of scan and template: displacements act
// before the map. s: the scan's; t: what it should be.
kernel void cell_moments(global const int* active, const int count, const int4 cells, const KvxGrid grid,
                         global const float* seen, global const float* intensity, global const float* target,
                         global const float* weight, global const float* mobility, global float* moments,
                         global float8* cell_sums) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const int3 first = 2 * kvx_cell(cells, active[n]);
  const int row = grid.size.x, slice = grid.size.x * grid.size.y;
  float8 second = 0.0f, cross = 0.0f, sums = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int3 at = first + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
    const int v = (at.z * grid.size.y + at.y) * grid.size.x + at.x;
    const float w = weight[v], s = seen[v], t = target[v];
    if (w <= 0.0f || s == KVX_UNSEEN) continue;
    const float gx = kvx_slope(seen, intensity, v, 1, at.x, grid.size.x);
    const float gy = kvx_slope(seen, intensity, v, row, at.y, grid.size.y);
    const float gz = kvx_slope(seen, intensity, v, slice, at.z, grid.size.z);
    const float3 j = mobility[v] * (grid.vox_from_mm[0].xyz * gx + grid.vox_from_mm[1].xyz * gy +
                                    grid.vox_from_mm[2].xyz * gz);
    const float3 wj = w * j;
    second +=
        (float8)(wj.x * j.x, wj.x * j.y, wj.x * j.z, wj.y * j.y, wj.y * j.z, wj.z * j.z, wj.x * s, wj.y * s);
    cross += (float8)(wj.z * s, wj.x * t, wj.y * t, wj.z * t, wj.x, wj.y, wj.z, 0.0f);
    sums += (float8)(w, w * t, w * s, w * t * t, w * t * s, w * s * s, 0.0f, 0.0f);
  }
  global float* to = moments + 24 * (size_t)active[n];
  vstore8(second, 0, to);
  vstore8(cross, 1, to);
  vstore8((float8)(0.0f, 0.0f, sums.s0, sums.s1, sums.s2, sums.s3, sums.s4, sums.s5), 2, to);
  cell_sums[active[n]] = sums;
}

// w, w t, w s, w t t, w t s, w s s: what a fit of gain and bias needs. Cells that have not changed keep
// theirs, or take those from before.
kernel void cell_sums(global const int* active, const int count, const int4 cells, const int4 size,
                      global const float* seen, global const float* intensity, global const float* weight,
                      global const uchar* changed, const int keep, global const float8* before,
                      global float8* out) {
  const int n = get_global_id(0);
  if (n >= count) return;
  if (!changed[active[n]]) {
    if (!keep) out[active[n]] = before[active[n]];
    return;
  }
  const int3 first = 2 * kvx_cell(cells, active[n]);
  float8 sums = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int v = ((first.z + (corner >> 2)) * size.y + first.y + ((corner >> 1) & 1)) * size.x + first.x +
                  (corner & 1);
    const float w = weight[v], s = seen[v], t = intensity[v];
    if (w <= 0.0f || s == KVX_UNSEEN) continue;
    sums += (float8)(w, w * t, w * s, w * t * t, w * t * s, w * s * s, 0.0f, 0.0f);
  }
  out[active[n]] = sums;
}

// Per voxel of each block's ball: template, scan, 1 (or three zeros where it does not count or was not seen).
kernel void ball_samples(global const int4* blocks, const int block_count, global const int4* voxels,
                         const int voxel_count, const int4 size, global const float* seen,
                         global const float* intensity, global const float* weight, global float* out) {
  const int n = get_global_id(0), b = get_global_id(1);
  if (n >= voxel_count || b >= block_count) return;
  const int4 at = blocks[b] + voxels[n];
  const int v = kvx_voxel(size, at.x, at.y, at.z);
  const bool counts = v >= 0 && weight[max(v, 0)] > 0.0f && seen[max(v, 0)] != KVX_UNSEEN;
  global float* to = out + (size_t)b * 3 * voxel_count + n;
  to[0] = counts ? intensity[v] : 0.0f;
  to[voxel_count] = counts ? seen[v] : 0.0f;
  to[2 * voxel_count] = counts ? 1.0f : 0.0f;
}
