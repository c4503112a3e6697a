// Fills a posed grid tile by tile with what its voxels are in the template: intensities (trilinear or cubic),
// labels (the one that prevails by its trilinear share), or the template place itself. `claimed`: a word per
// row of a tile, a bit per voxel that inner tissue claims, and above these one that any tissue does. CPU
// twins: kernels/reference/evd_pull.cpp (places), evd_shown.cpp (what is there).
#include "inline.cl.h"
#include "evd_bricks.cl.h"
#include "evd_wide.cl.h"
#include "evd_sample.cl.h"
#include "evd_tile.cl.h"
#include "evd_border.cl.h"
#include "evd_pull.cl.h"

#define TILE_ARGS                                                                              \
  global const int *list, global const KvxBrickCells *found, global const KvxCell *cells,      \
      global const KvxChunk *chunks, global const uint *tissue, global const uint *tile_first, \
      global const int *in_tile, global const int *bone_cells, const int4 bone_size,        \
      global const float4 *bones_back, const int4 tiles, const int4 size, global uint *claimed, \
      local KvxTile *tile
#define CLAIM_TILE                                                                                       \
  const int t = get_group_id(0);                                                                         \
  const int3 corner =                                                                                    \
      (int3)(t % tiles.x, t / tiles.x % tiles.y, t / tiles.x / tiles.y) * (int3)(TILE_X, 8, 8);          \
  const int3 extent = min(size.xyz - corner, (int3)(TILE_X, 8, 8));                                      \
  const bool empty = tile_first[t] == tile_first[t + 1];                                                 \
  const KvxBones bones = {bone_cells, bone_size, bones_back};                                            \
  if (!empty)                                                                                            \
    claim_tile(list, found, cells, chunks, tissue, tile_first[t], tile_first[t + 1], in_tile, t, corner, \
               extent, &bones, tile);                                                                    \
  barrier(CLK_LOCAL_MEM_FENCE); /* rows are noted by others than who claimed them */                     \
  note_tissue(tile, empty, extent, claimed + TILE_ROWS * (size_t)t)
