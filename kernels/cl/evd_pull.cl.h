// Finds the template place of every voxel of a tile of 16 x 8 x 8 posed voxels: the tile's cells, in order, claim the voxels
// they hold. One work-group per tile; each work-item keeps to its own blocks of 2 x 2 x 2 voxels, x fastest in a block and among
// blocks: a cell is compact, so few of the voxels looked at are not its own.
#define TILE_X 16
#define TILE_ROWS 64    // 8 x 8
#define TILE_BLOCKS 128  // 8 x 4 x 4
#define LANE_X (float8)(-0.5f, 0.5f, -0.5f, 0.5f, -0.5f, 0.5f, -0.5f, 0.5f)  // from the middle of a block
#define LANE_Y (float8)(-0.5f, -0.5f, 0.5f, 0.5f, -0.5f, -0.5f, 0.5f, 0.5f)
#define LANE_Z (float8)(-0.5f, -0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f)
#define UNSETTLED 0.1f // template voxels: a greater last step finds nothing

// Per block: what claims its voxels, and the template place that lands there.
typedef struct {
  int8 claim[TILE_BLOCKS];
  float8 x[TILE_BLOCKS], y[TILE_BLOCKS], z[TILE_BLOCKS];
} KvxTile;

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

static float8 axis8(const int axis, const float8 x, const float8 y, const float8 z) { return axis == 0 ? x : axis == 1 ? y : z; }

// What the cell claims eight posed voxels as, before tissue is asked: KVX_BODY in its core, KVX_GROWN around.
static int8 hold8(global const KvxCell* c, const float8 x, const float8 y, const float8 z) {
  float8 far = farthest8(x, y, z);
  if (c->tetrahedron >= 0) {
    constant int* path = KVX_PATH + 3 * c->tetrahedron;
    const float8 a = axis8(path[0], x, y, z), b = axis8(path[1], x, y, z), d = axis8(path[2], x, y, z);
    far = greater8(greater8(a, -d), 0.5f + greater8(b - a, d - b));
  }
  return select(select((int8)(KVX_UNCLAIMED), (int8)(KVX_GROWN), far <= c->reach), (int8)(KVX_BODY), far <= c->core);
}

// What the tissue at the places, template voxels, makes of claims.
static int8 of_tissue8(global const KvxCell* c, global const uint* tissue, const int8 as, const float8 x, const float8 y, const float8 z) {
  const int8 i = clamp(convert_int8_rtz(x - c->first_node[0] + 0.5f), 0, 4), j = clamp(convert_int8_rtz(y - c->first_node[1] + 0.5f), 0, 4);
  const int8 bit = i + 5 * (j + 5 * clamp(convert_int8_rtz(z - c->first_node[2] + 0.5f), 0, 4));
  const int8 is_body = tissue8(tissue + KVX_IS_BODY, bit) == 1, is_air = tissue8(tissue + KVX_IS_CARRIED, bit) == 1;
  const int8 is_inner = tissue8(tissue + KVX_IS_INNER, bit) == 1;
  const int8 otherwise = select((int8)(KVX_UNCLAIMED), max(as, (int8)(KVX_MARGIN)), is_air);
  return select(c->inverted ? (int8)(KVX_UNCLAIMED) : otherwise, select(max(as, (int8)(KVX_RIM)), as, is_inner), is_body);
}

// `near`: the voxels for which the steps settle; others may land in the cell by chance.
static void claim8(global const KvxCell* c, global const uint* tissue, global const float4* nodes, const float3 middle, const int8 near,
                   const float8 qx, const float8 qy, const float8 qz, local int8* claim, local float8* place_x,
                   local float8* place_y, local float8* place_z) {
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
  int8 settled = near;
  if (c->steps == KVX_NEWTON) {
    settled = newton8(c, near, qx, qy, qz, &x, &y, &z);
  } else if (c->nodes >= 0) {
    const int8 may = near && farthest8(x, y, z) <= c->reach + c->slack;
    if (!some8(may)) return;
    refine8(c, nodes + (size_t)c->nodes * KVX_BLOCK_NODES, middle, may, &x, &y, &z);
  } else if (c->steps > 0) {
    settled = near && farthest8(x - x0, y - y0, z - z0) * c->edge <= UNSETTLED;
  }
  int8 as = select((int8)(KVX_UNCLAIMED), hold8(c, x, y, z), settled);
  if (!some8(as < *claim)) return;
  x = c->middle[0] + c->edge * x, y = c->middle[1] + c->edge * y, z = c->middle[2] + c->edge * z;
  if (!c->all_inner) as = of_tissue8(c, tissue, as, x, y, z);
  if (c->inverted) as = max(as, (int8)(KVX_INVERTED));
  const int8 better = as < *claim;
  *claim = select(*claim, as, better);
  *place_x = select(*place_x, x, better), *place_y = select(*place_y, y, better), *place_z = select(*place_z, z, better);
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

static void claim_cell(global const KvxCell* c, global const KvxBox* box, global const uint* tissue, global const float4* nodes, const int3 corner,
                       const int3 extent, local KvxTile* tile) {
  const int3 lo = max(vload3(0, box->lo) - corner, 0) >> 1, hi = min(vload3(0, box->hi) - corner, extent - 1) >> 1;
  if (lo.x > hi.x || lo.y > hi.y || lo.z > hi.z) return;
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
        const int8 near = farthest8(qx, qy, qz) <= lanes.reach && tile->claim[at] > KVX_BODY;
        if (!some8(near)) continue;
        claim8(c, tissue, nodes, (float3)(x, y, z), near, qx, qy, qz, tile->claim + at, tile->x + at, tile->y + at, tile->z + at);
      }
    }
  }
}

// `ranges`: eight per listed brick, first cell and number of cells. `in_tile`: places in that list, from tile_first[tile] on.
static void claim_tile(global const int* list, global const int2* ranges, global const KvxCell* cells, global const KvxBox* boxes,
                       global const float4* nodes, global const uint* tissue, const uint first, const uint end, global const int* in_tile, const int3 corner,
                       const int3 extent, local KvxTile* tile) {
  for (int block = get_local_id(0); block < TILE_BLOCKS; block += get_local_size(0)) tile->claim[block] = KVX_UNCLAIMED;
  for (uint n = first; n < end; ++n) {
    global const uint* words = tissue + KVX_TISSUE_WORDS * (size_t)list[in_tile[n]];
    for (int part = 0; part < 8; ++part) {
      const int2 range = ranges[8 * in_tile[n] + part];
      for (int c = range.x; c < range.x + range.y; ++c) claim_cell(cells + c, boxes + c, words, nodes, corner, extent, tile);
    }
  }
}
