// Posed voxels that land in the unit cells of a brick, kept in chunks.
typedef struct {
  global KvxChunk* chunks;
  volatile global int* used;
  int room, first, last, count;  // chunks there is room for; the brick's first and last; landings in the last
  int lo[3], hi[3];              // of the voxels in the last chunk
  int box[6];                    // of all
} KvxSink;

static void reset_box(int* lo, int* hi) {
#pragma unroll
  for (int a = 0; a < 3; ++a) lo[a] = INT_MAX, hi[a] = INT_MIN;
}

static void open_sink(KvxSink* sink, global KvxChunk* chunks, volatile global int* used, const int room) {
  sink->chunks = chunks, sink->used = used, sink->room = room;
  sink->first = sink->last = -1, sink->count = 0;
  reset_box(sink->lo, sink->hi), reset_box(sink->box, sink->box + 3);
}

// Writes the head of the last chunk; `next` follows it.
static void end_chunk(KvxSink* sink, const int next) {
  if (sink->last >= 0 && sink->last < sink->room) {
    global KvxChunk* chunk = sink->chunks + sink->last;
    chunk->next = next, chunk->count = sink->count;
    for (int n = sink->count; n < KVX_LANDINGS; ++n) chunk->tile[n] = -1;
#pragma unroll
    for (int a = 0; a < 3; ++a) chunk->lo[a] = sink->lo[a], chunk->hi[a] = sink->hi[a];
  }
#pragma unroll
  for (int a = 0; a < 3; ++a)
    sink->box[a] = min(sink->box[a], sink->lo[a]), sink->box[a + 3] = max(sink->box[a + 3], sink->hi[a]);
  sink->last = next, sink->count = 0;
  reset_box(sink->lo, sink->hi);
}

static void close_sink(KvxSink* sink, KvxBrickCells* found) {
  end_chunk(sink, -1);
  found->first_chunk = sink->first;
#pragma unroll
  for (int a = 0; a < 6; ++a) found->box[a] = sink->box[a];
}

static void keep(KvxSink* sink, const int3 voxel, const int tile, const int rank, const float3 place) {
  if (sink->last < 0 || sink->count == KVX_LANDINGS) {
    const int next = atomic_inc(sink->used);
    if (sink->first < 0) sink->first = next;
    end_chunk(sink, next);
  }
  if (sink->last < sink->room) {
    global KvxChunk* chunk = sink->chunks + sink->last;
    chunk->tile[sink->count] = tile, chunk->rank[sink->count] = rank;
    vstore3(place, sink->count, chunk->place[0]);
  }
  ++sink->count;
  const int v[3] = {voxel.x, voxel.y, voxel.z};
#pragma unroll
  for (int a = 0; a < 3; ++a) sink->lo[a] = min(sink->lo[a], v[a]), sink->hi[a] = max(sink->hi[a], v[a]);
}

// The voxels of sixteen boxes, one of each at a time, x fastest; `left`: how many are to come.
typedef struct {
  int16 lo[3], hi[3], at[3], left;
} KvxScan;

KVX_INLINE KvxScan scan_of(const int16* lo, const int16* hi, const int16 counts) {
  KvxScan scan;
  scan.left = counts & 1;
#pragma unroll
  for (int a = 0; a < 3; ++a) scan.lo[a] = scan.at[a] = lo[a], scan.hi[a] = hi[a], scan.left *= hi[a] - lo[a] + 1;
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
  const int16 corner = (h[0] >= 0.0f & 1) | (h[1] >= 0.0f & 2) | (h[2] >= 0.0f & 4);
  const int16 is_body = ((l->body >> corner) & 1) != 0, is_air = ((l->carried >> corner) & 1) != 0;
  const int16 is_inner = ((l->inner >> corner) & 1) != 0;
  const int16 otherwise = select((int16)(KVX_UNCLAIMED), max(as, KVX_MARGIN), is_air && !inverted);
  const int16 claim = select(otherwise, select(max(as, KVX_RIM), as, is_inner), is_body);
  return select(claim, max(claim, KVX_INVERTED), inverted);
}

// Keeps those of `counts` that the cells hold at h, `depth` half-edges from their middles.
KVX_INLINE void land16(const KvxLayer* l, const float16* h, const float16 depth, const int16 counts, const int16 inverted, const int16* voxel,
                   const int4 tiles, KvxSink* sink) {
  const int16 held = counts && depth <= l->reach;
  if (!some16(held)) return;
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const int16 claim = of_tissue16(l, h, select((int16)(KVX_GROWN), (int16)(KVX_BODY), depth <= CORE), inverted);
  const int16 i = voxel[0], j = voxel[1], k = voxel[2];
  const int16 block = ((i >> 1) & 7) | ((j >> 1) & 3) << 3 | ((k >> 1) & 3) << 5;
  const int16 rank = claim << 16 | (lane + l->slot) << 10 | block << 3 | (i & 1) | (j & 1) << 1 | (k & 1) << 2;
  const int16 tile = ((k >> 3) * tiles.y + (j >> 3)) * tiles.x + (i >> 4);
  float x[16], y[16], z[16];
  int ranks[16], in_tile[16], at[3][16], keeps[16];
  vstore16(l->first.x + 0.5f + convert_float16(lane & 3) + h[0], 0, x);
  vstore16(l->first.y + 0.5f + convert_float16(lane >> 2) + h[1], 0, y);
  vstore16(l->first.z + 0.5f + h[2], 0, z);
  vstore16(rank, 0, ranks), vstore16(tile, 0, in_tile), vstore16(held && claim != KVX_UNCLAIMED, 0, keeps);
#pragma unroll
  for (int a = 0; a < 3; ++a) vstore16(voxel[a], 0, at[a]);
  for (int n = 0; n < 16; ++n)
    if (keeps[n]) keep(sink, (int3)(at[0][n], at[1][n], at[2][n]), in_tile[n], ranks[n], (float3)(x[n], y[n], z[n]));
}
