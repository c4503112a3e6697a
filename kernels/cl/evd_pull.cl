// Fills a posed grid tile by tile with what its voxels are in the template: intensities (trilinear or cubic), labels (the
// label with the greatest trilinear share), or the template place itself. `claimed`: a word per row
// of a tile, a bit per voxel that inner tissue claims, and above these one that any tissue does. CPU twin: kernels/reference/evd_pull.cpp.
#include "evd_bricks.cl.h"
#include "evd_pull.cl.h"
#include "evd_sample.cl.h"

#define TILE_ARGS                                                                                                       \
  global const int *list, global const int2 *ranges, global const KvxCell *cells, global const float4 *nodes, global const uint *tissue, \
      global const uint *tile_first, global const int *in_tile, const int4 tiles, const int4 size, global uint *claimed, local KvxTile *tile
#define CLAIM_TILE                                                                                                      \
  const int t = get_group_id(0);                                                                                        \
  const int3 corner = (int3)(t % tiles.x, t / tiles.x % tiles.y, t / tiles.x / tiles.y) * (int3)(TILE_X, 8, 8);         \
  const int3 extent = min(size.xyz - corner, (int3)(TILE_X, 8, 8));                                                     \
  const bool empty = tile_first[t] == tile_first[t + 1];                                                                \
  if (!empty) claim_tile(list, ranges, cells, nodes, tissue, tile_first[t], tile_first[t + 1], in_tile, corner, extent, tile);  \
  note_tissue(tile, empty, extent, claimed + TILE_ROWS * (size_t)t)
#define FOR_ROWS                                                                                                        \
  for (int row = get_local_id(0); row < TILE_ROWS; row += get_local_size(0)) {                                          \
    const int j = row & 7, k = row >> 3;                                                                                \
    if (j >= extent.y || k >= extent.z) continue;                                                                       \
    for (int eight = 0; 8 * eight < extent.x; ++eight) {                                                                   \
      const int at = 2 * row + eight, left = extent.x - 8 * eight;                                                        \
      const size_t voxel = ((size_t)(corner.z + k) * size.y + corner.y + j) * size.x + corner.x + 8 * eight;             \
      const bool nothing = empty || all(tile->claim[at] == KVX_UNCLAIMED);
#define END_ROWS \
  }              \
  }

static uint bits8(const int8 is_set) {
  const int8 bits = is_set & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
  const int4 four = bits.lo | bits.hi;
  return four.x | four.y | four.z | four.w;
}

static void note_tissue(local const KvxTile* tile, const bool empty, const int3 extent, global uint* claimed) {
  for (int row = get_local_id(0); row < TILE_ROWS; row += get_local_size(0)) {
    uint inner = 0, any_tissue = 0;
    for (int eight = 0; eight < 2 && !empty && (row & 7) < extent.y && (row >> 3) < extent.z; ++eight) {
      const int8 claim = tile->claim[2 * row + eight];
      const int8 is_tissue = claim != KVX_MARGIN && claim != KVX_UNCLAIMED;
      inner |= bits8(is_tissue && claim != KVX_RIM) << (8 * eight), any_tissue |= bits8(is_tissue) << (8 * eight);
    }
    const uint in_grid = (1u << extent.x) - 1;
    claimed[row] = (inner & in_grid) | (any_tissue & in_grid) << 16;
  }
}

static void store_floats(const float8 v, const int left, global float* out) {
  if (left >= 8) {
    vstore8(v, 0, out);
  } else {
    float some[8];
    vstore8(v, 0, some);
    for (int n = 0; n < left; ++n) out[n] = some[n];
  }
}

kernel void pull_intensities(TILE_ARGS, global const float* image, const int4 image_size, const int cubic, const float air,
                             global float* out) {
  CLAIM_TILE;
  FOR_ROWS
  float8 v = air;
  if (!nothing) {
    v = cubic ? kvx_cubic8(image, image_size, tile->x[at], tile->y[at], tile->z[at], tile->claim[at] != KVX_UNCLAIMED)
              : kvx_linear8(image, image_size, tile->x[at], tile->y[at], tile->z[at], tile->claim[at] != KVX_UNCLAIMED);
    v = select((float8)(air), v, kvx_inside8(image_size, tile->x[at], tile->y[at], tile->z[at], tile->claim[at]));
  }
  store_floats(v, left, out + voxel);
  END_ROWS
}

kernel void pull_labels(TILE_ARGS, global const ushort* labels, const int4 image_size, global ushort* out) {
  CLAIM_TILE;
  FOR_ROWS
  float x[8], y[8], z[8];
  int inside[8];
  if (!nothing) {
    vstore8(tile->x[at], 0, x), vstore8(tile->y[at], 0, y), vstore8(tile->z[at], 0, z);
    vstore8(kvx_inside8(image_size, tile->x[at], tile->y[at], tile->z[at], tile->claim[at]), 0, inside);
  }
  for (int n = 0; n < min(left, 8); ++n) {
    out[voxel + n] = nothing || !inside[n] ? 0 : kvx_majority(labels, image_size, (float3)(x[n], y[n], z[n]));
  }
  END_ROWS
}

// The template place in voxels, and what claims the voxel: x, y, z, claim.
kernel void pull_places(TILE_ARGS, global float4* out) {
  CLAIM_TILE;
  FOR_ROWS
  float x[8], y[8], z[8];
  int claim[8];
  if (!nothing) {
    vstore8(tile->x[at], 0, x), vstore8(tile->y[at], 0, y), vstore8(tile->z[at], 0, z), vstore8(tile->claim[at], 0, claim);
  }
  for (int n = 0; n < min(left, 8); ++n) {
    const bool none = nothing || claim[n] == KVX_UNCLAIMED;
    out[voxel + n] = none ? (float4)(NAN, NAN, NAN, KVX_UNCLAIMED) : (float4)(x[n], y[n], z[n], claim[n]);
  }
  END_ROWS
}
