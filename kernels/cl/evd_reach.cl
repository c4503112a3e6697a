// Which bricks may reach a posed grid: a blend of bones stays in the hull of what each bone alone would do,
// so boxes of nodes, displaced by the least and the most that examples and `added` can, bound a brick before it
// is posed. CPU twin: kernels/reference/evd_reach.cpp.
#include "evd_bricks.cl.h"

// One work-item per stored brick; `boxes`: least and greatest posed place of its nodes, and the bone that
// prevails. What the prevailing bone does, and by how much the others may differ from it: their weights in
// the brick are mostly small. Ranges are middles and half-widths. A dual-quaternion blend may leave the hull:
// only where bones are turned apart, and the others than the prevailing one weigh more than `safe_others`.
kernel void bound_bricks(const int stored, global const int4* first_nodes, global const uint* palette_first,
                         global const uchar* palettes, global const float2* weight_ranges,
                         global const uint* example_first, global const int2* example_refs,
                         global const float* example_ranges, global const float* coefficients,
                         const int used_examples, global const float* added_ranges, const int adds,
                         global const float4* bones, const float safe_others, global float4* boxes) {
  const int brick = get_global_id(0);
  if (brick >= stored) return;
  const int here = palette_first[brick + 1] - palette_first[brick];
  global const uchar* palette = palettes + palette_first[brick];
  global const float2* weights = weight_ranges + palette_first[brick];
  int first = 0;
  for (int p = 1; p < here; ++p) first = weights[p].y > weights[first].y ? p : first;
  float3 middle = convert_float3(first_nodes[brick].xyz) + 1.5f, reach = 1.5f;  // of the displaced nodes
  if (adds) {
    const float3 a = vload3(2 * (size_t)brick, added_ranges), b = vload3(2 * (size_t)brick + 1, added_ranges);
    middle += 0.5f * (a + b), reach += 0.5f * (b - a);
  }
  for (uint e = used_examples ? example_first[brick] : 0; e < (used_examples ? example_first[brick + 1] : 0);
       ++e) {
    const float main = coefficients[palette[first] * used_examples + example_refs[e].x];
    float c = main, by = 0.0f;
    for (int p = 0; p < here; ++p) {
      const float more = coefficients[palette[p] * used_examples + example_refs[e].x] - main;
      c += 0.5f * (weights[p].x + weights[p].y) * more,
          by += 0.5f * (weights[p].y - weights[p].x) * fabs(more);
    }
    const float3 a = vload3(2 * (size_t)e, example_ranges), b = vload3(2 * (size_t)e + 1, example_ranges);
    const float3 d = 0.5f * (a + b), around = 0.5f * (b - a);
    middle += c * d, reach += fabs(c) * around + by * (fabs(d) + around);
  }
  global const float4* main_bone = bones + KVX_BONE_ROWS * palette[first];
  float3 place = 0.0f, spread = 0.0f;
  float others = 0.0f;
  bool apart = false;
  for (int p = 0; p < here; ++p) {
    global const float4* bone = bones + KVX_BONE_ROWS * palette[p];
    float4 row[3];
    for (int r = 0; r < 3; ++r) row[r] = p == first ? bone[r] : bone[r] - main_bone[r];
    const float w = p == first ? 1.0f : 0.5f * (weights[p].x + weights[p].y),
                by = p == first ? 0.0f : 0.5f * (weights[p].y - weights[p].x);
    const float3 at = (float3)(dot(row[0].xyz, middle) + row[0].w, dot(row[1].xyz, middle) + row[1].w,
                               dot(row[2].xyz, middle) + row[2].w);
    const float3 around =
        (float3)(dot(fabs(row[0].xyz), reach), dot(fabs(row[1].xyz), reach), dot(fabs(row[2].xyz), reach));
    place += w * at, spread += w * around + by * (fabs(at) + around);
    if (p != first) others += weights[p].y;
    for (int q = 0; q < p; ++q)
      apart = apart || !(fabs(dot(bone[3], bones[KVX_BONE_ROWS * palette[q] + 3])) > KVX_SAFE_COSINE);
  }
  if (apart && others > safe_others) spread += length(spread);
  boxes[2 * brick] = (float4)(place - spread, as_float((int)palette[first]));
  boxes[2 * brick + 1] = (float4)(place + spread, 0.0f);
}

#define NARROWER \
  6  // per bone: what the box of a brick loses at its least and at its greatest, along x, y and z

// One work-item per brick with cells: whether the box of its cells' nodes meets a grid, if it is `margin`
// voxels wider, or `cut_margin` where parts may draw apart. Of the bricks above, the cells need only the
// nodes that face this one: what the prevailing bone does to the others is taken off their boxes
// (`narrower`). `row_x` and on: from the boxes' voxels to the grid's.
kernel void reach_grid(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                       global const ulong* cuts, global const float4* boxes, global const float4* narrower,
                       const float4 row_x, const float4 row_y, const float4 row_z, const float margin,
                       const float cut_margin, const int4 size, global uchar* reaches) {
  const int brick = get_global_id(0);
  if (brick >= bricks.w) return;
  const int3 at = first_nodes[brick].xyz >> 2;
  float4 lo = INFINITY, hi = -INFINITY;
#pragma unroll
  for (int n = 0; n < 8; ++n) {
    const int3 b = at + (int3)(n & 1, (n >> 1) & 1, n >> 2);
    const int other = brick_at[(b.z * bricks.y + b.y) * bricks.x + b.x];
    float4 least = boxes[2 * other], most = boxes[2 * other + 1];
    global const float4* less = narrower + NARROWER * as_int(least.w);
    if (n & 1) least += less[0], most -= less[3];
    if (n & 2) least += less[1], most -= less[4];
    if (n & 4) least += less[2], most -= less[5];
    lo = least < lo ? least : lo, hi = most > hi ? most : hi;
  }
  const float3 middle = 0.5f * (lo.xyz + hi.xyz), half_width = 0.5f * (hi.xyz - lo.xyz);
  const float3 place = (float3)(dot(row_x.xyz, middle) + row_x.w, dot(row_y.xyz, middle) + row_y.w,
                                dot(row_z.xyz, middle) + row_z.w);
  const float3 spread = (cuts[2 * brick + 1] ? cut_margin : margin) +
                        (float3)(dot(fabs(row_x.xyz), half_width), dot(fabs(row_y.xyz), half_width),
                                 dot(fabs(row_z.xyz), half_width));
  reaches[brick] = !any(place + spread < 0.0f) && !any(place - spread > convert_float3(size.xyz - 1));
}
