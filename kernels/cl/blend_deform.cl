// u = (sum_j w_j T_j) x - x (eq. 2); one work-item per template voxel. x in mm from the grid's centre, T_j
// taken about it. weights: five words a voxel, four bone numbers and four floats. rigid: 16 floats a bone,
// rows of the 3x4 matrix and the quaternion (x, y, z, w). Where the blended matrix nears singular it fades
// into a dual-quaternion blend, as core/blend.cpp. CPU twin: kernels/reference/blend_deform.cpp.
#include "grid.cl.h"

static float4 quaternion_product(const float4 a, const float4 b) {
  return (float4)(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

static float3 rotated(const float4 q, const float3 x) {
  const float3 t = 2.0f * cross(q.xyz, x);
  return x + q.w * t + cross(q.xyz, t);
}

static float3 apply_rigid(global const float* rigid, const int bone, const float3 x) {
  return kvx_apply(vload4(4 * bone, rigid), vload4(4 * bone + 1, rigid), vload4(4 * bone + 2, rigid), x);
}

static float3 dual_quaternion_blend(const int4 bones, const float4 weights, global const float* rigid,
                                    const float3 x) {
  const int bone[4] = {bones.x, bones.y, bones.z, bones.w};
  const float weight[4] = {weights.x, weights.y, weights.z, weights.w};
  const float4 pivot = vload4(4 * bone[0] + 3, rigid);
  float4 real = (float4)(0.0f), dual = (float4)(0.0f);
  for (int s = 0; s < 4; ++s) {
    const float4 q = vload4(4 * bone[s] + 3, rigid);
    global const float* m = rigid + 16 * bone[s];
    const float4 half_t = (float4)(0.5f * m[3], 0.5f * m[7], 0.5f * m[11], 0.0f);
    const float signed_weight = dot(pivot, q) < 0.0f ? -weight[s] : weight[s];
    real += signed_weight * q;
    dual += signed_weight * quaternion_product(half_t, q);
  }
  const float norm = length(real);
  if (norm < 1e-6f) return apply_rigid(rigid, bone[0], x);
  const float4 q = real / norm;
  const float4 conjugate = (float4)(-q.xyz, q.w);
  return rotated(q, x) + 2.0f * quaternion_product(dual / norm, conjugate).xyz;
}

kernel void blend_deform(global const uint* weights_map, global const float* rigid,
                         const KvxGrid centred_grid, const float2 singular_regular, global float* field) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i >= centred_grid.size.x || j >= centred_grid.size.y || k >= centred_grid.size.z) return;
  const size_t at = ((size_t)k * centred_grid.size.y + j) * centred_grid.size.x + i;
  const float3 x = kvx_to_mm(centred_grid, (float3)(i, j, k));
  global const uint* voxel = weights_map + 5 * at;
  const int4 bone = convert_int4(as_uchar4(voxel[0]));
  const float4 w = as_float4((uint4)(voxel[1], voxel[2], voxel[3], voxel[4]));
  if (w.y == 0.0f) {
    vstore3(apply_rigid(rigid, bone.x, x) - x, at, field);
    return;
  }
  float4 row[3];
  for (int r = 0; r < 3; ++r) {
    row[r] = w.x * vload4(4 * bone.x + r, rigid) + w.y * vload4(4 * bone.y + r, rigid) +
             w.z * vload4(4 * bone.z + r, rigid) + w.w * vload4(4 * bone.w + r, rigid);
  }
  const float determinant = dot(row[0].xyz, cross(row[1].xyz, row[2].xyz));
  float3 moved = kvx_apply(row[0], row[1], row[2], x);
  const float t =
      clamp((determinant - singular_regular.x) / (singular_regular.y - singular_regular.x), 0.0f, 1.0f);
  if (t < 1.0f) moved = mix(dual_quaternion_blend(bone, w, rigid, x), moved, t * t * (3.0f - 2.0f * t));
  vstore3(moved - x, at, field);
}
