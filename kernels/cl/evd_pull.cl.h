// Finds the template place of every voxel of a tile of posed voxels: the tile's bricks, in order, claim the voxels they hold.
// One work-group per tile; each work-item keeps to its own blocks of 2 x 2 x 2 voxels: a cell is compact, so few of the voxels
// looked at are not its own.
#define LANE_X (float8)(-0.5f, 0.5f, -0.5f, 0.5f, -0.5f, 0.5f, -0.5f, 0.5f)  // from the middle of a block
#define LANE_Y (float8)(-0.5f, -0.5f, 0.5f, 0.5f, -0.5f, -0.5f, 0.5f, 0.5f)
#define LANE_Z (float8)(-0.5f, -0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f)
#define UNSETTLED 0.025f // of a brick's edge: a greater last step finds nothing

// Per block: what claims its voxels, and the template place that lands there. While bricks claim, a claim is followed by the
// brick's place in the tile's list and its unit cell: of equals the first wins.
typedef struct {
  int8 claim[TILE_BLOCKS];
  float8 x[TILE_BLOCKS], y[TILE_BLOCKS], z[TILE_BLOCKS];
} KvxTile;
#define CLAIM_SHIFT 28
#define BRICK_SHIFT 6

// What a cell asks of every block: how its voxels differ from the middle, and how far the middle may lie out of the cell.
typedef struct {
  float8 x, y, z;
  float far_x, far_y, far_z, reach;
} KvxLanes;

// 0 or 1 per voxel: a bit of the brick's nodes.
static int8 tissue8(global const uint* words, const int8 bit) {
  const int8 word = bit >> 5;
  int8 w = select((int8)(words[0]), (int8)(words[1]), word == 1);
  w = select(w, (int8)(words[2]), word == 2);
  w = select(w, (int8)(words[3]), word == 3);
  return (w >> (bit & 31)) & 1;
}

// What the tissue at h makes of claims.
static int8 of_tissue8(global const uint* tissue, const int8 as, const float8 x, const float8 y, const float8 z) {
  const int8 i = clamp(convert_int8_rtz(4.0f * x + 2.5f), 0, 4), j = clamp(convert_int8_rtz(4.0f * y + 2.5f), 0, 4);
  const int8 bit = i + 5 * (j + 5 * clamp(convert_int8_rtz(4.0f * z + 2.5f), 0, 4));
  const int8 is_body = tissue8(tissue + KVX_IS_BODY, bit) == 1, is_air = tissue8(tissue + KVX_IS_CARRIED, bit) == 1;
  const int8 is_inner = tissue8(tissue + KVX_IS_INNER, bit) == 1;
  const int8 otherwise = select((int8)(KVX_UNCLAIMED), max(as, (int8)(KVX_MARGIN)), is_air);
  return select(otherwise, select(max(as, (int8)(KVX_RIM)), as, is_inner), is_body);
}

// `near`: the voxels for which the steps settle; others may land in the cell by chance.
static void claim8(global const KvxCell* c, global const uint* tissue, const int order, const int8 near, const float8 qx,
                   const float8 qy, const float8 qz, local int8* claim, local float8* place_x, local float8* place_y,
                   local float8* place_z) {
  float8 x = qx, y = qy, z = qz, x0 = qx, y0 = qy, z0 = qz;
  for (int step = 0; step < c->steps; ++step) {
    x0 = x, y0 = y, z0 = z;
    const float8 xx = x * x, yy = y * y, zz = z * z, yz = y * z, zx = z * x, xy = x * y, xyz = xy * z;
    x = qx - (c->squares[0] * xx + c->squares[3] * yy + c->squares[6] * zz +
              (c->products[0] * yz + c->products[3] * zx + c->products[6] * xy + c->cube[0] * xyz));
    y = qy - (c->squares[1] * xx + c->squares[4] * yy + c->squares[7] * zz +
              (c->products[1] * yz + c->products[4] * zx + c->products[7] * xy + c->cube[1] * xyz));
    z = qz - (c->squares[2] * xx + c->squares[5] * yy + c->squares[8] * zz +
              (c->products[2] * yz + c->products[5] * zx + c->products[8] * xy + c->cube[2] * xyz));
  }
  const float8 far = farthest8(x, y, z);
  const int8 holds = near && far <= c->reach && farthest8(x - x0, y - y0, z - z0) <= UNSETTLED;
  int8 as = select((int8)(KVX_GROWN), (int8)(KVX_BODY), far <= c->core);
  if (!c->all_inner) as = of_tissue8(tissue, as, x, y, z);
  as = as << CLAIM_SHIFT | order;
  const int8 better = holds && as < *claim;
  if (!some8(better)) return;
  *claim = select(*claim, as, better);
  *place_x = select(*place_x, c->middle[0] + 4.0f * x, better);
  *place_y = select(*place_y, c->middle[1] + 4.0f * y, better);
  *place_z = select(*place_z, c->middle[2] + 4.0f * z, better);
}

