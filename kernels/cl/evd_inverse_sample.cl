// Posed voxel -> template voxel by the owner's tetrahedron and Newton steps against the trilinear forward map, then the
// template's value there; one work-item per posed voxel. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"
#include "grid.cl.h"
#define NEWTON_STEPS 4
#define CLOSE_ENOUGH 1e-6f    // squared posed voxels
#define ONE_STEP_LEFT 4e-3f   // squared posed voxels: a Newton step from here ends close enough, unseen
#define REJECTED 0.09f        // squared posed voxels: no preimage was found here
#define BORDER 0.01f          // template voxels by which rounding may leave the hull of voxel centres

// Forward map and its derivatives at a template place; false where no cell is stored.
static bool forward_at(global const int* brick_at, const int4 bricks, global const float4* posed, const float3 v, float3* p,
                       float3* dx, float3* dy, float3* dz) {
  const int3 n = convert_int3(floor(v));
  const int brick = kvx_brick(brick_at, bricks, n);
  if (brick < 0 || brick >= bricks.w) return false;
  const float3 f = v - convert_float3(n);
  float3 c[8];
  if (all((n & 3) < 3)) {
    global const float4* at = posed + (size_t)brick * KVX_NODES + kvx_slot(n);
    for (int i = 0; i < 8; ++i) c[i] = at[(i & 1) + ((i & 2) << 1) + ((i & 4) << 2)].xyz;
  } else {
    for (int i = 0; i < 8; ++i) c[i] = kvx_posed(brick_at, bricks, posed, n + (int3)(i & 1, (i >> 1) & 1, i >> 2));
  }
  const float3 x00 = c[1] - c[0], x10 = c[3] - c[2], x01 = c[5] - c[4], x11 = c[7] - c[6];
  const float3 a00 = c[0] + f.x * x00, a10 = c[2] + f.x * x10, a01 = c[4] + f.x * x01, a11 = c[6] + f.x * x11;
  const float3 b0 = a00 + f.y * (a10 - a00), b1 = a01 + f.y * (a11 - a01);
  *p = b0 + f.z * (b1 - b0);
  *dx = mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
  *dy = mix(a10 - a00, a11 - a01, f.z);
  *dz = b1 - b0;
  return true;
}

// Newton from *v towards the place that lands on p; leaves the best place in *v and returns its squared error.
static float refine(global const int* brick_at, const int4 bricks, global const float4* posed, const float3 p, float3* v) {
  float3 at, dx, dy, dz, place = *v;
  float best = INFINITY;
  for (int step = 0; step <= NEWTON_STEPS; ++step) {
    if (!forward_at(brick_at, bricks, posed, place, &at, &dx, &dy, &dz)) break;
    const float3 r = p - at;
    const float error = dot(r, r);
    if (error < best) best = error, *v = place;
    if (best < CLOSE_ENOUGH) break;
    const float3 c = cross(dy, dz);
    const float det = dot(dx, c);
    if (fabs(det) < 1e-4f) break;
    const float3 move = (float3)(dot(c, r), dot(cross(dz, dx), r), dot(cross(dx, dy), r)) / det;
    place += move * fmin(1.0f, 1.5f / length(move));
    if (error < ONE_STEP_LEFT && error == best) {
      *v = place;
      break;
    }
  }
  return best;
}

static float3 guess_by(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                       global const float4* posed, const uint owner, const float3 p) {
  const uint id = owner & ((1u << KVX_CLASS_SHIFT) - 1);
  const int tet = id % KVX_TETS, slot = (id / KVX_TETS) % KVX_SLOTS, brick = id / (KVX_TETS * KVX_SLOTS), n = slot - 1;
  const int3 base = first_nodes[brick].xyz + (slot == 0 ? (int3)(0) : (int3)(n & 3, (n >> 2) & 3, n >> 4));
  const KvxTet t = kvx_tet(brick_at, bricks, posed, base, slot == 0 ? 4 : 1, tet);
  return kvx_template_place(t, kvx_path_place(t, p));
}

// The smallest owner among the six neighbours: a voxel that every cell missed by rounding, or beside a culled cell.
static uint neighbour_owner(global const uint* owner, const int4 size, const int3 p) {
  const size_t at = ((size_t)p.z * size.y + p.y) * size.x + p.x, slice = (size_t)size.x * size.y;
  uint least = KVX_NONE;
  if (p.x > 0) least = min(least, owner[at - 1]);
  if (p.y > 0) least = min(least, owner[at - size.x]);
  if (p.z > 0) least = min(least, owner[at - slice]);
  if (p.x + 1 < size.x) least = min(least, owner[at + 1]);
  if (p.y + 1 < size.y) least = min(least, owner[at + size.x]);
  if (p.z + 1 < size.z) least = min(least, owner[at + slice]);
  return least;
}

// The template place that lands on posed voxel p; false where nothing does.
static bool invert(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                   global const float4* posed, global const ulong* carried, global const uint* owner, const int4 size,
                   const int3 p, float3* v) {
  const uint own = owner[((size_t)p.z * size.y + p.y) * size.x + p.x];
  const uint key = own != KVX_NONE ? own : neighbour_owner(owner, size, p);
  if (own == KVX_NONE && (key >> KVX_CLASS_SHIFT) != KVX_BODY) return false;
  const float3 target = convert_float3(p);
  const float3 guess = guess_by(brick_at, bricks, first_nodes, posed, key, target);
  *v = guess;
  const float error = refine(brick_at, bricks, posed, target, v);
  if (!(error < REJECTED)) {
    if (own == KVX_NONE) return false;
    *v = guess;
  }
  return kvx_bit(brick_at, bricks, carried, convert_int3_rte(*v));
}

kernel void sample_intensities(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                               global const float4* posed, global const ulong* carried, global const uint* owner,
                               const int4 size, global const float* image, const int4 image_size, const float air,
                               global float* out) {
  const int3 p = (int3)(get_global_id(0), get_global_id(1), get_global_id(2));
  if (any(p >= size.xyz)) return;
  float3 v;
  float value = air;
  if (invert(brick_at, bricks, first_nodes, posed, carried, owner, size, p, &v)) {
    const float3 top = convert_float3(image_size.xyz - 1);
    const float3 inside = clamp(v, (float3)(0.0f), top);
    if (all(fabs(inside - v) < BORDER)) value = kvx_sample(image, image_size, inside, air);
  }
  out[((size_t)p.z * size.y + p.y) * size.x + p.x] = value;
}

kernel void sample_labels(global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                          global const float4* posed, global const ulong* carried, global const uint* owner,
                          const int4 size, global const ushort* labels, const int4 image_size, global ushort* out) {
  const int3 p = (int3)(get_global_id(0), get_global_id(1), get_global_id(2));
  if (any(p >= size.xyz)) return;
  float3 v;
  ushort value = 0;
  if (invert(brick_at, bricks, first_nodes, posed, carried, owner, size, p, &v)) {
    const int3 n = convert_int3_rte(v);
    if (all(n >= 0) && all(n < image_size.xyz)) value = labels[((size_t)n.z * image_size.y + n.y) * image_size.x + n.x];
  }
  out[((size_t)p.z * size.y + p.y) * size.x + p.x] = value;
}
