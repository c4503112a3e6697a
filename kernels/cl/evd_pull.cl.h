// Finds the template place of every voxel of a tile of posed voxels: the tile's bricks, in order, claim the
// voxels they hold. One work-group per tile; each work-item keeps to its own pairs of blocks of 2 x 2 x 2
// voxels, side by side along x: a cell is compact, so few of the voxels looked at are not its own.
#define UNSETTLED 0.025f  // of a brick's edge: a greater last step finds nothing
#define CLAIM_SHIFT 28
#define BRICK_SHIFT 6

// What a cell asks of every pair: how its voxels differ from the middle, and how far the middle may lie out
// of the cell.
typedef struct {
  float16 x, y, z;
  float far_x, far_y, far_z, reach;
} KvxLanes;

// 0 or 1 per voxel: a bit of the brick's nodes.
KVX_INLINE int16 tissue16(global const uint* words, const int16 bit) {
  const int16 word = bit >> 5;
  int16 w = select((int16)(words[0]), (int16)(words[1]), word == 1);
  w = select(w, (int16)(words[2]), word == 2);
  w = select(w, (int16)(words[3]), word == 3);
  return (w >> (bit & 31)) & 1;
}

// What the cell's tissue at h claims.
KVX_INLINE int16 claims16(global const KvxCell* c, global const uint* tissue, const int16 in_core,
                          const float16 x, const float16 y, const float16 z) {
  const bool all_bone = c->all_inner && c->bone_nodes == KVX_BLOCK_NODES;
  int16 as = select((int16)(KVX_GROWN), (int16)(all_bone ? KVX_BONE : KVX_BODY), in_core);
  if (all_bone || (c->all_inner && c->bone_nodes == 0)) return as;
  const int16 i = clamp(convert_int16_rtz(4.0f * x + 2.5f), 0, 4),
              j = clamp(convert_int16_rtz(4.0f * y + 2.5f), 0, 4);
  const int16 bit = i + 5 * (j + 5 * clamp(convert_int16_rtz(4.0f * z + 2.5f), 0, 4));
  if (!c->all_inner) {
    const int16 is_body = tissue16(tissue + KVX_IS_BODY, bit) == 1,
                is_air = tissue16(tissue + KVX_IS_CARRIED, bit) == 1;
    const int16 is_inner = tissue16(tissue + KVX_IS_INNER, bit) == 1;
    const int16 otherwise = select((int16)(KVX_UNCLAIMED), max(as, (int16)(KVX_MARGIN)), is_air);
    as = select(otherwise, select(max(as, (int16)(KVX_RIM)), as, is_inner), is_body);
  }
  if (c->bone_nodes == 0) return as;
  return select(as, (int16)(KVX_BONE), as == KVX_BODY && tissue16(tissue + KVX_IS_BONE, bit) == 1);
}

// `near`: the voxels for which the steps settle; others may land in the cell by chance.
KVX_INLINE void claim16(global const KvxCell* c, global const uint* tissue, const int order, const int16 near,
                        const float16 qx, const float16 qy, const float16 qz, const int first,
                        local KvxTile* tile) {
  float16 x = qx, y = qy, z = qz, x0 = qx, y0 = qy, z0 = qz;
  for (int step = 0; step < c->steps; ++step) {
    x0 = x, y0 = y, z0 = z;
    const float16 xx = x * x, yy = y * y, zz = z * z, yz = y * z, zx = z * x, xy = x * y, xyz = xy * z;
    x = qx - (c->squares[0] * xx + c->squares[3] * yy + c->squares[6] * zz +
              (c->products[0] * yz + c->products[3] * zx + c->products[6] * xy + c->cube[0] * xyz));
    y = qy - (c->squares[1] * xx + c->squares[4] * yy + c->squares[7] * zz +
              (c->products[1] * yz + c->products[4] * zx + c->products[7] * xy + c->cube[1] * xyz));
    z = qz - (c->squares[2] * xx + c->squares[5] * yy + c->squares[8] * zz +
              (c->products[2] * yz + c->products[5] * zx + c->products[8] * xy + c->cube[2] * xyz));
  }
  const float16 far = farthest16(x, y, z);
  const int16 holds = near && far <= c->reach && farthest16(x - x0, y - y0, z - z0) <= UNSETTLED;
  const int16 as = claims16(c, tissue, far <= c->core, x, y, z) << CLAIM_SHIFT | order;
  const int16 claimed = vload16(first, tile->claim), better = holds && as < claimed;
  if (!some16(better)) return;
  vstore16(select(claimed, as, better), first, tile->claim);
  vstore16(select(vload16(first, tile->x), c->middle[0] + 4.0f * x, better), first, tile->x);
  vstore16(select(vload16(first, tile->y), c->middle[1] + 4.0f * y, better), first, tile->y);
  vstore16(select(vload16(first, tile->z), c->middle[2] + 4.0f * z, better), first, tile->z);
}

KVX_INLINE KvxLanes lanes_of(global const KvxCell* c) {
  global const float* a = c->inverse;
  KvxLanes lanes;
  lanes.x = a[0] * LANE_X + (a[1] * LANE_Y + a[2] * LANE_Z);
  lanes.y = a[4] * LANE_X + (a[5] * LANE_Y + a[6] * LANE_Z);
  lanes.z = a[8] * LANE_X + (a[9] * LANE_Y + a[10] * LANE_Z);
  lanes.reach = c->reach + c->slack;
  lanes.far_x = lanes.reach + 1.5f * fabs(a[0]) + 0.5f * (fabs(a[1]) + fabs(a[2])) + 1e-4f;
  lanes.far_y = lanes.reach + 1.5f * fabs(a[4]) + 0.5f * (fabs(a[5]) + fabs(a[6])) + 1e-4f;
  lanes.far_z = lanes.reach + 1.5f * fabs(a[8]) + 0.5f * (fabs(a[9]) + fabs(a[10])) + 1e-4f;
  return lanes;
}

