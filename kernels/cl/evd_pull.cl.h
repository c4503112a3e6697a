// Finds the template place of every voxel of a tile of 16 x 8 x 8 posed voxels: the tile's cells, in order, claim the voxels
// they hold. One work-group per tile; each work-item keeps to its own rows, eight voxels at a time.
#define TILE_X 16
#define TILE_ROWS 64  // 8 x 8
#define REFINEMENTS 5
#define REFINED 0.03f  // template voxels: the last move
#define UNSETTLED 0.1f // template voxels: a greater last step finds nothing

// Eight voxels each: what claims them, and the template place that lands there. [row][eight]
typedef struct {
  int8 claim[2 * TILE_ROWS];
  float8 x[2 * TILE_ROWS], y[2 * TILE_ROWS], z[2 * TILE_ROWS];
} KvxTile;

// 0 or 1 per voxel: a bit of the brick's nodes.
static int8 tissue8(global const uint* words, const int8 bit) {
  const int8 word = bit >> 5;
  int8 w = select((int8)(words[0]), (int8)(words[1]), word == 1);
  w = select(w, (int8)(words[2]), word == 2);
  w = select(w, (int8)(words[3]), word == 3);
  return (w >> (bit & 31)) & 1;
}

static float8 axis8(const int axis, const float8 x, const float8 y, const float8 z) { return axis == 0 ? x : axis == 1 ? y : z; }

// What the cell claims eight posed voxels as, before tissue is asked: KVX_BODY in its core, KVX_GROWN around.
static int8 hold8(global const KvxCell* c, const float8 x, const float8 y, const float8 z) {
  float8 far = fmax(fabs(x), fmax(fabs(y), fabs(z)));
  if (c->tetrahedron >= 0) {
    constant int* path = KVX_PATH + 3 * c->tetrahedron;
    const float8 a = axis8(path[0], x, y, z), b = axis8(path[1], x, y, z), d = axis8(path[2], x, y, z);
    far = fmax(fmax(a, -d), 0.5f + fmax(b - a, d - b));
  }
  return select(select((int8)(KVX_UNCLAIMED), (int8)(KVX_GROWN), far <= c->reach), (int8)(KVX_BODY), far <= c->core);
}

// Newton with the cell's own slope against the trilinear map of its nodes, for the voxels that may be the cell's.
// h in, h out; `p`: the first of eight posed voxels along x.
static void refine8(global const KvxCell* c, global const float4* nodes, const float3 p, const int8 may, float8* hx, float8* hy,
                    float8* hz) {
  float x[8], y[8], z[8];
  int lanes[8];
  vstore8(*hx, 0, x), vstore8(*hy, 0, y), vstore8(*hz, 0, z), vstore8(may, 0, lanes);
  for (int n = 0; n < 8; ++n) {
    if (!lanes[n]) continue;
    const float4 target = (float4)(p.x + n, p.y, p.z, 0.0f);
    float3 v = 4.0f * (float3)(x[n], y[n], z[n]) + 2.0f;
    for (int step = 0; step < REFINEMENTS; ++step) {
      const int3 i = clamp(convert_int3_rtz(v), 0, 3);
      const float3 f = v - convert_float3(i);
      global const float4* at = nodes + 25 * i.z + 5 * i.y + i.x;
      const float4 a = at[0] + f.x * (at[1] - at[0]), b = at[5] + f.x * (at[6] - at[5]);
      const float4 d = at[25] + f.x * (at[26] - at[25]), e = at[30] + f.x * (at[31] - at[30]);
      const float4 low = a + f.y * (b - a), high = d + f.y * (e - d);
      const float4 left = target - (low + f.z * (high - low));
      const float3 move = 4.0f * (float3)(c->inverse[0] * left.x + c->inverse[1] * left.y + c->inverse[2] * left.z,
                                          c->inverse[4] * left.x + c->inverse[5] * left.y + c->inverse[6] * left.z,
                                          c->inverse[8] * left.x + c->inverse[9] * left.y + c->inverse[10] * left.z);
      v += move;
      if (fmax(fabs(move.x), fmax(fabs(move.y), fabs(move.z))) < REFINED) break;
    }
    x[n] = 0.25f * v.x - 0.5f, y[n] = 0.25f * v.y - 0.5f, z[n] = 0.25f * v.z - 0.5f;
  }
  *hx = vload8(0, x), *hy = vload8(0, y), *hz = vload8(0, z);
}

