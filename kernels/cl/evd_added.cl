// A displacement on a lattice, trilinear, at every node of the stored bricks; one work-item per brick.
// Template voxels throughout; none in bones, which are rigid. CPU twin: kernels/reference/evd.cpp.
#include "evd_bricks.cl.h"

static float3 node_of(global const float* lattice, const int4 size, const int x, const int y, const int z) {
  return vload3(((size_t)z * size.y + y) * size.x + x, lattice);
}

// `first`, `step`: template voxel of the lattice's first node, voxels from node to node. `ranges`: per brick
// the least and the most that is added.
kernel void spread_added(const int stored, global const int4* first_nodes, global const float* lattice,
                         const int4 size, const int4 first, const int4 step, global const ushort* labels,
                         const int4 image, global float* added, global float* ranges) {
  const int brick = get_global_id(0);
  if (brick >= stored) return;
  const int3 last = size.xyz - 1;
  global float* out = added + (size_t)brick * KVX_BRICK_FLOATS;
  float3 least = INFINITY, most = -INFINITY;
  for (int n = 0; n < KVX_NODES; ++n) {
    const int3 node = first_nodes[brick].xyz + (int3)(n & 3, (n >> 2) & 3, n >> 4);
    const int3 voxel = min(node, image.xyz - 1);
    float3 d = 0.0f;
    if (!labels[((size_t)voxel.z * image.y + voxel.y) * image.x + voxel.x]) {
      const float3 at = clamp(convert_float3(node - first.xyz) / convert_float3(step.xyz), (float3)(0.0f),
                              convert_float3(last));
      const int3 lo = convert_int3(at), hi = min(lo + 1, last);
      const float3 f = at - convert_float3(lo);
      const float3 lower = mix(mix(node_of(lattice, size, lo.x, lo.y, lo.z),
                                   node_of(lattice, size, hi.x, lo.y, lo.z), f.x),
                               mix(node_of(lattice, size, lo.x, hi.y, lo.z),
                                   node_of(lattice, size, hi.x, hi.y, lo.z), f.x),
                               f.y),
                   upper = mix(mix(node_of(lattice, size, lo.x, lo.y, hi.z),
                                   node_of(lattice, size, hi.x, lo.y, hi.z), f.x),
                               mix(node_of(lattice, size, lo.x, hi.y, hi.z),
                                   node_of(lattice, size, hi.x, hi.y, hi.z), f.x),
                               f.y);
      d = mix(lower, upper, f.z);
    }
    least = fmin(least, d), most = fmax(most, d);
    out[n] = d.x, out[n + KVX_NODES] = d.y, out[n + 2 * KVX_NODES] = d.z;
  }
  vstore3(least, 2 * (size_t)brick, ranges);
  vstore3(most, 2 * (size_t)brick + 1, ranges);
}
