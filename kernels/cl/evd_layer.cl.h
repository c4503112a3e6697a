// A layer of sixteen unit cells of a brick, x fastest: their posed corners, tissue, and which of them there
// are.
#define MAX_STRETCH 4.0f  // of an edge that touches air: beyond it, two parts drew away from each other
#define TORN 1.5f         // of an edge between parts that may draw apart
#define CORE 0.52f        // of a half-edge 0.5: unit cells overlap against rounding
#define MIN_RATIO 0.001f  // volume ratios outside are no tissue
#define MAX_RATIO 20.0f

typedef struct {
  float16 at[8][3];            // posed corners, x lowest bit
  int16 carried, body, inner, bone;  // a bit per corner
  int16 live;                        // -1: there is such a cell, and it may reach the grid
  int16 meets;                       // -1: voxels of the grid lie in its box
  int16 lo[3], hi[3];                // the voxels it may claim
  float16 reach;                     // greatest half-edge at which it claims
  int layer;                         // of the brick's four
} KvxLayer;

// A bit of every lane's node, of a layer of 5x5.
KVX_INLINE int16 lane_bits(const int layer, const int corner) {
  const int16 node = (int16)(0, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13, 15, 16, 17, 18);
  return (((int16)(layer) >> (node + ((corner & 1) + 5 * ((corner >> 1) & 1)))) & 1) << corner;
}

KVX_INLINE int16 corner_bits(global const uint* tissue, const int word, const int z) {
  const int low = (int)(kvx_bits_from(tissue, word, z) & 0x1FFFFFF),
            high = (int)(kvx_bits_from(tissue, word, z + 1) & 0x1FFFFFF);
  int16 bits = 0;
#pragma unroll
  for (int n = 0; n < 4; ++n) bits |= lane_bits(low, n) | lane_bits(high, n) << 4;
  return bits;
}

// The squared greatest stretch of a cell's edges.
KVX_INLINE float16 stretch16(const KvxLayer* l, const float4 posed_mm, const float4 template_mm) {
  const float mm[3] = {template_mm.x, template_mm.y, template_mm.z};
  float16 most = 0.0f;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
#pragma unroll
    for (int n = 0; n < 8; ++n) {
      if (n & (1 << axis)) continue;
      const float16* a = l->at[n];
      const float16* b = l->at[n | (1 << axis)];
      const float16 x = (b[0] - a[0]) * posed_mm.x, y = (b[1] - a[1]) * posed_mm.y,
                    z = (b[2] - a[2]) * posed_mm.z;
      most = most16(most, (x * x + (y * y + z * z)) / (mm[axis] * mm[axis]));
    }
  }
  return most;
}

// The voxels of the grid within the posed box, widened by what claims beyond half-edges; -1 where there are
// some.
KVX_INLINE int16 box16(const float16* least, const float16* most, const float16* edges, const float16 reach,
                       const int4 size, int16* lo, int16* hi) {
  const float last[3] = {size.x - 1, size.y - 1, size.z - 1};
  int16 some = -1;
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const float16 pad = (reach - 0.5f) * edges[a] + 1e-3f;
    const float16 first = most16(ceil(least[a] - pad), 0.0f), end = least16(floor(most[a] + pad), last[a]);
    some &= first <= end;
    lo[a] = convert_int16_rtz(least16(first, last[a])), hi[a] = convert_int16_rtz(most16(end, 0.0f));
  }
  return some;
}

// Whether the posed box, widened to four times its size, meets the grid.
KVX_INLINE int16 near_grid16(const float16* least, const float16* most, const float16* edges,
                             const int4 size) {
  const float last[3] = {size.x - 1, size.y - 1, size.z - 1};
  int16 near = -1;
#pragma unroll
  for (int a = 0; a < 3; ++a)
    near &= most[a] + 1.5f * edges[a] >= -0.01f && least[a] - 1.5f * edges[a] <= last[a] + 0.01f;
  return near;
}

// False where the layer has no cell that may reach the grid.
KVX_INLINE bool load_layer(const KvxBlock* b, const int z, global const uint* tissue,
                           global const ulong* cuts, const float4 posed_mm, const float4 template_mm,
                           const int4 size, KvxLayer* l) {
  l->carried = corner_bits(tissue, KVX_IS_CARRIED, z);
  l->live = l->carried != 0;
  if (!some16(l->live)) return false;
  float16 least[3], most[3], edges[3];
#pragma unroll
  for (int a = 0; a < 3; ++a) {
#pragma unroll
    for (int n = 0; n < 8; ++n) {
      const float* at = b->at[a] + ROW((n >> 1) & 1, z + (n >> 2)) + (n & 1);
      const float16 p = (float16)(vload4(0, at), vload4(0, at + 5), vload4(0, at + 10), vload4(0, at + 15));
      l->at[n][a] = p;
      least[a] = n ? least16(least[a], p) : p, most[a] = n ? most16(most[a], p) : p;
    }
    edges[a] = most[a] - least[a];
  }
  l->reach = select((float16)(CORE), (float16)(1.0f),
                    ((int16)((int)(cuts[1] >> (16 * z)) & 0xFFFF) >> KVX_LANE) << 31);
  l->live &= near_grid16(least, most, edges, size);
  l->meets = l->live & box16(least, most, edges, l->reach, size, l->lo, l->hi);
  if (!some16(l->live)) return false;
  l->body = corner_bits(tissue, KVX_IS_BODY, z), l->inner = corner_bits(tissue, KVX_IS_INNER, z);
  l->bone = corner_bits(tissue, KVX_IS_BONE, z);
  const int16 cut = (((int16)((int)(cuts[0] >> (16 * z)) & 0xFFFF) >> KVX_LANE) & 1) != 0;
  if (some16(l->live && (l->body != 255 || cut))) {
    const float16 stretch = stretch16(l, posed_mm, template_mm);
    const float16 allowed = select((float16)(MAX_STRETCH * MAX_STRETCH),
                                   select((float16)(INFINITY), (float16)(TORN * TORN), cut), l->body == 255);
    l->live &= !(stretch > allowed);
  }
  l->layer = z;
  return true;
}
