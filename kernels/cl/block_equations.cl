// Reduces cell moments to the blocks' normal equations; one work-item per block and channel, fixed order of
// summation. Layout per block: 6 x 64 (w JJ^T phi phi^T), 12 x 8 (channels 6-17 times phi), 6 sums. CPU twin:
// kernels/reference/block_moments.cpp.
#include "block.cl.h"

#define CHANNELS 24
#define PER_BLOCK 486
#define SUMS 6

kernel void block_equations(global const float* moments, const int block_count, global const float8* basis,
                            const int cell_count, global float* out) {
  const int item = get_global_id(0);
  if (item >= block_count * CHANNELS) return;
  const int b = item / CHANNELS, n = item % CHANNELS;
  global const float* m = moments + (size_t)item * cell_count;
  global float* to = out + (size_t)b * PER_BLOCK;
  if (n < 6) {
    float8 r0 = 0.0f, r1 = 0.0f, r2 = 0.0f, r3 = 0.0f, r4 = 0.0f, r5 = 0.0f, r6 = 0.0f, r7 = 0.0f;
    for (int c = 0; c < cell_count; ++c) {
      const float8 phi = basis[c], w = phi * m[c];
      r0 += phi.s0 * w;
      r1 += phi.s1 * w;
      r2 += phi.s2 * w;
      r3 += phi.s3 * w;
      r4 += phi.s4 * w;
      r5 += phi.s5 * w;
      r6 += phi.s6 * w;
      r7 += phi.s7 * w;
    }
    to += n * 64;
    vstore8(r0, 0, to);
    vstore8(r1, 1, to);
    vstore8(r2, 2, to);
    vstore8(r3, 3, to);
    vstore8(r4, 4, to);
    vstore8(r5, 5, to);
    vstore8(r6, 6, to);
    vstore8(r7, 7, to);
  } else if (n < 18) {
    float8 sum = 0.0f;
    for (int c = 0; c < cell_count; ++c) sum += basis[c] * m[c];
    vstore8(sum, n - 6, to + 384);
  } else {
    float sum = 0.0f;
    for (int c = 0; c < cell_count; ++c) sum += m[c];
    to[480 + n - 18] = sum;
  }
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
