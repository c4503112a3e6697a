// Scan conversion of the posed template cells into an owner volume. Smooth bricks are one cell, others 64 unit cells.
// The smallest owner wins (atomic_min), so the result does not depend on the order. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"
#define SMOOTH_VOXELS 0.25f   // largest error, in posed voxels, of treating a brick as one linear cell
#define GROW_WHOLE 0.35f      // cells grow by this many template voxels, so that no gap opens towards finer neighbours
#define GROW_UNIT 0.02f       // against rounding
#define MIN_RATIO 0.02f       // volume ratios outside are no tissue
#define MAX_RATIO 20.0f
#define MAX_STRETCH 4.0f      // of an edge that touches air: beyond it, two parts drew away from each other

static bool whole_cell_is_smooth(global const int* brick_at, const int4 bricks, global const float4* posed, const int3 base,
                                 const float volume_ratio) {
  KvxTet tets[KVX_TETS];
  for (int tet = 0; tet < KVX_TETS; ++tet) {
    tets[tet] = kvx_tet(brick_at, bricks, posed, base, 4, tet);
    const float ratio = tets[tet].det * volume_ratio;
    if (!(ratio > 4 * MIN_RATIO && ratio < MAX_RATIO / 4)) return false;
  }
  for (int n = 1; n < 124; ++n) {
    const int3 f = (int3)(n % 5, (n / 5) % 5, n / 25);
    // the tetrahedron that holds the node: its coordinates in falling order along the path
    const int tet = f.x >= f.y ? (f.y >= f.z ? 0 : f.x >= f.z ? 3 : 2) : (f.x >= f.z ? 5 : f.y >= f.z ? 1 : 4);
    const KvxTet t = tets[tet];
    const int fa = t.a == 0 ? f.x : t.a == 1 ? f.y : f.z, fb = t.b == 0 ? f.x : t.b == 1 ? f.y : f.z;
    const int fc = t.c == 0 ? f.x : t.c == 1 ? f.y : f.z;
    const float3 linear_place = t.start + (float)fa * t.e0 + (float)fb * t.e1 + (float)fc * t.e2;
    const float3 error = kvx_posed(brick_at, bricks, posed, base + f) - linear_place;
    if (!(dot(error, error) < SMOOTH_VOXELS * SMOOTH_VOXELS)) return false;
  }
  return true;
}

// Per brick with cells: is it smooth, how many of its body cells are inside out, and the box of its posed body nodes.
kernel void classify_bricks(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                            global const float4* posed, global const ulong* body, const float volume_ratio,
                            global uchar* smooth, global int* folded, global float4* box) {
  const int brick = get_global_id(0);
  if (brick >= bricks.w) return;
  const int3 base = first_nodes[brick].xyz;
  const bool is_smooth = whole_cell_is_smooth(brick_at, bricks, posed, base, volume_ratio);
  float3 lo = INFINITY, hi = -INFINITY;
  int inside_out = 0;
  for (int n = 0; n < KVX_NODES; ++n) {
    if (!((body[brick] >> n) & 1)) continue;
    const float3 p = posed[(size_t)brick * KVX_NODES + n].xyz;
    lo = fmin(lo, p), hi = fmax(hi, p);
    if (is_smooth) continue;
    const int3 node = base + (int3)(n & 3, (n >> 2) & 3, n >> 4);
    bool closed = true, turned = false;
    for (int corner = 1; corner < 8; ++corner) {
      closed = closed && kvx_bit(brick_at, bricks, body, node + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2));
    }
    for (int tet = 0; closed && tet < KVX_TETS; ++tet) {
      turned = turned || !(kvx_tet(brick_at, bricks, posed, node, 1, tet).det * volume_ratio > 0.0f);
    }
    inside_out += turned;
  }
  smooth[brick] = is_smooth;
  folded[brick] = inside_out;
  box[2 * brick] = (float4)(lo, 0.0f);
  box[2 * brick + 1] = (float4)(hi, 0.0f);
}

// Narrows [lo, hi] to where at + slope * x >= -grow.
static void clip(const float at, const float slope, const float grow, float* lo, float* hi) {
  if (fabs(slope) < 1e-9f) {
    if (at < -grow) *hi = *lo - 1.0f;
  } else {
    const float x = (-grow - at) / slope;
    if (slope > 0.0f) *lo = fmax(*lo, x);
    else *hi = fmin(*hi, x);
  }
}

static void claim(volatile global uint* owner, const uint key) {
  if (*owner > key) atomic_min(owner, key);
}

