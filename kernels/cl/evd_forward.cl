// Eq. 6 at every stored template node: M(v) (v + sum_k c_k(v) d_k(v)), c_k(v) = sum_j w_j(v) c_jk; one work-item per node.
// Voxel coordinates throughout: template voxels in, posed voxels out. Bone j: 3 rows of posed_from_template, then the real
// and dual part of its unit dual quaternion in centred mm. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"
#define SINGULAR 0.1f
#define BONE_ROWS 5

// Where the blended matrix nears singular: the dual-quaternion blend of the same bones (core/blend.h).
static float3 dual_quaternion_place(global const float4* bones, const uchar4 bone, const float4 w, const float3 y) {
  const int index[4] = {bone.x, bone.y, bone.z, bone.w};
  const float weight[4] = {w.x, w.y, w.z, w.w};
  const float4 pivot = bones[BONE_ROWS * index[0] + 3];
  float4 real = 0.0f, dual = 0.0f;
  for (int s = 0; s < 4; ++s) {
    const float4 q = bones[BONE_ROWS * index[s] + 3];
    const float signed_weight = dot(pivot, q) < 0.0f ? -weight[s] : weight[s];
    real += signed_weight * q;
    dual += signed_weight * bones[BONE_ROWS * index[s] + 4];
  }
  const float norm = length(real);
  if (norm < 1e-6f) real = pivot, dual = bones[BONE_ROWS * index[0] + 4];
  else real /= norm, dual /= norm;
  const float3 shift = 2.0f * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
  return y + 2.0f * cross(real.xyz, cross(real.xyz, y) + real.w * y) + shift;
}

kernel void evd_forward(global const int4* first_nodes, global const uchar4* node_bones, global const float4* node_weights,
                        global const short* examples, const int used_examples, const int stored_examples,
                        global const float* coefficients,
                        global const float4* bones, global const float4* centred_mm_from_template,
                        global const float4* posed_from_centred_mm, const float volume_ratio, const int brick_count,
                        global float4* posed) {
  const size_t item = get_global_id(0);
  const int brick = item / KVX_NODES, n = item % KVX_NODES;
  if (brick >= brick_count) return;
  const int4 first = first_nodes[brick];
  const uchar4 bone = node_bones[item];
  const float4 w = node_weights[item];
  float3 v = convert_float3(first.xyz + (int3)(n & 3, (n >> 2) & 3, n >> 4));
  global const short* d = examples + (size_t)brick * stored_examples * 3 * KVX_NODES + n;
  for (int k = 0; k < used_examples; ++k, d += 3 * KVX_NODES) {  // the examples' scales are folded into the coefficients
    const float c = w.x * coefficients[bone.x * used_examples + k] + w.y * coefficients[bone.y * used_examples + k] +
                    w.z * coefficients[bone.z * used_examples + k] + w.w * coefficients[bone.w * used_examples + k];
    v += c * (float3)(d[0], d[KVX_NODES], d[2 * KVX_NODES]);
  }
  global const float4* b0 = bones + BONE_ROWS * bone.x;
  float4 r0 = w.x * b0[0], r1 = w.x * b0[1], r2 = w.x * b0[2];
  if (w.y > 0.0f) {
    global const float4* b1 = bones + BONE_ROWS * bone.y;
    global const float4* b2 = bones + BONE_ROWS * bone.z;
    global const float4* b3 = bones + BONE_ROWS * bone.w;
    r0 += w.y * b1[0] + w.z * b2[0] + w.w * b3[0];
    r1 += w.y * b1[1] + w.z * b2[1] + w.w * b3[1];
    r2 += w.y * b1[2] + w.z * b2[2] + w.w * b3[2];
  }
  float3 p = (float3)(dot(r0.xyz, v) + r0.w, dot(r1.xyz, v) + r1.w, dot(r2.xyz, v) + r2.w);
  if (w.y > 0.0f && dot(r0.xyz, cross(r1.xyz, r2.xyz)) * volume_ratio < SINGULAR) {
    global const float4* in = centred_mm_from_template;
    const float3 y = (float3)(dot(in[0].xyz, v) + in[0].w, dot(in[1].xyz, v) + in[1].w, dot(in[2].xyz, v) + in[2].w);
    const float3 x = dual_quaternion_place(bones, bone, w, y);
    global const float4* to = posed_from_centred_mm;
    p = (float3)(dot(to[0].xyz, x) + to[0].w, dot(to[1].xyz, x) + to[1].w, dot(to[2].xyz, x) + to[2].w);
  }
  posed[item] = (float4)(p, 0.0f);
}

// Posed places on another grid of the same lattice.
kernel void shift_posed(const float4 shift, const int node_count, global float4* posed) {
  const int node = get_global_id(0);
  if (node < node_count) posed[node] += shift;
}
