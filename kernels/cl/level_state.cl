// Per-level state derived from the field: slopes of the template along the map, and curvature of the displacements.
// CPU twins: kernels/reference/level_state.cpp.
#include "block.cl.h"

static float3 kvx_land_at(global const float* base, global const float* linear, global const float4* field, const int v) {
  return kvx_land(base, linear, v, field[v].xyz);
}

// The template's slope per mm of displacement: with P = d(scan voxel)/d(voxel) of the map, linear^T P^-T grad t. Where P is
// nearly singular or incomplete, the slope in the template itself. One work-item per voxel.
kernel void template_slope(const int4 size, global const float* base, global const float* linear,
                           global const float4* field, global const float* intensity, global const float* weight,
                           const float4 inv0, const float4 inv1, const float4 inv2, global float4* out) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i >= size.x || j >= size.y || k >= size.z) return;
  const int v = kvx_voxel(size, i, j, k), row = size.x, slice = size.x * size.y;
  out[v] = 0.0f;
  if (i == 0 || j == 0 || k == 0 || i == size.x - 1 || j == size.y - 1 || k == size.z - 1 || weight[v] <= 0.0f) return;
  const float3 g = 0.5f * (float3)(intensity[v + 1] - intensity[v - 1], intensity[v + row] - intensity[v - row],
                                   intensity[v + slice] - intensity[v - slice]);
  // inv0..2: rows of (voxel from mm)^T, so that a slope per voxel becomes one per mm.
  const float3 plain = (float3)(dot(inv0.xyz, g), dot(inv1.xyz, g), dot(inv2.xyz, g));
  out[v] = (float4)(plain, 0.0f);
  if (weight[v - 1] <= 0.0f || weight[v + 1] <= 0.0f || weight[v - row] <= 0.0f || weight[v + row] <= 0.0f ||
      weight[v - slice] <= 0.0f || weight[v + slice] <= 0.0f) return;
  const float3 pi = 0.5f * (kvx_land_at(base, linear, field, v + 1) - kvx_land_at(base, linear, field, v - 1));
  const float3 pj = 0.5f * (kvx_land_at(base, linear, field, v + row) - kvx_land_at(base, linear, field, v - row));
  const float3 pk = 0.5f * (kvx_land_at(base, linear, field, v + slice) - kvx_land_at(base, linear, field, v - slice));
  const float3 jk = cross(pj, pk), ki = cross(pk, pi), ij = cross(pi, pj);
  const float det = dot(pi, jk), volume = length(pi) * length(pj) * length(pk);
  if (fabs(det) < 0.3f * volume || volume <= 0.0f) return;
  const float3 per_scan_voxel = (jk * g.x + ki * g.y + ij * g.z) / det;  // P^-T g
  out[v] = (float4)(kvx_pull(linear, v, per_scan_voxel), 0.0f);
}

// stiffness * laplacian of the field on every second voxel, 0 on the border. `axis`: 1 / (2 spacing)^2 per axis in mm.
// One work-item per cell.
kernel void cell_curvature(const int4 size, global const float4* field, global const float* stiffness, const float4 axis,
                           global float4* out) {
  const int x = get_global_id(0), y = get_global_id(1), z = get_global_id(2);
  const int4 coarse = (int4)(size.xyz / 2, 0);
  if (x >= coarse.x || y >= coarse.y || z >= coarse.z) return;
  const int at = (z * coarse.y + y) * coarse.x + x;
  out[at] = 0.0f;
  if (x == 0 || y == 0 || z == 0 || x == coarse.x - 1 || y == coarse.y - 1 || z == coarse.z - 1) return;
  const int v = kvx_voxel(size, 2 * x, 2 * y, 2 * z), row = 2 * size.x, slice = 2 * size.x * size.y;
  const float4 middle = 2.0f * field[v];
  out[at] = stiffness[at] * (axis.x * (field[v - 2] + field[v + 2] - middle) +
                             axis.y * (field[v - row] + field[v + row] - middle) +
                             axis.z * (field[v - slice] + field[v + slice] - middle));
}