static float stretch_of(const KvxTet t, const float4 posed_mm, const float4 template_mm) {
  const float s[3] = {template_mm.x, template_mm.y, template_mm.z};
  const float a = length(t.e0 * posed_mm.xyz) / s[t.a], b = length(t.e1 * posed_mm.xyz) / s[t.b];
  return fmax(fmax(a, b), length(t.e2 * posed_mm.xyz) / s[t.c]);
}

static void rasterise_one(const KvxTet t, const uint id, const bool all_body, const bool inverted, const float grow,
                          global const int* brick_at, const int4 bricks, global const ulong* body,
                          global const ulong* carried, const int4 size, volatile global uint* owner) {
  const float s = t.step;
  const float3 v1 = t.start + s * t.e0, v2 = v1 + s * t.e1, v3 = v2 + s * t.e2;
  const float3 pad = grow * (fabs(t.e0) + fabs(t.e1) + fabs(t.e2));
  const int3 lo = max(convert_int3(ceil(fmin(fmin(t.start, v1), fmin(v2, v3)) - pad)), (int3)(0));
  const int3 hi = min(convert_int3(floor(fmax(fmax(t.start, v1), fmax(v2, v3)) + pad)), size.xyz - 1);
  for (int z = lo.z; z <= hi.z; ++z) {
    for (int y = lo.y; y <= hi.y; ++y) {
      const float3 g = kvx_path_place(t, (float3)(0.0f, y, z));
      float x0 = lo.x, x1 = hi.x;
      clip(s - g.x, -t.q0.x, grow, &x0, &x1);
      clip(g.x - g.y, t.q0.x - t.q1.x, grow, &x0, &x1);
      clip(g.y - g.z, t.q1.x - t.q2.x, grow, &x0, &x1);
      clip(g.z, t.q2.x, grow, &x0, &x1);
      const size_t row = ((size_t)z * size.y + y) * size.x;
      for (int x = (int)ceil(x0); x <= x1; ++x) {
        uint kind = inverted ? KVX_INVERTED : KVX_BODY;
        if (!all_body) {
          const float3 at = g + (float)x * (float3)(t.q0.x, t.q1.x, t.q2.x);
          const int3 node = convert_int3_rte(kvx_template_place(t, at));
          if (!kvx_bit(brick_at, bricks, body, node)) {
            if (inverted || !kvx_bit(brick_at, bricks, carried, node)) continue;
            kind = KVX_MARGIN;
          }
        }
        claim(owner + row + x, (kind << KVX_CLASS_SHIFT) | id);
      }
    }
  }
}

// One work-item per unit cell of every brick with cells; the first six of a smooth brick take its six whole tetrahedra.
// `closed`: 1 where all 125 nodes of the brick are body.
kernel void rasterise_tetrahedra(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                                 global const float4* posed, global const ulong* body, global const ulong* carried,
                                 global const uchar* closed, global const uchar* smooth, const float volume_ratio,
                                 const float4 posed_mm, const float4 template_mm, const int4 size,
                                 volatile global uint* owner) {
  const int brick = get_global_id(0) / KVX_NODES, n = get_global_id(0) % KVX_NODES;
  if (brick >= bricks.w) return;
  const bool whole = smooth[brick];
  if (whole && n >= KVX_TETS) return;
  const int3 base = first_nodes[brick].xyz + (whole ? (int3)(0) : (int3)(n & 3, (n >> 2) & 3, n >> 4));
  bool all_body = closed[brick], any_carried = all_body || whole;
  if (!all_body && !whole) {
    all_body = true;
    for (int corner = 0; corner < 8; ++corner) {
      const int3 node = base + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
      all_body = all_body && kvx_bit(brick_at, bricks, body, node);
      any_carried = any_carried || kvx_bit(brick_at, bricks, carried, node);
    }
  }
  if (!any_carried) return;
  for (int tet = whole ? n : 0; tet < (whole ? n + 1 : KVX_TETS); ++tet) {
    const KvxTet t = kvx_tet(brick_at, bricks, posed, base, whole ? 4 : 1, tet);
    const float ratio = t.det * volume_ratio;
    if (!(fabs(ratio) > MIN_RATIO && fabs(ratio) < MAX_RATIO)) continue;
    if (!all_body && !whole && stretch_of(t, posed_mm, template_mm) > MAX_STRETCH) continue;
    const uint id = ((uint)brick * KVX_SLOTS + (whole ? 0 : 1 + n)) * KVX_TETS + tet;
    rasterise_one(t, id, all_body, ratio < 0.0f, whole ? GROW_WHOLE : GROW_UNIT, brick_at, bricks, body, carried, size, owner);
  }
}
