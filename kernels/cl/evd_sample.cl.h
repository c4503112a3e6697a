// Eight places at a time in a volume, and the prevailing label at one. Places are template voxels; `used` is
// -1 for lanes that count, 0 for lanes that may hold anything.
#define BORDER 0.51f  // voxels reach half a voxel beyond the outermost centres, and rounding a little further

static bool some8(const int8 is_set) {
  const int4 four = is_set.lo | is_set.hi;
  const int2 two = four.lo | four.hi;
  return (two.x | two.y) < 0;
}
static float8 greater8(const float8 a, const float8 b) { return a > b ? a : b; }
static float8 farthest8(const float8 x, const float8 y, const float8 z) {
  return greater8(fabs(x), greater8(fabs(y), fabs(z)));
}

// -1 where the voxel is claimed and its place lies in the volume.
static int8 kvx_inside8(const int4 size, const float8 x, const float8 y, const float8 z, const int8 claim) {
  return claim != KVX_UNCLAIMED && x > -BORDER && y > -BORDER && z > -BORDER && x < size.x - 1 + BORDER &&
         y < size.y - 1 + BORDER && z < size.z - 1 + BORDER;
}

static float8 kvx_gather8(global const float* v, const int8 at) {
  return (float8)(v[at.s0], v[at.s1], v[at.s2], v[at.s3], v[at.s4], v[at.s5], v[at.s6], v[at.s7]);
}

// The lower voxel of the pair around x, and how far between: exact at the last voxel too.
static int8 lower8(const int extent, const int8 used, const float8 x, float8* part) {
  const float8 inside = clamp(select((float8)(0.0f), x, used), 0.0f, extent - 1.0f);
  const int8 low = min(convert_int8_rtz(inside), max(extent - 2, 0));
  *part = inside - convert_float8(low);
  return low;
}

// Between eight voxels and those after them in their rows: a pair is one load.
static float8 along8(global const float* v, const int* at, const int extent, const float8 part) {
  if (extent == 1)
    return (float8)(v[at[0]], v[at[1]], v[at[2]], v[at[3]], v[at[4]], v[at[5]], v[at[6]], v[at[7]]);
  const float16 pairs =
      (float16)(vload2(0, v + at[0]), vload2(0, v + at[1]), vload2(0, v + at[2]), vload2(0, v + at[3]),
                vload2(0, v + at[4]), vload2(0, v + at[5]), vload2(0, v + at[6]), vload2(0, v + at[7]));
  return pairs.even + part * (pairs.odd - pairs.even);
}

static float8 kvx_linear8(global const float* image, const int4 size, const float8 x, const float8 y,
                          const float8 z, const int8 used) {
  float8 fx, fy, fz;
  const int8 i = lower8(size.x, used, x, &fx), j = lower8(size.y, used, y, &fy),
             k = lower8(size.z, used, z, &fz);
  const int dy = size.y > 1 ? size.x : 0, dz = size.z > 1 ? size.x * size.y : 0;
  int at[8];
  vstore8((k * size.y + j) * size.x + i, 0, at);
  const float8 a1 = along8(image, at, size.x, fx), b1 = along8(image + dy, at, size.x, fx);
  const float8 c1 = along8(image + dz, at, size.x, fx), d1 = along8(image + dy + dz, at, size.x, fx);
  const float8 low = a1 + fy * (b1 - a1), high = c1 + fy * (d1 - c1);
  return low + fz * (high - low);
}

// Keys' cubic (a = -1/2) at distances 1 + t, t, 1 - t, 2 - t: exact on quadratics.
static void keys8(const float8 t, float8* w) {
  w[0] = t * (-0.5f + t * (1.0f - 0.5f * t));
  w[1] = 1.0f + t * t * (1.5f * t - 2.5f);
  w[2] = t * (0.5f + t * (2.0f - 1.5f * t));
  w[3] = t * t * (0.5f * t - 0.5f);
}

static float8 kvx_cubic8(global const float* image, const int4 size, const float8 x, const float8 y,
                         const float8 z, const int8 used) {
  float8 fx, fy, fz, wx[4], wy[4], wz[4], sum = 0.0f;
  const int8 i = lower8(size.x, used, x, &fx), j = lower8(size.y, used, y, &fy),
             k = lower8(size.z, used, z, &fz);
  keys8(fx, wx), keys8(fy, wy), keys8(fz, wz);
  for (int c = 0; c < 4; ++c) {
    const int8 kc = clamp(k + c - 1, 0, size.z - 1);
    for (int b = 0; b < 4; ++b) {
      const int8 row = (kc * size.y + clamp(j + b - 1, 0, size.y - 1)) * size.x;
      float8 along = 0.0f;
      for (int a = 0; a < 4; ++a) along += wx[a] * kvx_gather8(image, row + clamp(i + a - 1, 0, size.x - 1));
      sum += wy[b] * wz[c] * along;
    }
  }
  return sum;
}

// The bone with the greatest trilinear share of the eight voxels around relative to its level; of equals, the
// first in memory. Against what is none the level decides: alone with it a bone has the place from there on.
static ushort kvx_prevailing(global const ushort* labels, const int4 size, global const float* levels,
                             const float3 p) {
  const float3 inside = clamp(p, (float3)(0.0f), convert_float3(size.xyz - 1));
  const int3 low = min(convert_int3_rtz(inside), max(size.xyz - 2, 0)), high = min(low + 1, size.xyz - 1);
  const float3 f = inside - convert_float3(low);
  ushort label[8];
  float share[8], most = 0.0f, none = 0.0f;
  ushort winner = 0;
  for (int n = 0; n < 8; ++n) {
    const int3 at = (int3)((n & 1) ? high.x : low.x, (n & 2) ? high.y : low.y, (n & 4) ? high.z : low.z);
    label[n] = labels[((size_t)at.z * size.y + at.y) * size.x + at.x];
    share[n] = ((n & 1) ? f.x : 1.0f - f.x) * ((n & 2) ? f.y : 1.0f - f.y) * ((n & 4) ? f.z : 1.0f - f.z);
  }
  for (int n = 0; n < 8; ++n) {
    float sum = 0.0f;
    for (int other = 0; other < 8; ++other) sum += label[other] == label[n] ? share[other] : 0.0f;
    if (label[n] == 0) {
      none = sum;
    } else if (sum / levels[label[n]] > most) {
      most = sum / levels[label[n]], winner = label[n];
    }
  }
  return most * (1.0f - levels[winner]) >= none ? winner : 0;
}
