// Inverts the forward map in a brick that is not smooth, unit cell by unit cell, the sixteen of a layer at a
// time: each finds which posed voxels land in it, and where. CPU twin: kernels/reference/evd_cells.cpp and
// evd_pull.cpp. Newton's method for the voxels in the boxes of cells that keep their hand, four candidates of
// each cell at a time.
KVX_INLINE void land_upright(const KvxLayer* l, const KvxMap* m, const int16 cells, const int4 tiles,
                             KvxSink* sink) {
  KvxScan scan = scan_of(l->lo, l->hi, cells);
  int16 voxel[4][3], count = 0;
  while (some16(scan.left > 0)) {
    const int16 near = scan.left > 0 && is_near(m, l->reach, scan.at);
#pragma unroll
    for (int a = 0; a < 3; ++a) {
#pragma unroll
      for (int n = 3; n > 0; --n) voxel[n][a] = select(voxel[n][a], voxel[n - 1][a], near);
      voxel[0][a] = select(voxel[0][a], scan.at[a], near);
    }
    count -= near;
    next_voxel(&scan);
    if (!some16(count == 4) && some16(scan.left > 0)) continue;
    for (int n = 0; n < 4 && some16(count > n); ++n) {
      float16 h[3];
      linear16(m, voxel[n], h);
#pragma unroll
      for (int a = 0; a < 3; ++a) h[a] = clamp(h[a], -0.5f, 0.5f);
      const int16 settled = newton16(m, voxel[n], count > n, h);
      if (some16(settled)) land16(l, h, farthest16(h[0], h[1], h[2]), settled, 0, voxel[n], tiles, sink);
    }
    count = 0;
  }
}

// Where the trilinear map of `counts` has the voxels within `reach`, looked for from `start`: `h` goes there.
// Returns which of them it has.
KVX_INLINE int16 refine16(const KvxMap* m, const float16 reach, const int16* voxel, const int16 counts,
                          const float16* start, float16* h) {
  float16 found[3] = {start[0], start[1], start[2]};
  const int16 settled =
      newton16(m, voxel, counts, found) && farthest16(found[0], found[1], found[2]) <= reach;
#pragma unroll
  for (int a = 0; a < 3; ++a) h[a] = select(h[a], found[a], settled);
  return settled;
}

// The same, with the hand kept, of voxels beside a tetrahedron: from its place and from the cell's middle.
KVX_INLINE int16 beside16(const KvxMap* m, const float volume_ratio, const float16 reach, const int16* voxel,
                          const int16 counts, float16* h) {
  if (!some16(counts)) return 0;
  const float16 middle[3] = {0.0f, 0.0f, 0.0f};
  const float16 start[3] = {h[0], h[1], h[2]};
  const int16 first = refine16(m, reach, voxel, counts, start, h) && keeps_hand16(m, volume_ratio, h);
  const int16 left = counts && !first;
  if (!some16(left)) return first;
  return first || (refine16(m, reach, voxel, left, middle, h) && keeps_hand16(m, volume_ratio, h));
}

// The six tetrahedra of cells that fold, and, as the cells beside follow their trilinear maps, what lies
// between these and the tetrahedra: the folded cell's own map has it. Returns which of them have one inside
// out.
KVX_INLINE int16 land_folded(const KvxLayer* l, const KvxMap* m, const int16 cells, const float volume_ratio,
                             const int4 size, const int4 tiles, KvxSink* sink) {
  int16 turned = 0;
  for (int tet = 0; tet < 6; ++tet) {
    constant int* path = KVX_PATH + 3 * tet;
    KvxTetrahedron t;
    const float16 ratio = tetrahedron16(l, path, &t) * volume_ratio;
    turned |= !(ratio > 0.0f);
    const int16 counts = cells && fabs(ratio) > MIN_RATIO && fabs(ratio) < MAX_RATIO;
    int16 lo[3], hi[3];
    const int16 reaches = counts && box16(t.lo, t.hi, t.edges, (float16)(FOLDED_REACH), size, lo, hi);
    for (KvxScan scan = scan_of(lo, hi, reaches); some16(scan.left > 0); next_voxel(&scan)) {
      float16 h[3];
#pragma unroll
      for (int a = 0; a < 3; ++a) {
        h[a] = t.inverse[a][0] * (convert_float16(scan.at[0]) - t.middle[0]) +
               t.inverse[a][1] * (convert_float16(scan.at[1]) - t.middle[1]) +
               t.inverse[a][2] * (convert_float16(scan.at[2]) - t.middle[2]);
      }
      const float16 x = h[path[0]], y = h[path[1]], z = h[path[2]];
      const float16 depth = most16(most16(x, -z), 0.5f + most16(y - x, z - y));
      const int16 close = scan.left > 0 && depth <= FOLDED_REACH, held = close && depth <= l->reach;
      if (!some16(close)) continue;
      // A tetrahedron's places follow its own map: where the cell's has the voxel nearby, that is the better.
      const float16 start[3] = {h[0], h[1], h[2]};
      refine16(m, l->reach, scan.at, held, start, h);
      const int16 beside = beside16(m, volume_ratio, l->reach, scan.at, close && !held, h);
      land16(l, h, select(depth, farthest16(h[0], h[1], h[2]), beside), held || beside,
             held && ratio < 0.0f, scan.at, tiles, sink);
    }
  }
  return cells & turned;
}

// Returns how many cells of body fold.
static int land_units(const KvxBlock* b, global const uint* tissue, global const ulong* cuts,
                      const float volume_ratio, const float4 posed_mm, const float4 template_mm,
                      const int4 size, const int4 tiles, KvxSink* sink) {
  int folded = 0;
  for (int z = 0; z < 4; ++z) {
    KvxLayer layer;
    if (!load_layer(b, z, tissue, cuts, posed_mm, template_mm, size, &layer)) continue;
    KvxMap map;
    const int16 upright = map_of(&layer, volume_ratio, &map);
    if (some16(layer.live && layer.meets && upright))
      land_upright(&layer, &map, layer.live && layer.meets && upright, tiles, sink);
    const int16 folds = layer.live && !upright && layer.body != 0;  // air that folds is left out
    if (some16(folds))
      folded +=
          count16(land_folded(&layer, &map, folds, volume_ratio, size, tiles, sink) && layer.body == 255);
  }
  return folded;
}
