// Which bricks may reach a posed grid: a blend of bones stays in the hull of what each bone alone would do, so boxes of
// nodes, displaced by the least and the most that the examples can, bound a brick before it is posed.
// CPU twin: kernels/reference/evd_reach.cpp.
#include "evd_bricks.cl.h"
#define BONE_ROWS 5
#define SAFE_COSINE 0.866f  // as in evd_forward.cl: beyond it a dual-quaternion blend may leave the hull,
#define SAFE_OTHERS 0.26f   // but only if the other bones weigh so much that the blended matrix may near singular: (1 - 2 w)^3 < 0.1

// w d for w = least .. most (never below 0) and d = lo .. hi.
static float3 least_share(const float2 w, const float3 lo) { return fmin(w.x * lo, w.y * lo); }
static float3 most_share(const float2 w, const float3 hi) { return fmax(w.x * hi, w.y * hi); }

// One work-item per stored brick; `boxes`: least and greatest posed place of its nodes. What the prevailing bone does, and by
// how much the others may differ from it: their weights in the brick are mostly small.
kernel void bound_bricks(const int stored, global const int4* first_nodes, global const uint* palette_first,
                         global const uchar* palettes, global const float2* weight_ranges, global const uint* example_first,
                         global const int2* example_refs, global const float* example_ranges, global const float* coefficients,
                         const int used_examples, global const float4* bones, global float4* boxes) {
  const int brick = get_global_id(0);
  if (brick >= stored) return;
  const int here = palette_first[brick + 1] - palette_first[brick];
  global const uchar* palette = palettes + palette_first[brick];
  global const float2* weights = weight_ranges + palette_first[brick];
  int first = 0;
  for (int p = 1; p < here; ++p) first = weights[p].y > weights[first].y ? p : first;
  float3 least = 0.0f, most = 0.0f;  // of the displacement
  for (uint e = used_examples ? example_first[brick] : 0; e < (used_examples ? example_first[brick + 1] : 0); ++e) {
    const float c = coefficients[palette[first] * used_examples + example_refs[e].x];
    float small = c, great = c;
    for (int p = 0; p < here; ++p) {
      const float more = coefficients[palette[p] * used_examples + example_refs[e].x] - c;
      small += fmin(weights[p].x * more, weights[p].y * more), great += fmax(weights[p].x * more, weights[p].y * more);
    }
    const float3 a = vload3(2 * (size_t)e, example_ranges), b = vload3(2 * (size_t)e + 1, example_ranges);
    least += fmin(fmin(small * a, small * b), fmin(great * a, great * b));
    most += fmax(fmax(small * a, small * b), fmax(great * a, great * b));
  }
  const float3 middle = convert_float3(first_nodes[brick].xyz) + 1.5f + 0.5f * (least + most), reach = 1.5f + 0.5f * (most - least);
  global const float4* main_bone = bones + BONE_ROWS * palette[first];
  float3 lo = 0.0f, hi = 0.0f;
  float others = 0.0f;
  bool apart = false;
  for (int p = 0; p < here; ++p) {
    global const float4* bone = bones + BONE_ROWS * palette[p];
    float4 row[3];
    for (int r = 0; r < 3; ++r) row[r] = p == first ? bone[r] : bone[r] - main_bone[r];
    const float2 w = p == first ? (float2)(1.0f) : weights[p];
    const float3 at = (float3)(dot(row[0].xyz, middle) + row[0].w, dot(row[1].xyz, middle) + row[1].w, dot(row[2].xyz, middle) + row[2].w);
    const float3 around = (float3)(dot(fabs(row[0].xyz), reach), dot(fabs(row[1].xyz), reach), dot(fabs(row[2].xyz), reach));
    lo += least_share(w, at - around), hi += most_share(w, at + around);
    if (p != first) others += w.y;
    for (int q = 0; q < p; ++q) apart = apart || !(fabs(dot(bone[3], bones[BONE_ROWS * palette[q] + 3])) > SAFE_COSINE);
  }
  const float more = apart && others > SAFE_OTHERS ? 0.5f * length(hi - lo) : 0.0f;
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