static KvxLanes lanes_of(global const KvxCell* c) {
  global const float* a = c->inverse;
  KvxLanes lanes;
  lanes.x = a[0] * LANE_X + (a[1] * LANE_Y + a[2] * LANE_Z);
  lanes.y = a[4] * LANE_X + (a[5] * LANE_Y + a[6] * LANE_Z);
  lanes.z = a[8] * LANE_X + (a[9] * LANE_Y + a[10] * LANE_Z);
  lanes.reach = c->reach + c->slack;
  lanes.far_x = lanes.reach + 0.5f * (fabs(a[0]) + fabs(a[1]) + fabs(a[2])) + 1e-4f;
  lanes.far_y = lanes.reach + 0.5f * (fabs(a[4]) + fabs(a[5]) + fabs(a[6])) + 1e-4f;
  lanes.far_z = lanes.reach + 0.5f * (fabs(a[8]) + fabs(a[9]) + fabs(a[10])) + 1e-4f;
  return lanes;
}

static void claim_cell(global const KvxCell* c, global const int* box, global const uint* tissue, const int order, const int3 corner,
                       const int3 extent, local KvxTile* tile) {
  const int3 lo = max(vload3(0, box) - corner, 0) >> 1, hi = min(vload3(1, box) - corner, extent - 1) >> 1;
  const KvxLanes lanes = lanes_of(c);
  global const float* a = c->inverse;
  for (int k = lo.z; k <= hi.z; ++k) {
    for (int j = lo.y; j <= hi.y; ++j) {
      const float y = corner.y + 2 * j + 0.5f, z = corner.z + 2 * k + 0.5f;
      const float row_x = a[1] * y + (a[2] * z + a[3]), row_y = a[5] * y + (a[6] * z + a[7]), row_z = a[9] * y + (a[10] * z + a[11]);
      for (int i = lo.x; i <= hi.x; ++i) {
        const float x = corner.x + 2 * i + 0.5f;
        const float mx = a[0] * x + row_x, my = a[4] * x + row_y, mz = a[8] * x + row_z;
        if (!(fabs(mx) <= lanes.far_x && fabs(my) <= lanes.far_y && fabs(mz) <= lanes.far_z)) continue;
        const int at = 32 * k + 8 * j + i;
        if ((at & (int)(get_local_size(0) - 1)) != (int)get_local_id(0)) continue;
        const float8 qx = mx + lanes.x, qy = my + lanes.y, qz = mz + lanes.z;
        const int8 near = farthest8(qx, qy, qz) <= lanes.reach && tile->claim[at] >= 1 << CLAIM_SHIFT;
        if (!some8(near)) continue;
        claim8(c, tissue, order, near, qx, qy, qz, tile->claim + at, tile->x + at, tile->y + at, tile->z + at);
      }
    }
  }
}

// What landed in the unit cells of a rough brick.
static void claim_landings(global const KvxChunk* chunks, const int first, const int order, const int t, const int3 corner,
                           const int3 extent, local KvxTile* tile) {
  local int* claims = (local int*)tile->claim;
  local float *x = (local float*)tile->x, *y = (local float*)tile->y, *z = (local float*)tile->z;
  for (int n = first; n >= 0; n = chunks[n].next) {
    global const KvxChunk* chunk = chunks + n;
    if (any(vload3(0, chunk->hi) < corner) || any(vload3(0, chunk->lo) >= corner + extent)) continue;
    for (int some = 0; some < chunk->count; some += 8) {
      int here[8];
      const int8 is_here = vload8(0, chunk->tile + some) == t;
      if (!some8(is_here)) continue;
      vstore8(is_here, 0, here);
      for (int i = 0; i < 8; ++i) {
        if (!here[i]) continue;
        const int rank = chunk->rank[some + i], at = rank & 1023;
        const int claim = (rank >> 16) << CLAIM_SHIFT | order | ((rank >> 10) & 63);
        if (((at >> 3) & (int)(get_local_size(0) - 1)) != (int)get_local_id(0) || claim >= claims[at]) continue;
        const float3 place = vload3(some + i, chunk->place[0]);
        claims[at] = claim, x[at] = place.x, y[at] = place.y, z[at] = place.z;
      }
    }
  }
}

// `in_tile`: places in the list of bricks, from `first` on.
static void claim_tile(global const int* list, global const KvxBrickCells* found, global const KvxCell* cells, global const KvxChunk* chunks,
                       global const uint* tissue, const uint first, const uint end, global const int* in_tile, const int t,
                       const int3 corner, const int3 extent, local KvxTile* tile) {
  const int step = get_local_size(0);
  for (int block = get_local_id(0); block < TILE_BLOCKS; block += step) tile->claim[block] = KVX_UNCLAIMED << CLAIM_SHIFT;
  for (uint n = first; n < end; ++n) {
    const int item = in_tile[n], order = (int)(n - first) << BRICK_SHIFT, chunk = found[item].first_chunk;
    if (chunk == KVX_SMOOTH) {
      claim_cell(cells + item, found[item].box, tissue + KVX_TISSUE_WORDS * (size_t)list[item], order, corner, extent, tile);
    } else {
      claim_landings(chunks, chunk, order, t, corner, extent, tile);
    }
  }
  for (int block = get_local_id(0); block < TILE_BLOCKS; block += step) tile->claim[block] >>= CLAIM_SHIFT;
}
