// Reduces cell moments to the blocks' normal equations, in a fixed order of summation. Layout per block:
// 6 x 64 (w JJ^T phi phi^T), 12 x 8 (w J s, w J t, w J and the force of the bending energy, by axis, times
// phi), 6 sums. CPU twin: kernels/reference/block_moments.cpp.
#include "block.cl.h"

#define CHANNELS 24  // of a cell's moments: see block_moments.cl
#define WEIGHT 18    // the channel that is 0 where nothing was seen
#define PER_BLOCK 486
#define SUMS 6
#define PARTS 3                // of a block's equations: LANES work-items each
#define PAIRS 5                // vectors that hold phi_a phi_b, a <= b, of a cell
#define PART_SUMS (3 * PAIRS)  // vectors that a part adds up, at most
#ifndef LANES                  // how many add up a part together, every one its cells
#define LANES 1
#endif

#if LANES > 1
// What all lanes have added up, in the first lane: in halves, so the order is fixed.
static void kvx_add_lanes(float8* sums, local float8* room, const int lane) {
  for (int half_of = LANES / 2; half_of > 0; half_of /= 2) {
    local float8* mine = room + PART_SUMS * (lane % half_of);
    if (lane >= half_of && lane < 2 * half_of) {
      for (int n = 0; n < PART_SUMS; ++n) mine[n] = sums[n];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < half_of) {
      for (int n = 0; n < PART_SUMS; ++n) sums[n] += mine[n];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}
#endif

// Three of the channels of w JJ^T, from channel `first` on: PAIRS vectors each.
static void kvx_add_pairs(const int3 corner, global const int4* ball, const int ball_count, const int4 cells,
                          global const float* moments, global const float8* pairs, const int first,
                          const int lane, float8* sum) {
  for (int c = lane; c < ball_count; c += LANES) {
    const int3 p = corner + ball[c].xyz;
    const int at = kvx_voxel(cells, p.x, p.y, p.z);
    if (at < 0) continue;
    global const float* m = moments + CHANNELS * (size_t)at;
    if (m[WEIGHT] <= 0.0f) continue;
    const float x = m[first], y = m[first + 1], z = m[first + 2];
#pragma unroll
    for (int n = 0; n < PAIRS; ++n) {
      const float8 pair = pairs[PAIRS * c + n];
      sum[n] += x * pair;
      sum[PAIRS + n] += y * pair;
      sum[2 * PAIRS + n] += z * pair;
    }
  }
}

// Both triangles of the three matrices whose upper ones `sum` holds.
static void kvx_store_pairs(const float8* sum, global float* to) {
  float upper[3][8 * PAIRS];
#pragma unroll
  for (int channel = 0; channel < 3; ++channel) {
#pragma unroll
    for (int n = 0; n < PAIRS; ++n) vstore8(sum[PAIRS * channel + n], n, upper[channel]);
  }
  for (int n = 0, pair = 0; n < 8; ++n) {
    for (int k = n; k < 8; ++k, ++pair) {
      for (int channel = 0; channel < 3; ++channel)
        to[64 * channel + 8 * n + k] = to[64 * channel + 8 * k + n] = upper[channel][pair];
    }
  }
}

// Of the bending energy on a cell, 0 on the border.
static float3 kvx_bending_force(global const float4* curvature, const float4 bend, const int4 cells,
                                const int3 p, const int at) {
  if (p.x == 0 || p.y == 0 || p.z == 0 || p.x == cells.x - 1 || p.y == cells.y - 1 || p.z == cells.z - 1)
    return (float3)(0.0f);
  const int row = cells.x, slice = cells.x * cells.y;
  const float4 middle = 2.0f * curvature[at];
  const float4 force = bend.x * (curvature[at - 1] + curvature[at + 1] - middle) +
                       bend.y * (curvature[at - row] + curvature[at + row] - middle) +
                       bend.z * (curvature[at - slice] + curvature[at + slice] - middle);
  return force.xyz;
}

// What is linear in J, and the bending energy's force: 12 vectors; then the sums.
static void kvx_add_first_order(const int3 corner, global const int4* ball, const int ball_count,
                                const int4 cells, global const float* moments,
                                global const float4* curvature, const float4 bend,
                                global const float* cell_mobility, global const float8* basis,
                                const int lane, float8* sum) {
  for (int c = lane; c < ball_count; c += LANES) {
    const int3 p = corner + ball[c].xyz;
    const int at = kvx_voxel(cells, p.x, p.y, p.z);
    if (at < 0) continue;
    const float8 phi = basis[c];
    const float3 force = cell_mobility[at] * kvx_bending_force(curvature, bend, cells, p, at);
    sum[9] += force.x * phi;
    sum[10] += force.y * phi;
    sum[11] += force.z * phi;
    global const float* m = moments + CHANNELS * (size_t)at;
    if (m[WEIGHT] <= 0.0f) continue;
#pragma unroll
    for (int n = 0; n < 9; ++n) sum[n] += m[6 + n] * phi;
    sum[12] += vload8(2, m);
  }
}

// `pairs`: PAIRS vectors per cell of the ball, rows of the upper triangle of phi phi^T one after the other.
// Several lanes: a group per block.
kernel void block_equations(global const int4* blocks, const int block_count, global const int4* ball,
                            const int ball_count, const int4 cells, global const float* moments,
                            global const float4* curvature, const float4 bend,
                            global const float* cell_mobility, global const float8* basis,
                            global const float8* pairs, global float* out) {
  const int item = get_global_id(0) / LANES, lane = get_global_id(0) % LANES;
  if (item >= block_count * PARTS) return;
  const int b = item / PARTS, part = item % PARTS;
  const int3 corner = blocks[b].xyz / 2;
  float8 sum[PART_SUMS];  // in registers where all loops over it are unrolled
#pragma unroll
  for (int n = 0; n < PART_SUMS; ++n) sum[n] = 0.0f;
  if (part < 2) {
    kvx_add_pairs(corner, ball, ball_count, cells, moments, pairs, 3 * part, lane, sum);
  } else {
    kvx_add_first_order(corner, ball, ball_count, cells, moments, curvature, bend, cell_mobility, basis, lane,
                        sum);
  }
#if LANES > 1
  local float8 room[PARTS * (LANES / 2) * PART_SUMS];
  kvx_add_lanes(sum, room + part * (LANES / 2) * PART_SUMS, lane);
#endif
  if (lane > 0) return;
  global float* to = out + (size_t)b * PER_BLOCK;
  if (part < 2) {
    kvx_store_pairs(sum, to + 3 * 64 * part);
    return;
  }
  to += 6 * 64;
#pragma unroll
  for (int n = 0; n < 12; ++n) vstore8(sum[n], n, to);
  to += 12 * 8;
  vstore4(sum[12].s2345, 0, to);
  vstore2(sum[12].s67, 0, to + 4);
}

// Sums over the cells of each block's ball. One work-item per block.
kernel void block_sums(global const int4* blocks, const int block_count, global const int4* ball,
                       const int ball_count, const int4 cells, global const float8* cell_sums,
                       global float* out) {
  const int b = get_global_id(0);
  if (b >= block_count) return;
  float8 sum = 0.0f;
  for (int c = 0; c < ball_count; ++c) {
    const int4 p = blocks[b] / 2 + ball[c];
    const int at = kvx_voxel(cells, p.x, p.y, p.z);
    if (at >= 0) sum += cell_sums[at];
  }
  global float* to = out + (size_t)b * SUMS;
  to[0] = sum.s0;
  to[1] = sum.s1;
  to[2] = sum.s2;
  to[3] = sum.s3;
  to[4] = sum.s4;
  to[5] = sum.s5;
}
