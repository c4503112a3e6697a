// A displacement on a lattice, trilinear, at every node of the stored bricks; one work-item per brick.
// Template voxels throughout; none in bones, which are rigid. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"

// Of the lattice's nodes at x, between the four rows around a row of template voxels.
typedef struct {
  global const float* rows[4];  // y and z below, y above, z above, both
  float y, z;                   // share of those above
} KvxRows;

static float3 between_rows(const KvxRows r, const int x) {
  return mix(mix(vload3(x, r.rows[0]), vload3(x, r.rows[1]), r.y),
             mix(vload3(x, r.rows[2]), vload3(x, r.rows[3]), r.y), r.z);
}

// `first`, `per_voxel`: template voxel of the lattice's first node, nodes per voxel: at most 1. `ranges`: per
// brick the least and the most that is added.
kernel void spread_added(const int stored, global const int4* first_nodes, global const float* lattice,
                         const int4 size, const int4 first, const float4 per_voxel,
                         global const ushort* labels, const int4 image, global float* added,
                         global float* ranges) {
  const int brick = get_global_id(0);
  if (brick >= stored) return;
  const int3 last = size.xyz - 1, corner = first_nodes[brick].xyz;
  float3 least = INFINITY, most = -INFINITY;
  for (int row = 0; row < KVX_NODES / 4; ++row) {
    const int3 node = corner + (int3)(0, row & 3, row >> 2), voxel = min(node, image.xyz - 1);
    const float3 at =
        clamp(convert_float3(node - first.xyz) * per_voxel.xyz, (float3)(0.0f), convert_float3(last));
    const int3 low = convert_int3(at), high = min(low + 1, last);
    KvxRows rows;
    for (int r = 0; r < 4; ++r)
      rows.rows[r] =
          lattice + 3 * ((size_t)(r & 2 ? high.z : low.z) * size.y + (r & 1 ? high.y : low.y)) * size.x;
    rows.y = at.y - convert_float(low.y), rows.z = at.z - convert_float(low.z);
    int x = low.x;
    float3 below = between_rows(rows, x), above = between_rows(rows, high.x);
    global const ushort* label = labels + ((size_t)voxel.z * image.y + voxel.y) * image.x;
    global float* out = added + (size_t)brick * KVX_BRICK_FLOATS + 4 * row;
    for (int n = 0; n < 4; ++n) {
      const float along =
          clamp(convert_float(corner.x + n - first.x) * per_voxel.x, 0.0f, convert_float(last.x));
      if (convert_int(along) > x) ++x, below = above, above = between_rows(rows, min(x + 1, last.x));
      const float3 d = label[min(corner.x + n, image.x - 1)] ? (float3)(0.0f)
                                                             : mix(below, above, along - convert_float(x));
      least = fmin(least, d), most = fmax(most, d);
      out[n] = d.x, out[n + KVX_NODES] = d.y, out[n + 2 * KVX_NODES] = d.z;
    }
  }
  vstore3(least, 2 * (size_t)brick, ranges);
  vstore3(most, 2 * (size_t)brick + 1, ranges);
}
