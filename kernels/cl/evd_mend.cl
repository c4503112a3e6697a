// Mends a pulled grid voxel by voxel, by means of the bits that evd_pull.cl left of what tissue claimed:
// where two surfaces meet, or a fold leaves a crack thinner than a voxel, single voxels find nothing and
// others lie alone in air. CPU twin: kernels/reference/evd_shown.cpp.
#define KVX_FILL 0   // what is not inner tissue, but lies between such along two axes, becomes like it
// Tissue without a neighbour becomes air; after the filling, which reads it. What lies beyond the grid may be
// tissue: a voxel at its border stays. Not on coarse grids (evd_specks.h).
#define KVX_CLEAR 1

typedef struct {
  int row;                                   // bits of 18 voxels, the tile's own sixteen in the middle
  int before_y, after_y, before_z, after_z;  // of the rows beside
} KvxRows;

static int sixteen(global const uint* claimed, const int4 tiles, const int4 size, const int x, const int y,
                   const int z, const int what) {
  const int beyond = what == KVX_CLEAR ? 0xFFFF : 0;
  if (x < 0 || y < 0 || z < 0 || x >= tiles.x || y >= size.y || z >= size.z) return beyond;
  const int tile = ((z >> 3) * tiles.y + (y >> 3)) * tiles.x + x;
  const uint word = claimed[64 * (size_t)tile + 8 * (z & 7) + (y & 7)];
  const int left = size.x - 16 * x, in_grid = left < 16 ? (1 << left) - 1 : 0xFFFF;
  return what == KVX_CLEAR ? word >> 16 | (beyond & ~in_grid) : word & 0xFFFF;
}

// What need not be looked at, by the row alone.
static bool is_well(const int row, const int what) {
  const int own = (row >> 1) & 0xFFFF;
  return what == KVX_CLEAR ? !(own & ~(row | (row >> 2))) : own == 0xFFFF;
}

static KvxRows rows_at(global const uint* claimed, const int4 tiles, const int4 size, const int x,
                       const int y, const int z, const int what) {
  KvxRows r = {0, 0, 0, 0, 0};
  r.row = (sixteen(claimed, tiles, size, x - 1, y, z, what) >> 15) |
          (sixteen(claimed, tiles, size, x, y, z, what) << 1) |
          ((sixteen(claimed, tiles, size, x + 1, y, z, what) & 1) << 17);
  if (is_well(r.row, what)) return r;
  r.before_y = sixteen(claimed, tiles, size, x, y - 1, z, what),
  r.after_y = sixteen(claimed, tiles, size, x, y + 1, z, what);
  r.before_z = sixteen(claimed, tiles, size, x, y, z - 1, what),
  r.after_z = sixteen(claimed, tiles, size, x, y, z + 1, what);
  return r;
}

// A bit for each of the sixteen voxels that is to be mended.
static int to_mend(const KvxRows r, const int what) {
  const int own = r.row >> 1;
  if (is_well(r.row, what)) return 0;
  if (what == KVX_CLEAR)
    return own & ~(r.row | (r.row >> 2) | r.before_y | r.after_y | r.before_z | r.after_z) & 0xFFFF;
  const int x = r.row & (r.row >> 2), y = r.before_y & r.after_y, z = r.before_z & r.after_z;
  return ~own & ((x & y) | (y & z) | (z & x)) & 0xFFFF;
}

// The voxels beside that such tissue claims, at bit `b` of a row; returns how many.
static int neighbours(const KvxRows r, const int b, const size_t voxel, const int4 size, size_t* beside) {
  const size_t row = size.x, layer = (size_t)size.x * size.y;
  int count = 0;
  if ((r.row >> b) & 1) beside[count++] = voxel - 1;
  if ((r.row >> (b + 2)) & 1) beside[count++] = voxel + 1;
  if ((r.before_y >> b) & 1) beside[count++] = voxel - row;
  if ((r.after_y >> b) & 1) beside[count++] = voxel + row;
  if ((r.before_z >> b) & 1) beside[count++] = voxel - layer;
  if ((r.after_z >> b) & 1) beside[count++] = voxel + layer;
  return count;
}

#define MEND_ARGS \
  global const uint *claimed, global const uint *tile_first, const int4 tiles, const int4 size, const int what
// One work-item per tile, most of which are empty or need nothing. MEND sees `voxel`, `beside` and `count`.
#define FOR_MENDED                                                                    \
  const int t = get_global_id(0);                                                     \
  if (t >= tiles.x * tiles.y * tiles.z || tile_first[t] == tile_first[t + 1]) return; \
  const int tx = t % tiles.x, ty = t / tiles.x % tiles.y, tz = t / tiles.x / tiles.y; \
  const int left = size.x - 16 * tx, in_grid = left < 16 ? (1 << left) - 1 : 0xFFFF;  \
  for (int row = 0; row < 64; ++row) {                                                \
    const int y = 8 * ty + (row & 7), z = 8 * tz + (row >> 3);                        \
    if (y >= size.y || z >= size.z) continue;                                         \
    const KvxRows r = rows_at(claimed, tiles, size, tx, y, z, what);                        \
    const int bits = to_mend(r, what) & in_grid;                                      \
    for (int b = 0; bits >> b; ++b) {                                                 \
      if (!((bits >> b) & 1)) continue;                                               \
      const size_t voxel = ((size_t)z * size.y + y) * size.x + 16 * tx + b;           \
      size_t beside[6];                                                               \
      const int count = neighbours(r, b, voxel, size, beside);
#define END_MENDED \
  }                \
  }

// The mean of what is beside.
kernel void mend_intensities(MEND_ARGS, const float air, global float* out) {
  FOR_MENDED
  float sum = 0.0f;
  for (int n = 0; n < count; ++n) sum += out[beside[n]];
  out[voxel] = count ? sum / count : air;
  END_MENDED
}

// The most frequent label beside; of equals, the first.
kernel void mend_labels(MEND_ARGS, global ushort* out) {
  FOR_MENDED
  ushort winner = 0;
  int most = 0;
  for (int n = 0; n < count; ++n) {
    int like = 0;
    for (int m = 0; m < count; ++m) like += out[beside[m]] == out[beside[n]];
    if (like > most) most = like, winner = out[beside[n]];
  }
  out[voxel] = winner;
  END_MENDED
}
