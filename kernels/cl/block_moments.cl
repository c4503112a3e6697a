// Sums over cells of 2 x 2 x 2 voxels from which the blocks' normal equations are built: the spline is smooth across a
// cell, so it is evaluated once per cell. One work-item per cell of a block's ball (x) and block (y).
// CPU twin: kernels/reference/block_moments.cpp.
#include "block.cl.h"

#define CHANNELS 24
#define SUMS 6

// Channels: 0-5 w JJ^T (xx xy xz yy yz zz), 6-8 w J s, 9-11 w J t, 12-14 w J, 15-17 bending force, 18-23 as cell_sums.
// J = mobility * mean slope of scan and template per mm; s, t intensities of scan and template.
kernel void cell_moments(global const int4* blocks, const int block_count, global const int4* cells, const int cell_count,
                         const int4 size, global const float* base, global const float* linear,
                         global const float4* field, global const float4* scan, const int4 scan_size,
                         global const float* intensity, global const float4* template_slope, global const float* weight,
                         global const float* mobility, global const float4* curvature, const float4 bend,
                         global float* moments) {
  const int c = get_global_id(0), b = get_global_id(1);
  if (c >= cell_count || b >= block_count) return;
  const int4 first = blocks[b] + 2 * cells[c];
  float sums[CHANNELS];
  for (int n = 0; n < CHANNELS; ++n) sums[n] = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int v = kvx_voxel(size, first.x + (corner & 1), first.y + ((corner >> 1) & 1), first.z + (corner >> 2));
    if (v < 0) continue;
    const float w = weight[v];
    if (w <= 0.0f) continue;
    const float3 p = kvx_land(base, linear, v, field[v].xyz);
    if (!kvx_inside(scan_size, p)) continue;
    const float4 s = kvx_sample4(scan, scan_size, p);
    const float t = intensity[v], m = mobility[v];
    const float3 j = m * 0.5f * (kvx_pull(linear, v, s.yzw) + template_slope[v].xyz);
    const float3 wj = w * j;
    sums[0] += wj.x * j.x; sums[1] += wj.x * j.y; sums[2] += wj.x * j.z;
    sums[3] += wj.y * j.y; sums[4] += wj.y * j.z; sums[5] += wj.z * j.z;
    sums[6] += wj.x * s.x; sums[7] += wj.y * s.x; sums[8] += wj.z * s.x;
    sums[9] += wj.x * t;   sums[10] += wj.y * t;  sums[11] += wj.z * t;
    sums[12] += wj.x;      sums[13] += wj.y;      sums[14] += wj.z;
    sums[18] += w;         sums[19] += w * t;     sums[20] += w * s.x;
    sums[21] += w * t * t; sums[22] += w * t * s.x; sums[23] += w * s.x * s.x;
  }
  const int v = kvx_voxel(size, first.x, first.y, first.z);
  const int4 coarse = (int4)(size.xyz / 2, 0);
  const int x = first.x / 2, y = first.y / 2, z = first.z / 2;
  if (v >= 0 && x > 0 && y > 0 && z > 0 && x < coarse.x - 1 && y < coarse.y - 1 && z < coarse.z - 1) {
    const int row = coarse.x, slice = coarse.x * coarse.y, at = (z * coarse.y + y) * coarse.x + x;
    const float4 middle = 2.0f * curvature[at];
    const float4 force = bend.x * (curvature[at - 1] + curvature[at + 1] - middle) +
                         bend.y * (curvature[at - row] + curvature[at + row] - middle) +
                         bend.z * (curvature[at - slice] + curvature[at + slice] - middle);
    const float m = mobility[v];
    sums[15] = m * force.x; sums[16] = m * force.y; sums[17] = m * force.z;
  }
  for (int n = 0; n < CHANNELS; ++n) moments[((size_t)b * CHANNELS + n) * cell_count + c] = sums[n];
}

// Per voxel of each block's ball: template, scan, 1 (or three zeros where it does not count or leaves the scan).
kernel void ball_samples(global const int4* blocks, const int block_count, global const int4* voxels, const int voxel_count,
                         const int4 size, global const float* base, global const float* linear,
                         global const float4* field, global const float4* scan, const int4 scan_size,
                         global const float* intensity, global const float* weight, global float* out) {
  const int n = get_global_id(0), b = get_global_id(1);
  if (n >= voxel_count || b >= block_count) return;
  const int4 at = blocks[b] + voxels[n];
  const int v = kvx_voxel(size, at.x, at.y, at.z);
  float s = 0.0f, t = 0.0f, counts = 0.0f;
  if (v >= 0 && weight[v] > 0.0f) {
    const float3 p = kvx_land(base, linear, v, field[v].xyz);
    if (kvx_inside(scan_size, p)) {
      s = kvx_sample4(scan, scan_size, p).x;
      t = intensity[v];
      counts = 1.0f;
    }
  }
  global float* to = out + (size_t)b * 3 * voxel_count + n;
  to[0] = t; to[voxel_count] = s; to[2 * voxel_count] = counts;
}

// Channels: sums of w, w t, w s, w t t, w t s, w s s: what a fit of gain and bias needs.
kernel void cell_sums(global const int4* blocks, const int block_count, global const int4* cells, const int cell_count,
                      const int4 size, global const float* base, global const float* linear, global const float4* field,
                      global const float4* scan, const int4 scan_size, global const float* intensity,
                      global const float* weight, global float* out) {
  const int c = get_global_id(0), b = get_global_id(1);
  if (c >= cell_count || b >= block_count) return;
  const int4 first = blocks[b] + 2 * cells[c];
  float sums[SUMS];
  for (int n = 0; n < SUMS; ++n) sums[n] = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int v = kvx_voxel(size, first.x + (corner & 1), first.y + ((corner >> 1) & 1), first.z + (corner >> 2));
    if (v < 0) continue;
    const float w = weight[v];
    if (w <= 0.0f) continue;
    const float3 p = kvx_land(base, linear, v, field[v].xyz);
    if (!kvx_inside(scan_size, p)) continue;
    const float s = kvx_sample4(scan, scan_size, p).x, t = intensity[v];
    sums[0] += w;         sums[1] += w * t;     sums[2] += w * s;
    sums[3] += w * t * t; sums[4] += w * t * s; sums[5] += w * s * s;
  }
  for (int n = 0; n < SUMS; ++n) out[((size_t)b * SUMS + n) * cell_count + c] = sums[n];
}