// `near`: the voxels for which the steps settle; others may land in the cell by chance.
static void claim8(global const KvxCell* c, global const uint* tissue, global const float4* nodes, const float3 p, const int8 near,
                   const float8 qx, const float8 qy, const float8 qz, local int8* claim, local float8* place_x, local float8* place_y, local float8* place_z) {
  float8 x = qx, y = qy, z = qz, last = 0.0f;
  for (int step = 0; step < c->steps; ++step) {
    const float8 x0 = x, y0 = y, z0 = z;
    const float8 xx = x * x, yy = y * y, zz = z * z, yz = y * z, zx = z * x, xy = x * y, xyz = xy * z;
    x = qx - (c->squares[0] * xx + c->squares[3] * yy + c->squares[6] * zz +
              (c->products[0] * yz + c->products[3] * zx + c->products[6] * xy + c->cube[0] * xyz));
    y = qy - (c->squares[1] * xx + c->squares[4] * yy + c->squares[7] * zz +
              (c->products[1] * yz + c->products[4] * zx + c->products[7] * xy + c->cube[1] * xyz));
    z = qz - (c->squares[2] * xx + c->squares[5] * yy + c->squares[8] * zz +
              (c->products[2] * yz + c->products[5] * zx + c->products[8] * xy + c->cube[2] * xyz));
    last = fmax(fabs(x - x0), fmax(fabs(y - y0), fabs(z - z0)));
  }
  if (c->nodes >= 0) {
    const int8 may = near && fmax(fabs(x), fmax(fabs(y), fabs(z))) <= c->reach + c->slack && *claim > KVX_BODY;
    if (!any(may)) return;
    refine8(c, nodes + (size_t)c->nodes * KVX_BLOCK_NODES, p, may, &x, &y, &z);
  }
  const int8 settled = near && (last * c->edge <= UNSETTLED || c->nodes >= 0);
  int8 as = select((int8)(KVX_UNCLAIMED), hold8(c, x, y, z), settled);
  if (!any(as < *claim)) return;
  x = c->middle[0] + c->edge * x, y = c->middle[1] + c->edge * y, z = c->middle[2] + c->edge * z;
  if (!c->all_inner) {
    const int8 i = clamp(convert_int8_rte(x) - c->first_node[0], 0, 4), j = clamp(convert_int8_rte(y) - c->first_node[1], 0, 4);
    const int8 bit = i + 5 * (j + 5 * clamp(convert_int8_rte(z) - c->first_node[2], 0, 4));
    const int8 is_body = tissue8(tissue + KVX_IS_BODY, bit) == 1, is_air = tissue8(tissue + KVX_IS_CARRIED, bit) == 1;
    const int8 is_inner = tissue8(tissue + KVX_IS_INNER, bit) == 1;
    const int8 otherwise = select((int8)(KVX_UNCLAIMED), max(as, (int8)(KVX_MARGIN)), is_air);
    as = select(c->inverted ? (int8)(KVX_UNCLAIMED) : otherwise, select(max(as, (int8)(KVX_RIM)), as, is_inner), is_body);
  }
  if (c->inverted) as = max(as, (int8)(KVX_INVERTED));
  const int8 better = as < *claim;
  *claim = select(*claim, as, better);
  *place_x = select(*place_x, x, better), *place_y = select(*place_y, y, better), *place_z = select(*place_z, z, better);
}

static void claim_cell(global const KvxCell* c, global const uint* tissue, global const float4* nodes, const int3 corner,
                       const int3 extent, local KvxTile* tile) {
  const int3 lo = max((int3)(c->box[0], c->box[1], c->box[2]) - corner, 0);
  const int3 hi = min((int3)(c->box[3], c->box[4], c->box[5]) - corner, extent - 1);
  const float reach = c->reach + c->slack;
  const float8 lane = (float8)(0, 1, 2, 3, 4, 5, 6, 7);
  for (int eight = lo.x >> 3; eight <= hi.x >> 3; ++eight) {
    const float8 px = corner.x + 8 * eight + lane;
    const float8 ax = c->inverse[0] * px + c->inverse[3], ay = c->inverse[4] * px + c->inverse[7];
    const float8 az = c->inverse[8] * px + c->inverse[11];
    for (int k = lo.z; k <= hi.z; ++k) {
      for (int j = lo.y; j <= hi.y; ++j) {
        const int row = 8 * k + j;
        if ((row & (int)(get_local_size(0) - 1)) != (int)get_local_id(0)) continue;
        const float y = corner.y + j, z = corner.z + k;
        const float8 qx = ax + (c->inverse[1] * y + c->inverse[2] * z), qy = ay + (c->inverse[5] * y + c->inverse[6] * z);
        const float8 qz = az + (c->inverse[9] * y + c->inverse[10] * z);
        const int8 near = fmax(fabs(qx), fmax(fabs(qy), fabs(qz))) <= reach;
        if (!any(near)) continue;
        const int at = 2 * row + eight;
        claim8(c, tissue, nodes, (float3)(corner.x + 8 * eight, y, z), near, qx, qy, qz, tile->claim + at, tile->x + at,
               tile->y + at, tile->z + at);
      }
    }
  }
}

// `ranges`: eight per listed brick, first cell and number of cells. `in_tile`: places in that list, from tile_first[tile] on.
static void claim_tile(global const int* list, global const int2* ranges, global const KvxCell* cells, global const float4* nodes,
                       global const uint* tissue, const uint first, const uint end, global const int* in_tile, const int3 corner,
                       const int3 extent, local KvxTile* tile) {
  for (int row = get_local_id(0); row < TILE_ROWS; row += get_local_size(0)) {
    tile->claim[2 * row] = tile->claim[2 * row + 1] = KVX_UNCLAIMED;
  }
  for (uint n = first; n < end; ++n) {
    global const uint* words = tissue + KVX_TISSUE_WORDS * (size_t)list[in_tile[n]];
    for (int part = 0; part < 8; ++part) {
      const int2 range = ranges[8 * in_tile[n] + part];
      for (int c = range.x; c < range.x + range.y; ++c) claim_cell(cells + c, words, nodes, corner, extent, tile);
    }
  }
}