// For every block of the tile: its first voxel, from which `left` voxels lie in the grid; `nothing` claims
// it.
#define FOR_BLOCKS                                                                                   \
  for (int at = get_local_id(0); at < TILE_BLOCKS; at += get_local_size(0)) {                        \
    const int3 first = corner + 2 * (int3)(at & 7, (at >> 3) & 3, at >> 5), left = size.xyz - first; \
    if (left.x <= 0 || left.y <= 0 || left.z <= 0) continue;                                         \
    const size_t voxel = ((size_t)first.z * size.y + first.y) * size.x + first.x;                    \
    const bool nothing = empty || !some8(vload8(at, tile->claim) != KVX_UNCLAIMED);
#define END_BLOCKS }

// Where voxel n of a block lies from its first one.
static size_t voxel_of_block(const int4 size, const int n) {
  return ((size_t)(n >> 2) * size.y + ((n >> 1) & 1)) * size.x + (n & 1);
}
static bool in_grid(const int3 left, const int n) {
  return (n & 1) < left.x && ((n >> 1) & 1) < left.y && (n >> 2) < left.z;
}

// Two bits for each of the four rows of a block.
static uint4 bits_of_rows(const int8 is_set) {
  const int8 bits = is_set & (int8)(1, 2, 1, 2, 1, 2, 1, 2);
  return as_uint4(bits.even | bits.odd);
}

static void note_tissue(local const KvxTile* tile, const bool empty, const int3 extent,
                        global uint* claimed) {
  for (int pair = get_local_id(0); pair < TILE_ROWS / 4; pair += get_local_size(0)) {
    uint4 inner = 0, any_tissue = 0;
    for (int i = 0; i < 8 && !empty; ++i) {
      const int8 claim = vload8(8 * pair + i, tile->claim);
      const int8 is_tissue = claim != KVX_MARGIN && claim != KVX_UNCLAIMED;
      inner |= bits_of_rows(is_tissue && claim != KVX_RIM) << (uint)(2 * i),
          any_tissue |= bits_of_rows(is_tissue) << (uint)(2 * i);
    }
    const uint in_grid = (1u << extent.x) - 1;
    const uint4 words = (inner & in_grid) | (any_tissue & in_grid) << 16;
    const int j = 2 * (pair & 3), k = 2 * (pair >> 2);
    const bool y = j + 1 < extent.y, z = k + 1 < extent.z, here = j < extent.y && k < extent.z;
    claimed[8 * k + j] = here ? words.s0 : 0, claimed[8 * k + j + 1] = here && y ? words.s1 : 0;
    claimed[8 * k + 8 + j] = here && z ? words.s2 : 0,
                        claimed[8 * k + 8 + j + 1] = here && y && z ? words.s3 : 0;
  }
}

static void store_floats(const float8 v, const int4 size, const int3 left, global float* out) {
  if (left.x >= 2 && left.y >= 2 && left.z >= 2) {
    const size_t row = size.x, layer = (size_t)size.x * size.y;
    vstore2(v.s01, 0, out), vstore2(v.s23, 0, out + row), vstore2(v.s45, 0, out + layer),
        vstore2(v.s67, 0, out + layer + row);
  } else {
    float some[8];
    vstore8(v, 0, some);
    for (int n = 0; n < 8; ++n)
      if (in_grid(left, n)) out[voxel_of_block(size, n)] = some[n];
  }
}

static void fill_rows(const float air, const int4 size, const int3 corner, const int3 extent,
                      global float* out) {
  for (int row = get_local_id(0); row < TILE_ROWS; row += get_local_size(0)) {
    const int3 first = corner + (int3)(0, row & 7, row >> 3);
    if (first.y >= size.y || first.z >= size.z) continue;
    global float* at = out + ((size_t)first.z * size.y + first.y) * size.x + first.x;
    if (extent.x == TILE_X) {
      vstore16((float16)(air), 0, at);
    } else {
      for (int i = 0; i < extent.x; ++i) at[i] = air;
    }
  }
}

kernel void pull_intensities(TILE_ARGS, global const float* image, const int4 image_size, const int cubic,
                             const float air, global float* out) {
  CLAIM_TILE;
  if (empty) {
    fill_rows(air, size, corner, extent, out);
    return;
  }
  FOR_BLOCKS
  float8 v = air;
  if (!nothing) {
    v = cubic ? kvx_cubic8(image, image_size, vload8(at, tile->x), vload8(at, tile->y), vload8(at, tile->z),
                           vload8(at, tile->claim) != KVX_UNCLAIMED)
              : kvx_linear8(image, image_size, vload8(at, tile->x), vload8(at, tile->y), vload8(at, tile->z),
                            vload8(at, tile->claim) != KVX_UNCLAIMED);
    v = select((float8)(air), v,
               kvx_inside8(image_size, vload8(at, tile->x), vload8(at, tile->y), vload8(at, tile->z),
                           vload8(at, tile->claim)));
  }
  store_floats(v, size, left, out + voxel);
  END_BLOCKS
}

kernel void pull_labels(TILE_ARGS, global const ushort* labels, const int4 image_size,
                        global const float* levels, global ushort* out) {
  CLAIM_TILE;
  FOR_BLOCKS
  float x[8], y[8], z[8];
  int inside[8];
  if (!nothing) {
    vstore8(vload8(at, tile->x), 0, x), vstore8(vload8(at, tile->y), 0, y),
        vstore8(vload8(at, tile->z), 0, z);
    vstore8(kvx_inside8(image_size, vload8(at, tile->x), vload8(at, tile->y), vload8(at, tile->z),
                        vload8(at, tile->claim)),
            0, inside);
  }
  for (int n = 0; n < 8; ++n) {
    if (!in_grid(left, n)) continue;
    out[voxel + voxel_of_block(size, n)] =
        nothing || !inside[n] ? 0 : kvx_prevailing(labels, image_size, levels, (float3)(x[n], y[n], z[n]));
  }
  END_BLOCKS
}

// The template place in voxels, and what claims the voxel: x, y, z, claim.
kernel void pull_places(TILE_ARGS, global float4* out) {
  CLAIM_TILE;
  FOR_BLOCKS
  float x[8], y[8], z[8];
  int claim[8];
  if (!nothing) {
    vstore8(vload8(at, tile->x), 0, x), vstore8(vload8(at, tile->y), 0, y),
        vstore8(vload8(at, tile->z), 0, z), vstore8(vload8(at, tile->claim), 0, claim);
  }
  for (int n = 0; n < 8; ++n) {
    if (!in_grid(left, n)) continue;
    const bool none = nothing || claim[n] == KVX_UNCLAIMED;
    out[voxel + voxel_of_block(size, n)] =
        none ? (float4)(NAN, NAN, NAN, KVX_UNCLAIMED) : (float4)(x[n], y[n], z[n], claim[n]);
  }
  END_BLOCKS
}
