// Posed voxels that land in the unit cells of a brick, kept in chunks.
typedef struct {
  global KvxChunk* chunks;
  volatile global int* used;
  int room, first, last, count;  // chunks there is room for; the brick's first and last; landings in the last
  int lo[3], hi[3];              // of the voxels
  float base[3];                 // of the chunks
} KvxSink;

static void open_sink(KvxSink* sink, global KvxChunk* chunks, volatile global int* used, const int room,
                      const int3 first_node) {
  sink->chunks = chunks, sink->used = used, sink->room = room;
  sink->first = sink->last = -1, sink->count = 0;
#pragma unroll
  for (int a = 0; a < 3; ++a) sink->lo[a] = INT_MAX, sink->hi[a] = INT_MIN;
  vstore3(convert_float3(first_node) - 1.0f, 0, sink->base);
}

// Completes the last chunk; `next` follows it.
static void end_chunk(KvxSink* sink, const int next) {
  if (sink->last >= 0 && sink->last < sink->room) {
    global KvxChunk* chunk = sink->chunks + sink->last;
    chunk->next = next;
    for (int n = sink->count; n < KVX_LANDINGS; ++n) chunk->tile[n] = -1;
#pragma unroll
    for (int a = 0; a < 3; ++a) chunk->base[a] = sink->base[a];
  }
  sink->last = next, sink->count = 0;
}

static void close_sink(KvxSink* sink, KvxBrickCells* found) {
  end_chunk(sink, -1);
  found->first_chunk = sink->first;
#pragma unroll
  for (int a = 0; a < 3; ++a) found->box[a] = sink->lo[a], found->box[a + 3] = sink->hi[a];
}

static void keep(KvxSink* sink, const int tile, const uint2 landing) {
  if (sink->last < 0 || sink->count == KVX_LANDINGS) {
    const int next = atomic_inc(sink->used);
    if (sink->first < 0) sink->first = next;
    end_chunk(sink, next);
  }
  if (sink->last < sink->room) {
    global KvxChunk* chunk = sink->chunks + sink->last;
    chunk->tile[sink->count] = tile;
    vstore2(landing, sink->count, chunk->landing[0]);
  }
  ++sink->count;
}

// The voxels of sixteen boxes, one of each at a time, x fastest; `left`: how many are to come.
typedef struct {
  int16 lo[3], hi[3], at[3], left;
} KvxScan;

KVX_INLINE KvxScan scan_of(const int16* lo, const int16* hi, const int16 counts) {
  KvxScan scan;
  scan.left = counts & 1;
#pragma unroll
  for (int a = 0; a < 3; ++a)
    scan.lo[a] = scan.at[a] = lo[a], scan.hi[a] = hi[a], scan.left *= hi[a] - lo[a] + 1;
  return scan;
}

KVX_INLINE void next_voxel(KvxScan* scan) {
  scan->at[0] += 1, scan->left -= 1;
  const int16 row = scan->at[0] > scan->hi[0];
  scan->at[0] = select(scan->at[0], scan->lo[0], row), scan->at[1] -= row;
  const int16 layer = scan->at[1] > scan->hi[1];
  scan->at[1] = select(scan->at[1], scan->lo[1], layer), scan->at[2] -= layer;
}

// What the tissue at h makes of claims.
KVX_INLINE int16 of_tissue16(const KvxLayer* l, const float16* h, const int16 as, const int16 inverted) {
  const int16 corner = ((h[0] >= 0.0f) & 1) | ((h[1] >= 0.0f) & 2) | ((h[2] >= 0.0f) & 4);
  const int16 is_body = ((l->body >> corner) & 1) != 0, is_air = ((l->carried >> corner) & 1) != 0;
  const int16 is_inner = ((l->inner >> corner) & 1) != 0, is_bone = ((l->bone >> corner) & 1) != 0;
  const int16 otherwise = select((int16)(KVX_UNCLAIMED), max(as, KVX_MARGIN), is_air && !inverted);
  const int16 claim = select(otherwise, select(max(as, KVX_RIM), as, is_inner), is_body);
  const int16 sorted = select(claim, (int16)(KVX_BONE), claim == KVX_BODY && is_bone);
  return select(sorted, max(sorted, KVX_INVERTED), inverted);
}

// Along an axis, of places at h around the middle of a brick's first unit cell.
KVX_INLINE uint16 steps16(const float16 h) {
  return convert_uint16_rtz(clamp((h + 1.5f) * (1.0f / KVX_PLACE_STEP) + 0.5f, 0.0f, 32767.0f));
}

// Keeps those of `counts` that the cells hold at h, `depth` half-edges from their middles.
KVX_INLINE void land16(const KvxLayer* l, const float16* h, const float16 depth, const int16 counts,
                       const int16 inverted, const int16* voxel, const int4 tiles, KvxSink* sink) {
  const int16 held = counts && depth <= l->reach;
  if (!some16(held)) return;
  const int16 claim =
      of_tissue16(l, h, select((int16)(KVX_GROWN), (int16)(KVX_BODY), depth <= CORE), inverted);
  const int16 i = voxel[0], j = voxel[1], k = voxel[2];
  const int16 block = ((i >> 1) & 7) | ((j >> 1) & 3) << 3 | ((k >> 1) & 3) << 5;
  const int16 rank =
      claim << 16 | (KVX_LANE + 16 * l->layer) << 10 | block << 3 | (i & 1) | (j & 1) << 1 | (k & 1) << 2;
  const int16 tile = ((k >> 3) * tiles.y + (j >> 3)) * tiles.x + (i >> 4);
  const int16 kept = held && claim != KVX_UNCLAIMED;
  const uint16 x = steps16(convert_float16(KVX_LANE & 3) + h[0]),
               y = steps16(convert_float16(KVX_LANE >> 2) + h[1]);
  const uint16 z = steps16(l->layer + h[2]);
  uint low[16], high[16];
  int in_tile[16];
  vstore16(x | y << 15 | z << 30, 0, low), vstore16(z >> 2 | as_uint16(rank) << 13, 0, high),
      vstore16(tile, 0, in_tile);
  uint left = bits16(kept);
  if (!left) return;
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    sink->lo[a] = min(sink->lo[a], smallest_int16(select((int16)(INT_MAX), voxel[a], kept)));
    sink->hi[a] = max(sink->hi[a], -smallest_int16(select((int16)(INT_MAX), -voxel[a], kept)));
  }
  for (; left; left &= left - 1) {
    const int n = 31 - clz(left & -left);
    keep(sink, in_tile[n], (uint2)(low[n], high[n]));
  }
}
