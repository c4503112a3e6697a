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

// The cells at places, and how far between their corners; 0 for lanes that are not `used`.
KVX_INLINE int16 cells_at16(const KvxBones* b, const float16* place, const int16 used, float16* part) {
  const int size[3] = {b->size.x, b->size.y, b->size.z};
  int16 low[3];
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const float16 inside = clamp(select((float16)(0.0f), place[a], used), 0.0f, size[a] - 1.0f);
    low[a] = min(convert_int16_rtz(inside), size[a] - 2), part[a] = inside - convert_float16(low[a]);
  }
  const int16 at = (low[2] * size[1] + low[1]) * size[0] + low[0];
  global const int* c = b->cells;
  return used & (int16)(c[at.s0], c[at.s1], c[at.s2], c[at.s3], c[at.s4], c[at.s5], c[at.s6], c[at.s7],
                        c[at.s8], c[at.s9], c[at.sa], c[at.sb], c[at.sc], c[at.sd], c[at.se], c[at.sf]);
}

// The trilinear weight of the corners that are set.
KVX_INLINE float16 share16(const int16 corners, const float16* part) {
  float16 along[4];
#pragma unroll
  for (int row = 0; row < 4; ++row) {
    const float16 low = convert_float16((corners >> (2 * row)) & 1),
                  high = convert_float16((corners >> (2 * row + 1)) & 1);
    along[row] = low + part[0] * (high - low);
  }
  const float16 low = along[0] + part[1] * (along[1] - along[0]),
                high = along[2] + part[1] * (along[3] - along[2]);
  return low + part[2] * (high - low);
}

KVX_INLINE void by_bone16(const KvxBones* b, const int bone, const float16* voxel, float16* place) {
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const float4 row = b->back[3 * bone + a];
    place[a] = row.x * voxel[0] + (row.y * voxel[1] + (row.z * voxel[2] + row.w));
  }
}

// The corners of cells that are in a bone.
KVX_INLINE int16 corners_in16(const int16 cell, const int bone) {
  const int16 second = cell >> 16;
  return select(select((int16)(0), second & 255, ((second >> 8) & 255) == bone), cell & 255,
                (cell & 255) != 0 && ((cell >> 8) & 255) == bone);
}

// A bone's weight at the places where it has the voxels itself.
KVX_INLINE float16 own_share16(const KvxBones* b, const int bone, const float16* own, const int16 used) {
  float16 part[3];
  const int16 in_grid = used && own[0] > -0.5f && own[1] > -0.5f && own[2] > -0.5f;
  return share16(corners_in16(cells_at16(b, own, in_grid, part), bone), part);
}

// How far from the cell's place to the bone's own one: all the way where half of the weight is the bone's.
// Beyond, the outer half of the cell is shared out evenly between border and soft tissue.
KVX_INLINE float16 way16(const float16 share, const float16 own_share, const float16 distance) {
  const float16 out = select(most16(1.0f, 1.0f - share + distance), 1.0f - own_share, own_share > 0.0f);
  return select(share / (2.0f * out - 1.0f + share), (float16)(1.0f), own_share >= 0.5f);
}

// Of bones around voxels' places, the one that has most weight at its own place: there, the weights at both.
typedef struct {
  float16 own[3], share, own_share;
} KvxNearest;

KVX_INLINE void nearest16(const KvxBones* b, const int16 cell, const float16* part, const int16 mixed,
                          const float16* voxel, KvxNearest* best) {
  best->share = 0.0f, best->own_share = -1.0f;
#pragma unroll
  for (int a = 0; a < 3; ++a) best->own[a] = 0.0f;
  int16 first = mixed, second = mixed && ((cell >> 16) & 255) != 0;  // still to be asked
  while (some16(first || second)) {
    const int16 most =
        max(select((int16)(-1), (cell >> 8) & 255, first), select((int16)(-1), (cell >> 24) & 255, second));
    const int bone = -smallest_int16(-most);
    const int16 of_first = first && ((cell >> 8) & 255) == bone,
                of_second = second && ((cell >> 24) & 255) == bone;
    first &= !of_first, second &= !of_second;
    float16 own[3];
    by_bone16(b, bone, voxel, own);
    const float16 own_share = own_share16(b, bone, own, of_first || of_second);
    const int16 better = (of_first || of_second) && own_share > best->own_share;
    best->share = select(best->share, share16(corners_in16(cell, bone), part), better);
    best->own_share = select(best->own_share, own_share, better);
#pragma unroll
    for (int a = 0; a < 3; ++a) best->own[a] = select(best->own[a], own[a], better);
  }
}

// The voxels of a pair of blocks.
KVX_INLINE void settle_pair(const KvxBones* b, const int pair, const int3 corner, local KvxTile* tile) {
  const int16 claim = vload16(pair, tile->claim), used = claim != KVX_UNCLAIMED;
  const float16 place[3] = {vload16(pair, tile->x), vload16(pair, tile->y), vload16(pair, tile->z)};
  float16 part[3];
  const int16 cell = cells_at16(b, place, used, part), mixed = (cell & 255) != 0 && (cell & 255) != 255;
  if (!some16(mixed)) return;
  const float16 voxel[3] = {corner.x + 4 * (pair & 3) + 1.5f + LANE_X,
                            corner.y + 2 * ((pair >> 2) & 3) + 0.5f + LANE_Y,
                            corner.z + 2 * (pair >> 4) + 0.5f + LANE_Z};
  KvxNearest bone;
  nearest16(b, cell, part, mixed, voxel, &bone);
  const float16 x = bone.own[0] - place[0], y = bone.own[1] - place[1], z = bone.own[2] - place[2];
  const float16 way = way16(bone.share, bone.own_share, sqrt(x * x + (y * y + z * z)));
  vstore16(select(place[0], place[0] + way * x, mixed), pair, tile->x);
  vstore16(select(place[1], place[1] + way * y, mixed), pair, tile->y);
  vstore16(select(place[2], place[2] + way * z, mixed), pair, tile->z);
  const int16 otherwise = select(claim, (int16)(KVX_BODY), claim == KVX_BONE);
  const int16 settled = select(otherwise, (int16)(KVX_BONE), bone.own_share >= 0.5f);
  vstore16(select(claim, settled, mixed), pair, tile->claim);
}
