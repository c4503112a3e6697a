// Inverts cells that a few steps do not: refined against the nodes of a brick, or by Newton's method. Eight voxels of a block at
// a time, x fastest. CPU twin: kernels/reference/evd_pull.cpp.
#define REFINEMENTS 5
#define REFINED 0.05f  // template voxels: the last move; what is left is less than half of it
#define NEWTON_STEPS 6
#define NEWTON_SETTLED 0.01f

static bool some8(const int8 is_set) {
  const int4 four = is_set.lo | is_set.hi;
  const int2 two = four.lo | four.hi;
  return (two.x | two.y) < 0;
}
static float8 greater8(const float8 a, const float8 b) { return a > b ? a : b; }
static float farthest(const float3 v) {
  const float x = fabs(v.x), y = fabs(v.y), z = fabs(v.z), most = x > y ? x : y;
  return most > z ? most : z;
}
static float8 farthest8(const float8 x, const float8 y, const float8 z) { return greater8(fabs(x), greater8(fabs(y), fabs(z))); }

// Newton with the cell's own slope against the trilinear map of its nodes, until the voxels that may be the cell's settle.
// h in, h out; `middle`: of the block, posed voxels. All eight go on together: no branch, and none waits for another's sums.
static void refine8(global const KvxCell* c, global const float4* nodes, const float3 middle, const int8 may, float8* hx, float8* hy,
                    float8* hz) {
  float x[8], y[8], z[8], moved[8];
  vstore8(4.0f * *hx + 2.0f, 0, x), vstore8(4.0f * *hy + 2.0f, 0, y), vstore8(4.0f * *hz + 2.0f, 0, z);
  global const float* inverse = c->inverse;
  const float4 by_x = 4.0f * (float4)(inverse[0], inverse[4], inverse[8], 0.0f);
  const float4 by_y = 4.0f * (float4)(inverse[1], inverse[5], inverse[9], 0.0f);
  const float4 by_z = 4.0f * (float4)(inverse[2], inverse[6], inverse[10], 0.0f);
  const float4 first = (float4)(middle - 0.5f, 0.0f);
  for (int step = 0; step < REFINEMENTS; ++step) {
#pragma unroll
    for (int n = 0; n < 8; ++n) {
      const float4 v = (float4)(x[n], y[n], z[n], 0.0f);
      const int4 i = clamp(convert_int4_rtz(v), 0, 3);
      const float4 f = v - convert_float4(i);
      global const float4* at = nodes + 25 * i.z + 5 * i.y + i.x;
      const float4 a = at[0] + f.x * (at[1] - at[0]), b = at[5] + f.x * (at[6] - at[5]);
      const float4 d = at[25] + f.x * (at[26] - at[25]), e = at[30] + f.x * (at[31] - at[30]);
      const float4 low = a + f.y * (b - a), high = d + f.y * (e - d);
      const float4 left = first + (float4)(n & 1, (n >> 1) & 1, n >> 2, 0.0f) - (low + f.z * (high - low));
      const float4 move = left.x * by_x + left.y * by_y + left.z * by_z;
      x[n] = v.x + move.x, y[n] = v.y + move.y, z[n] = v.z + move.z;
      moved[n] = farthest(move.xyz);
    }
    if (!some8(may && vload8(0, moved) >= REFINED)) break;
  }
  *hx = 0.25f * vload8(0, x) - 0.5f, *hy = 0.25f * vload8(0, y) - 0.5f, *hz = 0.25f * vload8(0, z) - 0.5f;
}

// h + n(h) = q in a cell of edge 1, for the voxels near it; returns which of them settled.
static int8 newton8(global const KvxCell* c, const int8 near, const float8 qx, const float8 qy, const float8 qz, float8* hx,
                    float8* hy, float8* hz) {
  global const float *yz = c->products, *zx = yz + 3, *xy = yz + 6, *cube = c->cube;
  float8 x = clamp(qx, -0.5f, 0.5f), y = clamp(qy, -0.5f, 0.5f), z = clamp(qz, -0.5f, 0.5f);
  int8 settled = 0;
  for (int step = 0; step < NEWTON_STEPS; ++step) {
    float8 left[3], by_x[3], by_y[3], by_z[3];
    for (int a = 0; a < 3; ++a) {
      const float8 along_x = zx[a] * z + xy[a] * y + cube[a] * (y * z), along_y = yz[a] * z + xy[a] * x + cube[a] * (z * x);
      const float8 along_z = yz[a] * y + zx[a] * x + cube[a] * (x * y);
      by_x[a] = along_x + (a == 0 ? 1.0f : 0.0f), by_y[a] = along_y + (a == 1 ? 1.0f : 0.0f);
      by_z[a] = along_z + (a == 2 ? 1.0f : 0.0f);
      left[a] = (a == 0 ? qx - x : a == 1 ? qy - y : qz - z) - (x * along_x + yz[a] * (y * z));
    }
    const float8 u = by_y[1] * by_z[2] - by_y[2] * by_z[1], v = by_y[2] * by_z[0] - by_y[0] * by_z[2];
    const float8 w = by_y[0] * by_z[1] - by_y[1] * by_z[0];
    const float8 inverse = 1.0f / (by_x[0] * u + by_x[1] * v + by_x[2] * w);
    const float8 r = left[1] * by_z[2] - left[2] * by_z[1], s = left[2] * by_z[0] - left[0] * by_z[2];
    const float8 t = left[0] * by_z[1] - left[1] * by_z[0];
    const float8 move_x = inverse * (left[0] * u + left[1] * v + left[2] * w);
    const float8 move_y = inverse * (by_x[0] * r + by_x[1] * s + by_x[2] * t);
    const float8 move_z = inverse * (left[0] * (by_x[1] * by_y[2] - by_x[2] * by_y[1]) + left[1] * (by_x[2] * by_y[0] - by_x[0] * by_y[2]) +
                                     left[2] * (by_x[0] * by_y[1] - by_x[1] * by_y[0]));
    x += move_x, y += move_y, z += move_z;
    settled = near && farthest8(move_x, move_y, move_z) <= NEWTON_SETTLED;
    if (!some8(near && !settled)) break;
  }
  *hx = x, *hy = y, *hz = z;
  return settled;
}
