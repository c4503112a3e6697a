// The trilinear map of sixteen unit cells and its inverse by Newton's method.
#define NEWTON_STEPS 6
#define NEWTON_SETTLED 0.03f  // template voxels: the last move
#define FOLDED_REACH 1.0f     // half-edges from a tetrahedron: what the folded cell's own map may have
#define NEWTON_LOST 2.0f      // half-edges: whoever goes that far is not the cell's

// p = m + x h_x + y h_y + z h_z + yz h_y h_z + zx h_z h_x + xy h_x h_y + xyz h_x h_y h_z; `inverse`: of (x,
// y, z).
typedef struct {
  float16 m[3], x[3], y[3], z[3], yz[3], zx[3], xy[3], xyz[3];
  float16 inverse[3][3], slack[3];  // rows; how far h may be from inverse (p - m)
} KvxMap;

KVX_INLINE float16 determinant16(const float16* x, const float16* y, const float16* z) {
  return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
         x[2] * (y[0] * z[1] - y[1] * z[0]);
}

// Rows of the inverse of the matrix of columns x, y, z; returns its determinant.
KVX_INLINE float16 invert16(const float16* x, const float16* y, const float16* z, float16 inverse[3][3]) {
  const float16 determinant = determinant16(x, y, z), d = 1.0f / determinant;
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    inverse[0][a] = d * (y[b] * z[c] - y[c] * z[b]);
    inverse[1][a] = d * (z[b] * x[c] - z[c] * x[b]);
    inverse[2][a] = d * (x[b] * y[c] - x[c] * y[b]);
  }
  return determinant;
}

// Whether the cells keep their hand at all corners: then the map has one inverse in each.
KVX_INLINE int16 upright16(const KvxLayer* l, const float volume_ratio) {
  int16 upright = -1;
#pragma unroll
  for (int n = 0; n < 8; ++n) {
    float16 x[3], y[3], z[3];
#pragma unroll
    for (int a = 0; a < 3; ++a) {
      x[a] = l->at[n | 1][a] - l->at[n & 6][a], y[a] = l->at[n | 2][a] - l->at[n & 5][a],
      z[a] = l->at[n | 4][a] - l->at[n & 3][a];
    }
    upright &= determinant16(x, y, z) * volume_ratio > MIN_RATIO;
  }
  return upright;
}

// Returns which cells Newton's method inverts.
KVX_INLINE int16 map_of(const KvxLayer* l, const float volume_ratio, KvxMap* m) {
  float16 bent[3];
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const float16 x0 = l->at[1][a] - l->at[0][a], x1 = l->at[3][a] - l->at[2][a],
                  x2 = l->at[5][a] - l->at[4][a];
    const float16 x3 = l->at[7][a] - l->at[6][a];
    const float16 s0 = l->at[1][a] + l->at[0][a], s1 = l->at[3][a] + l->at[2][a],
                  s2 = l->at[5][a] + l->at[4][a];
    const float16 s3 = l->at[7][a] + l->at[6][a];
    m->m[a] = 0.125f * (s0 + s1 + s2 + s3), m->x[a] = 0.25f * (x0 + x1 + x2 + x3);
    m->y[a] = 0.25f * (s1 - s0 + s3 - s2), m->z[a] = 0.25f * (s2 - s0 + s3 - s1);
    m->yz[a] = 0.5f * (s0 - s1 - s2 + s3), m->zx[a] = 0.5f * (x3 + x2 - x1 - x0),
    m->xy[a] = 0.5f * (x3 - x2 + x1 - x0);
    m->xyz[a] = x3 - x2 - x1 + x0;
    bent[a] = 0.25f * (fabs(m->yz[a]) + fabs(m->zx[a]) + fabs(m->xy[a])) + 0.125f * fabs(m->xyz[a]);
  }
  const float16 ratio = invert16(m->x, m->y, m->z, m->inverse) * volume_ratio;
#pragma unroll
  for (int a = 0; a < 3; ++a)
    m->slack[a] = 1.3f * (fabs(m->inverse[a][0]) * bent[0] + fabs(m->inverse[a][1]) * bent[1] +
                          fabs(m->inverse[a][2]) * bent[2]);
  return ratio > MIN_RATIO && ratio < MAX_RATIO && upright16(l, volume_ratio);
}

KVX_INLINE void linear16(const KvxMap* m, const int16* voxel, float16* q) {
  float16 p[3];
#pragma unroll
  for (int a = 0; a < 3; ++a) p[a] = convert_float16(voxel[a]) - m->m[a];
#pragma unroll
  for (int a = 0; a < 3; ++a)
    q[a] = m->inverse[a][0] * p[0] + (m->inverse[a][1] * p[1] + m->inverse[a][2] * p[2]);
}

