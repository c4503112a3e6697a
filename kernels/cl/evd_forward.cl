// Eq. 6 at every node of the listed bricks: M(v) (v + a(v) + sum_k c_k(v) d_k(v)), c_k(v) = sum_j w_j(v) c_jk;
// one work-item per brick, sixteen nodes at a time. Voxel coordinates throughout: template voxels in, posed
// voxels out. Bone j: 3 rows of posed_from_template, then the real and dual part of its unit dual quaternion
// in centred mm. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"
#include "inline.cl.h"

// Whether a blend of the brick's bones may near the singular.
static bool needs_guard(global const uchar* palette, const int bones_here, global const float4* bones) {
  for (int a = 1; a < bones_here; ++a) {
    for (int b = 0; b < a; ++b) {
      const float4 one = bones[KVX_BONE_ROWS * palette[a] + 3], other = bones[KVX_BONE_ROWS * palette[b] + 3];
      if (!(fabs(dot(one, other)) > KVX_SAFE_COSINE)) return true;
    }
  }
  return false;
}

// The linear blend's share at sixteen nodes (LinearShare in core/blend.h): 0 where the matrix that the bones
// blend to leaves less than singular_regular.x of the template's volume, 1 from singular_regular.y on.
KVX_INLINE float16 linear_share(global const uchar* palette, const int bones_here, global const float* w,
                                global const float4* bones, const float volume_ratio,
                                const float2 singular_regular) {
  float16 row[3][3] = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
  for (int p = 0; p < bones_here; ++p) {
    const float16 part = vload16(0, w + p * KVX_NODES);
    for (int r = 0; r < 3; ++r) {
      const float4 of_bone = bones[KVX_BONE_ROWS * palette[p] + r];
      row[r][0] += part * of_bone.x, row[r][1] += part * of_bone.y, row[r][2] += part * of_bone.z;
    }
  }
  const float16 determinant =
      (row[0][0] * (row[1][1] * row[2][2] - row[1][2] * row[2][1]) +
       row[0][1] * (row[1][2] * row[2][0] - row[1][0] * row[2][2]) +
       row[0][2] * (row[1][0] * row[2][1] - row[1][1] * row[2][0])) *
      volume_ratio;
  const float16 t =
      clamp((determinant - singular_regular.x) / (singular_regular.y - singular_regular.x), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// The blend of the bones at one node by dual quaternions (core/blend.h).
static float3 guarded_place(global const uchar* palette, const int bones_here, global const float* w,
                            global const float4* bones, global const float4* frames, const float3 v) {
  int most = 0;
  for (int p = 1; p < bones_here; ++p) most = w[p * KVX_NODES] > w[most * KVX_NODES] ? p : most;
  const float4 pivot = bones[KVX_BONE_ROWS * palette[most] + 3];
  float4 real = 0.0f, dual = 0.0f;
  for (int p = 0; p < bones_here; ++p) {
    const float4 q = bones[KVX_BONE_ROWS * palette[p] + 3];
    const float signed_weight = dot(pivot, q) < 0.0f ? -w[p * KVX_NODES] : w[p * KVX_NODES];
    real += signed_weight * q;
    dual += signed_weight * bones[KVX_BONE_ROWS * palette[p] + 4];
  }
  const float norm = length(real);
  if (norm < 1e-6f)
    real = pivot, dual = bones[KVX_BONE_ROWS * palette[most] + 4];
  else
    real /= norm, dual /= norm;
  const float3 y = (float3)(dot(frames[0].xyz, v) + frames[0].w, dot(frames[1].xyz, v) + frames[1].w,
                            dot(frames[2].xyz, v) + frames[2].w);
  const float3 shift = 2.0f * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
  const float3 x = y + 2.0f * cross(real.xyz, cross(real.xyz, y) + real.w * y) + shift;
  return (float3)(dot(frames[3].xyz, x) + frames[3].w, dot(frames[4].xyz, x) + frames[4].w,
                  dot(frames[5].xyz, x) + frames[5].w);
}

KVX_INLINE float least(const float16 v) {
  const float8 a = fmin(v.lo, v.hi);
  const float4 b = fmin(a.lo, a.hi);
  return fmin(fmin(b.x, b.y), fmin(b.z, b.w));
}

// `added`: what is displaced beyond the examples, where `adds`. `body_boxes`: least and greatest posed body node
// of each listed brick; least above greatest where there is none.
kernel void evd_forward(global const int* list, const int count, global const int4* first_nodes,
                        global const uint* palette_first, global const uchar* palettes,
                        global const float* weights, global const uint* example_first,
                        global const int2* example_refs, global const short* examples,
                        global const float* coefficients, const int used_examples, global const float* added,
                        const int adds, global const float4* bones, global const float4* frames,
                        const float volume_ratio, const float2 singular_regular, global const ulong* body,
                        global float* posed, global float4* body_boxes) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[item];
  const int bones_here = palette_first[brick + 1] - palette_first[brick];
  global const uchar* palette = palettes + palette_first[brick];
  global const float* brick_weights = weights + (size_t)palette_first[brick] * KVX_NODES;
  const bool guard = needs_guard(palette, bones_here, bones);
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  float16 low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (int z = 0; z < 4; ++z) {
    float16 x = convert_float16(first_nodes[brick].x + (lane & 3)),
            y = convert_float16(first_nodes[brick].y + (lane >> 2));
    float16 s = first_nodes[brick].z + z;
    global const float* w = brick_weights + 16 * z;
    if (adds) {
      global const float* d = added + (size_t)brick * KVX_BRICK_FLOATS + 16 * z;
      x += vload16(0, d), y += vload16(0, d + KVX_NODES), s += vload16(0, d + 2 * KVX_NODES);
    }
    for (uint e = used_examples ? example_first[brick] : 0;
         e < (used_examples ? example_first[brick + 1] : 0); ++e) {
      const int2 ref = example_refs[e];
      float16 c = 0.0f;
      bool moves = false;
      for (int p = 0; p < bones_here; ++p) {
        const float share = coefficients[palette[p] * used_examples + ref.x];
        moves = moves || share != 0.0f;
        c += share * vload16(0, w + p * KVX_NODES);
      }
      if (!moves) continue;
      c *= as_float(ref.y);
      global const short* d = examples + (size_t)e * KVX_BRICK_FLOATS + 16 * z;
      x += c * convert_float16(vload16(0, d));
      y += c * convert_float16(vload16(0, d + KVX_NODES));
      s += c * convert_float16(vload16(0, d + 2 * KVX_NODES));
    }
    float16 place[3] = {0.0f, 0.0f, 0.0f};
    for (int p = 0; p < bones_here; ++p) {
      const float16 part = vload16(0, w + p * KVX_NODES);
      global const float4* rows = bones + KVX_BONE_ROWS * palette[p];
      for (int r = 0; r < 3; ++r)
        place[r] += part * (rows[r].x * x + (rows[r].y * y + (rows[r].z * s + rows[r].w)));
    }
    global float* out = posed + (size_t)brick * KVX_BRICK_FLOATS + 16 * z;
    for (int r = 0; r < 3; ++r) vstore16(place[r], 0, out + r * KVX_NODES);
    if (guard) {
      float vx[16], vy[16], vz[16], linear[16];
      vstore16(x, 0, vx), vstore16(y, 0, vy), vstore16(s, 0, vz);
      vstore16(linear_share(palette, bones_here, w, bones, volume_ratio, singular_regular), 0, linear);
      for (int n = 0; n < 16; ++n) {
        if (linear[n] == 1.0f) continue;
        const float3 guarded =
            guarded_place(palette, bones_here, w + n, bones, frames, (float3)(vx[n], vy[n], vz[n]));
        out[n] = mix(guarded.x, out[n], linear[n]);
        out[n + KVX_NODES] = mix(guarded.y, out[n + KVX_NODES], linear[n]);
        out[n + 2 * KVX_NODES] = mix(guarded.z, out[n + 2 * KVX_NODES], linear[n]);
      }
      for (int r = 0; r < 3; ++r) place[r] = vload16(0, out + r * KVX_NODES);
    }
    const int16 is_body = ((int16)((int)(body[brick] >> (16 * z)) & 0xFFFF) >> lane) << 31;
    for (int r = 0; r < 3; ++r) {
      low[r] = fmin(low[r], select((float16)(INFINITY), place[r], is_body));
      high[r] = fmax(high[r], select((float16)(-INFINITY), place[r], is_body));
    }
  }
  body_boxes[2 * item] = (float4)(least(low[0]), least(low[1]), least(low[2]), 0.0f);
  body_boxes[2 * item + 1] = (float4)(-least(-high[0]), -least(-high[1]), -least(-high[2]), 0.0f);
}
