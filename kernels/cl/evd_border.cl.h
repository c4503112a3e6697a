// Bones are rigid out to their borders, half way to the next voxels: a cell between bone and soft tissue
// moves as a whole, so of what lands there the bone's own motion decides what is bone. CPU twin:
// kernels/reference/evd_border.cpp.
// Per node, of the cell above it: a bone << 8 | a bit per corner in that bone, and 16 bits higher the same of
// a second bone. Then what takes posed voxels back to the template's by each bone, three rows each.
typedef struct {
  global const int* cells;
  int4 size;
  global const float4* back;
} KvxBones;

// The cell at a place, and how far between its corners.
static int cell_at(const KvxBones* b, const float3 place, float3* part) {
  const float3 inside = clamp(place, 0.0f, convert_float3(b->size.xyz - 1));
  const int3 low = min(convert_int3_rtz(inside), b->size.xyz - 2);
  *part = inside - convert_float3(low);
  return b->cells[(low.z * b->size.y + low.y) * b->size.x + low.x];
}

// The trilinear weight of the corners that are set.
static float share_of(const int corners, const float3 part) {
  const float4 low = convert_float4(((int4)(corners) >> (int4)(0, 2, 4, 6)) & 1),
               high = convert_float4(((int4)(corners) >> (int4)(1, 3, 5, 7)) & 1);
  const float4 along = low + part.x * (high - low);
  const float2 rows = along.even + part.y * (along.odd - along.even);
  return rows.x + part.z * (rows.y - rows.x);
}

static float3 by_bone(const KvxBones* b, const int bone, const float3 voxel) {
  global const float4* row = b->back + 3 * bone;
  return (float3)(row[0].x * voxel.x + (row[0].y * voxel.y + (row[0].z * voxel.z + row[0].w)),
                  row[1].x * voxel.x + (row[1].y * voxel.y + (row[1].z * voxel.z + row[1].w)),
                  row[2].x * voxel.x + (row[2].y * voxel.y + (row[2].z * voxel.z + row[2].w)));
}

// The corners of a cell that are in a bone.
static int corners_in(const int cell, const int bone) {
  if ((cell & 255) != 0 && ((cell >> 8) & 255) == bone) return cell & 255;
  return ((cell >> 24) & 255) == bone ? (cell >> 16) & 255 : 0;
}

// A bone's weight at the place where it has the voxel itself.
static float own_share_of(const KvxBones* b, const int bone, const float3 own) {
  if (!(own.x > -0.5f && own.y > -0.5f && own.z > -0.5f)) return 0.0f;
  float3 part;
  const int cell = cell_at(b, own, &part);
  return share_of(corners_in(cell, bone), part);
}

// How far from the cell's place to the bone's own one: all the way where half of the weight is the bone's.
// Beyond, the outer half of the cell is shared out evenly between border and soft tissue.
static float way_of(const float share, const float own_share, const float distance) {
  if (own_share >= 0.5f) return 1.0f;
  const float out = own_share > 0.0f ? 1.0f - own_share : fmax(1.0f, 1.0f - share + distance);
  return share / (2.0f * out - 1.0f + share);
}

// A voxel of a tile.
static void settle(const KvxBones* b, const int at, const float3 voxel, local KvxTile* tile) {
  const int claim = tile->claim[at];
  if (claim == KVX_UNCLAIMED) return;
  const float3 place = (float3)(tile->x[at], tile->y[at], tile->z[at]);
  float3 part;
  const int cell = cell_at(b, place, &part), corners = cell & 255;
  if (corners == 0 || corners == 255) return;
  const int first = (cell >> 8) & 255, second = (cell >> 24) & 255;
  int bone = first;
  float3 own = by_bone(b, first, voxel);
  float own_share = own_share_of(b, first, own);
  if (((cell >> 16) & 255) != 0) {
    const float3 other = by_bone(b, second, voxel);
    const float other_share = own_share_of(b, second, other);
    if (other_share > own_share || (other_share == own_share && second > first))
      own = other, own_share = other_share, bone = second;
  }
  const float way =
      way_of(share_of(corners_in(cell, bone), part), own_share, sqrt(dot(own - place, own - place)));
  tile->x[at] = place.x + way * (own.x - place.x);
  tile->y[at] = place.y + way * (own.y - place.y);
  tile->z[at] = place.z + way * (own.z - place.z);
  tile->claim[at] = own_share >= 0.5f ? KVX_BONE : claim == KVX_BONE ? KVX_BODY : claim;
}

// The voxels of a pair of blocks, one by one: sixteen at a time, inlined, a loop over their bones never ended
// on an NVIDIA H200 (driver 580).
__attribute__((noinline)) static void settle_pair(const KvxBones* b, const int pair, const int3 corner,
                                                  local KvxTile* tile) {
  const int3 first = corner + (int3)(4 * (pair & 3), 2 * ((pair >> 2) & 3), 2 * (pair >> 4));
  for (int n = 0; n < 16; ++n) {
    const int3 voxel = first + (int3)((n & 1) | ((n >> 2) & 2), (n >> 1) & 1, (n >> 2) & 1);
    settle(b, 16 * pair + n, convert_float3(voxel), tile);
  }
}
