// Which bricks may reach a posed grid: a blend of bones stays in the hull of what each bone alone would do, so boxes of
// nodes, widened by the most that the examples can displace them, bound a brick before it is posed.
// CPU twin: kernels/reference/evd_reach.cpp.
#include "evd_bricks.cl.h"
#define BONE_ROWS 5
#define SAFE_COSINE 0.866f  // as in evd_forward.cl: beyond it a dual-quaternion blend may leave the hull
#define WHOLE_SCALE 32767.0f

// One work-item per stored brick; `boxes`: least and greatest posed place of its nodes.
kernel void bound_bricks(const int stored, global const int4* first_nodes, global const uint* palette_first,
                         global const uchar* palettes, global const uint* example_first, global const int2* example_refs,
                         global const float* coefficients, const int used_examples, global const float4* bones,
                         global float4* boxes) {
  const int brick = get_global_id(0);
  if (brick >= stored) return;
  const int here = palette_first[brick + 1] - palette_first[brick];
  global const uchar* palette = palettes + palette_first[brick];
  float aside = 0.0f;
  for (uint e = used_examples ? example_first[brick] : 0; e < (used_examples ? example_first[brick + 1] : 0); ++e) {
    float most = 0.0f;
    for (int p = 0; p < here; ++p) most = fmax(most, fabs(coefficients[palette[p] * used_examples + example_refs[e].x]));
    aside += most * WHOLE_SCALE * as_float(example_refs[e].y);
  }
  const float3 middle = convert_float3(first_nodes[brick].xyz) + 1.5f;
  float3 lo = INFINITY, hi = -INFINITY;
  bool bows = false;
  for (int p = 0; p < here; ++p) {
    global const float4* rows = bones + BONE_ROWS * palette[p];
    const float3 at = (float3)(dot(rows[0].xyz, middle) + rows[0].w, dot(rows[1].xyz, middle) + rows[1].w,
                               dot(rows[2].xyz, middle) + rows[2].w);
    const float3 around = (1.5f + aside) * (float3)(dot(fabs(rows[0].xyz), (float3)(1.0f)), dot(fabs(rows[1].xyz), (float3)(1.0f)),
                                                    dot(fabs(rows[2].xyz), (float3)(1.0f)));
    lo = fmin(lo, at - around), hi = fmax(hi, at + around);
    for (int q = 0; q < p; ++q) bows = bows || !(fabs(dot(rows[3], bones[BONE_ROWS * palette[q] + 3])) > SAFE_COSINE);
  }
  const float more = bows ? 0.5f * length(hi - lo) : 0.0f;
  boxes[2 * brick] = (float4)(lo - more, 0.0f);
  boxes[2 * brick + 1] = (float4)(hi + more, 0.0f);
}

// One work-item per brick with cells: whether the box of the nodes of its cells, `margin` voxels wider, meets the grid.
kernel void reach_grid(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                       global const float4* boxes, const float margin, const int4 size, global uchar* reaches) {
  const int brick = get_global_id(0);
  if (brick >= bricks.w) return;
  const int3 at = first_nodes[brick].xyz >> 2;
  float3 lo = INFINITY, hi = -INFINITY;
  for (int n = 0; n < 8; ++n) {
    const int3 b = at + (int3)(n & 1, (n >> 1) & 1, n >> 2);
    const int other = brick_at[(b.z * bricks.y + b.y) * bricks.x + b.x];
    lo = fmin(lo, boxes[2 * other].xyz), hi = fmax(hi, boxes[2 * other + 1].xyz);
  }
  reaches[brick] = !any(hi < -margin) && !any(lo > convert_float3(size.xyz - 1) + margin);
}