// Whether a voxel may be the cell's.
KVX_INLINE int16 is_near(const KvxMap* m, const float16 reach, const int16* voxel) {
  float16 q[3];
  linear16(m, voxel, q);
  return fabs(q[0]) <= reach + m->slack[0] && fabs(q[1]) <= reach + m->slack[1] &&
         fabs(q[2]) <= reach + m->slack[2];
}

// Whether the map keeps its hand at h.
KVX_INLINE int16 keeps_hand16(const KvxMap* m, const float volume_ratio, const float16* h) {
  float16 by_x[3], by_y[3], by_z[3];
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    by_x[a] = m->x[a] + m->zx[a] * h[2] + h[1] * (m->xy[a] + m->xyz[a] * h[2]);
    by_y[a] = m->y[a] + m->yz[a] * h[2] + h[0] * (m->xy[a] + m->xyz[a] * h[2]);
    by_z[a] = m->z[a] + m->yz[a] * h[1] + h[0] * (m->zx[a] + m->xyz[a] * h[1]);
  }
  return determinant16(by_x, by_y, by_z) * volume_ratio > MIN_RATIO;
}

// From the start h to the voxels' h; returns which of `counts` settled.
KVX_INLINE int16 newton16(const KvxMap* m, const int16* voxel, const int16 counts, float16* h) {
  const float16 p[3] = {convert_float16(voxel[0]), convert_float16(voxel[1]), convert_float16(voxel[2])};
  float16 x = h[0], y = h[1], z = h[2];
  int16 settled = 0, lost = !counts;
  for (int step = 0; step < NEWTON_STEPS && some16(!settled && !lost); ++step) {
    float16 by_x[3], by_y[3], by_z[3], left[3];
#pragma unroll
    for (int a = 0; a < 3; ++a) {
      const float16 xyz = m->xyz[a], along_y = m->y[a] + m->yz[a] * z;
      by_x[a] = m->x[a] + m->zx[a] * z + y * (m->xy[a] + xyz * z);
      by_y[a] = along_y + x * (m->xy[a] + xyz * z);
      by_z[a] = m->z[a] + m->yz[a] * y + x * (m->zx[a] + xyz * y);
      left[a] = p[a] - m->m[a] - by_x[a] * x - along_y * y - m->z[a] * z;
    }
    const float16 u = by_y[1] * by_z[2] - by_y[2] * by_z[1], v = by_y[2] * by_z[0] - by_y[0] * by_z[2];
    const float16 w = by_y[0] * by_z[1] - by_y[1] * by_z[0],
                  inverse = 1.0f / (by_x[0] * u + by_x[1] * v + by_x[2] * w);
    const float16 r = left[1] * by_z[2] - left[2] * by_z[1], s = left[2] * by_z[0] - left[0] * by_z[2];
    const float16 t = left[0] * by_z[1] - left[1] * by_z[0];
    const float16 move_x = inverse * (left[0] * u + left[1] * v + left[2] * w);
    const float16 move_y = inverse * (by_x[0] * r + by_x[1] * s + by_x[2] * t);
    const float16 move_z = -inverse * (by_x[0] * (left[1] * by_y[2] - left[2] * by_y[1]) +
                                       by_x[1] * (left[2] * by_y[0] - left[0] * by_y[2]) +
                                       by_x[2] * (left[0] * by_y[1] - left[1] * by_y[0]));
    x += move_x, y += move_y, z += move_z;
    settled = farthest16(move_x, move_y, move_z) <= NEWTON_SETTLED;
    lost |= !(farthest16(x, y, z) <= NEWTON_LOST);
  }
  h[0] = x, h[1] = y, h[2] = z;
  return settled && !lost;
}

// A tetrahedron of every cell: h - middle = inverse (p - middle).
typedef struct {
  float16 inverse[3][3], middle[3], lo[3], hi[3], edges[3];
} KvxTetrahedron;

KVX_INLINE float16 tetrahedron16(const KvxLayer* l, constant int* path, KvxTetrahedron* t) {
  const int second = 1 << path[0], third = second | 1 << path[1];
  float16 column[3][3];
#pragma unroll
  for (int a = 0; a < 3; ++a) {
    const float16 v0 = l->at[0][a], v1 = l->at[second][a], v2 = l->at[third][a], v3 = l->at[7][a];
    column[path[0]][a] = v1 - v0, column[path[1]][a] = v2 - v1, column[path[2]][a] = v3 - v2;
    t->middle[a] = 0.5f * (v0 + v3);
    t->lo[a] = least16(least16(v0, v1), least16(v2, v3)), t->hi[a] = most16(most16(v0, v1), most16(v2, v3));
    t->edges[a] = fabs(v1 - v0) + fabs(v2 - v1) + fabs(v3 - v2);
  }
  return invert16(column[0], column[1], column[2], t->inverse);
}