// Returns the pairs that it asked, a bit each.
KVX_INLINE ulong claim_cell(global const KvxCell* c, global const int* box, global const uint* tissue,
                            const int order, const int3 corner, const int3 extent, local KvxTile* tile) {
  const int3 shift = (int3)(2, 1, 1), lo = max(vload3(0, box) - corner, 0) >> shift;
  const int3 hi = min(vload3(1, box) - corner, extent - 1) >> shift;
  const KvxLanes lanes = lanes_of(c);
  global const float* a = c->inverse;
  // Claims from here on:
  const int improvable = ((c->bone_nodes > 0 ? KVX_BONE : KVX_BODY) + 1) << CLAIM_SHIFT;
  ulong pairs = 0;
  for (int k = lo.z; k <= hi.z; ++k) {
    for (int j = lo.y; j <= hi.y; ++j) {
      const float y = corner.y + 2 * j + 0.5f, z = corner.z + 2 * k + 0.5f;
      const float row_x = a[1] * y + (a[2] * z + a[3]), row_y = a[5] * y + (a[6] * z + a[7]),
                  row_z = a[9] * y + (a[10] * z + a[11]);
      for (int i = lo.x; i <= hi.x; ++i) {
        const float x = corner.x + 4 * i + 1.5f;
        const float mx = a[0] * x + row_x, my = a[4] * x + row_y, mz = a[8] * x + row_z;
        if (!(fabs(mx) <= lanes.far_x && fabs(my) <= lanes.far_y && fabs(mz) <= lanes.far_z)) continue;
        const int at = 16 * k + 4 * j + i;
        if ((at & (int)(get_local_size(0) - 1)) != (int)get_local_id(0)) continue;
        const float16 qx = mx + lanes.x, qy = my + lanes.y, qz = mz + lanes.z;
        const int16 near = farthest16(qx, qy, qz) <= lanes.reach && vload16(at, tile->claim) >= improvable;
        if (!some16(near)) continue;
        claim16(c, tissue, order, near, qx, qy, qz, at, tile);
        pairs |= 1ul << at;
      }
    }
  }
  return pairs;
}

// What landed in the unit cells of a rough brick; returns the pairs where it did.
static ulong claim_landings(global const KvxChunk* chunks, const int first, const int order, const int t,
                            local KvxTile* tile) {
  ulong pairs = 0;
  for (int n = first; n >= 0; n = chunks[n].next) {
    global const KvxChunk* chunk = chunks + n;
    ulong here = 0;
#pragma unroll
    for (int some = 0; some < KVX_LANDINGS / 16; ++some)
      here |= (ulong)bits16(vload16(some, chunk->tile) == t) << (16 * some);
    for (; here; here &= here - 1) {
      const uint2 landing = vload2(63 - clz(here & -here), chunk->landing[0]);
      const int rank = landing.y >> 13, at = rank & 1023,
                claim = (rank >> 16) << CLAIM_SHIFT | order | ((rank >> 10) & 63);
      if (((at >> 4) & (int)(get_local_size(0) - 1)) != (int)get_local_id(0) || claim >= tile->claim[at])
        continue;
      pairs |= 1ul << (at >> 4);
      tile->claim[at] = claim;
      tile->x[at] = chunk->base[0] + KVX_PLACE_STEP * (landing.x & 0x7FFF);
      tile->y[at] = chunk->base[1] + KVX_PLACE_STEP * ((landing.x >> 15) & 0x7FFF);
      tile->z[at] = chunk->base[2] + KVX_PLACE_STEP * (landing.x >> 30 | (landing.y & 0x1FFF) << 2);
    }
  }
  return pairs;
}

// `in_tile`: places in the list of bricks, from `first` on.
static void claim_tile(global const int* list, global const KvxBrickCells* found, global const KvxCell* cells,
                       global const KvxChunk* chunks, global const uint* tissue, const uint first,
                       const uint end, global const int* in_tile, const int t, const int3 corner,
                       const int3 extent, const KvxBones* bones, local KvxTile* tile) {
  const int step = get_local_size(0);
  ulong beside_bone = 0;  // pairs that bricks with bone claim in
  for (int pair = get_local_id(0); pair < TILE_BLOCKS / 2; pair += step)
    vstore16((int16)(KVX_UNCLAIMED << CLAIM_SHIFT), pair, tile->claim);
  for (uint n = first; n < end; ++n) {
    const int item = in_tile[n], order = (int)(n - first) << BRICK_SHIFT, chunk = found[item].first_chunk;
    global const uint* words = tissue + KVX_TISSUE_WORDS * (size_t)list[item];
    const ulong pairs =
        chunk == KVX_SMOOTH ? claim_cell(cells + item, found[item].box, words, order, corner, extent, tile)
                            : claim_landings(chunks, chunk, order, t, tile);
    if (any(vload4(0, words + KVX_IS_BONE) != 0u)) beside_bone |= pairs;
  }
  for (int pair = get_local_id(0); pair < TILE_BLOCKS / 2; pair += step)
    vstore16(vload16(pair, tile->claim) >> CLAIM_SHIFT, pair, tile->claim);
  for (; beside_bone; beside_bone &= beside_bone - 1)
    settle_pair(bones, 63 - (int)clz(beside_bone & -beside_bone), corner, tile);
}
