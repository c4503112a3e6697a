// Fits a cell to the posed nodes of a brick. CPU twin: kernels/reference/evd_cells.cpp.
#define SMOOTH 0.08f      // template voxels by which the inverse of a smooth brick may miss a node of body,
#define SMOOTH_AIR 0.16f  // and one of the air around it
#define SETTLED 0.004f    // template voxels left after the steps
#define MOST_STEPS 8
#define CONTRACTION 0.5f   // greatest slope of n in a smooth brick
#define LEAST_RATIO 0.08f  // of its volume to the template's
#define MOST_RATIO 5.0f
#define GROW 0.025f  // of the edge: by which it overlaps its neighbours, more than they disagree

static float3 by_rows(const float* a, const float3 v) {
  return (float3)(a[0] * v.x + a[1] * v.y + a[2] * v.z, a[4] * v.x + a[5] * v.y + a[6] * v.z,
                  a[8] * v.x + a[9] * v.y + a[10] * v.z);
}
static void set_term(float* term, const float3 v) { term[0] = v.x, term[1] = v.y, term[2] = v.z; }

// Rows of J^-1 and of its shift; false where J is singular.
static bool set_inverse(KvxCell* c, const float3 m, const float3 x, const float3 y, const float3 z) {
  const float3 r0 = cross(y, z), r1 = cross(z, x), r2 = cross(x, y);
  const float det = dot(x, r0), inverse = 1.0f / det;
  if (!(fabs(det) > 1e-9f)) return false;
  const float3 rows[3] = {r0 * inverse, r1 * inverse, r2 * inverse};
  for (int r = 0; r < 3; ++r) vstore4((float4)(rows[r], -dot(rows[r], m)), r, c->inverse);
  return true;
}

// Of a brick: its posed corners, and J by columns.
typedef struct {
  float3 lo, hi, x, y, z;
} KvxFrame;

// J, its inverse and n, from corners, faces' middles and the middle; false where the volume is out of bounds.
static bool set_map(const KvxBlock* b, const float volume_ratio, KvxCell* c, KvxFrame* f) {
  float3 p[8];
  f->lo = INFINITY, f->hi = -INFINITY;
  for (int n = 0; n < 8; ++n) {
    p[n] = node_at(b, ((n & 1) ? 4 : 0) + ROW((n & 2) ? 4 : 0, (n & 4) ? 4 : 0));
    f->lo = fmin(f->lo, p[n]), f->hi = fmax(f->hi, p[n]);
  }
  const float3 x0 = p[1] - p[0], x1 = p[3] - p[2], x2 = p[5] - p[4], x3 = p[7] - p[6];
  const float3 s0 = p[1] + p[0], s1 = p[3] + p[2], s2 = p[5] + p[4], s3 = p[7] + p[6],
               m = node_at(b, ROW(2, 2) + 2);
  const float3 xa = node_at(b, ROW(2, 2)), xb = node_at(b, ROW(2, 2) + 4), ya = node_at(b, ROW(0, 2) + 2);
  const float3 yb = node_at(b, ROW(4, 2) + 2), za = node_at(b, ROW(2, 0) + 2), zb = node_at(b, ROW(2, 4) + 2);
  f->x = 0.125f * (x0 + x1 + x2 + x3) + 0.5f * (xb - xa),
  f->y = 0.125f * (s1 - s0 + s3 - s2) + 0.5f * (yb - ya);
  f->z = 0.125f * (s2 - s0 + s3 - s1) + 0.5f * (zb - za);
  const float ratio = dot(f->x, cross(f->y, f->z)) * volume_ratio / 64.0f;
  if (!(ratio > LEAST_RATIO && ratio < MOST_RATIO) || !set_inverse(c, m, f->x, f->y, f->z)) return false;
  set_term(c->squares, by_rows(c->inverse, 2.0f * (xa + xb - 2.0f * m)));
  set_term(c->squares + 3, by_rows(c->inverse, 2.0f * (ya + yb - 2.0f * m)));
  set_term(c->squares + 6, by_rows(c->inverse, 2.0f * (za + zb - 2.0f * m)));
  set_term(c->products, by_rows(c->inverse, (s0 - s1 - s2 + s3) * 0.5f));
  set_term(c->products + 3, by_rows(c->inverse, (x3 + x2 - x1 - x0) * 0.5f));
  set_term(c->products + 6, by_rows(c->inverse, (x3 - x2 + x1 - x0) * 0.5f));
  set_term(c->cube, by_rows(c->inverse, x3 - x2 - x1 + x0));
  return true;
}

// How many steps settle, and how far n goes; false where they do not.
static bool set_steps(KvxCell* c) {
  float slope = 0.0f, most = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const float sq = fabs(c->squares[axis]) + fabs(c->squares[axis + 3]) + fabs(c->squares[axis + 6]);
    const float pr = fabs(c->products[axis]) + fabs(c->products[axis + 3]) + fabs(c->products[axis + 6]);
    slope = fmax(slope, sq + pr + 0.75f * fabs(c->cube[axis]));
    most = fmax(most, 0.25f * sq + 0.25f * pr + 0.125f * fabs(c->cube[axis]));
  }
  if (!(slope < CONTRACTION)) return false;
  c->steps = 0;
  for (float left = 4.0f * most; left > SETTLED && c->steps < MOST_STEPS; left *= slope) ++c->steps;
  c->slack = most * 1.3f;
  return true;
}

// By how much the inverse misses sixteen nodes from 16 s on, along an axis: h + n(h) - J^-1 (p - m).
KVX_INLINE float16 misses16(const KvxBlock* b, const KvxCell* c, const int s, const int axis) {
  const int16 node = 16 * s + KVX_LANE, k = (node * 41) >> 10, row = node - 25 * k,
              j = (row * 13) >> 6;  // node / 25, row / 5
  const float16 x = 0.25f * convert_float16(row - 5 * j) - 0.5f, y = 0.25f * convert_float16(j) - 0.5f;
  const float16 z = 0.25f * convert_float16(k) - 0.5f;
  const float* sq = c->squares + axis;
  const float* pr = c->products + axis;
  const float* a = c->inverse + 4 * axis;
  const float16 along_x = (axis == 0 ? 1.0f : 0.0f) + sq[0] * x + pr[3] * z + y * (pr[6] + c->cube[axis] * z);
  const float16 along_y = (axis == 1 ? 1.0f : 0.0f) + sq[3] * y + pr[0] * z,
                along_z = (axis == 2 ? 1.0f : 0.0f) + sq[6] * z;
  const float16 q =
      a[0] * vload16(s, b->at[0]) + (a[1] * vload16(s, b->at[1]) + (a[2] * vload16(s, b->at[2]) + a[3]));
  return x * along_x + (y * along_y + (z * along_z - q));
}

// Moves the cell by the middle of what it misses the body by; whether it then misses little enough.
static bool settle_errors(const KvxBlock* b, global const uint* tissue, KvxCell* c, float* moved) {
  bool small = true;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    float16 low = INFINITY, high = INFINITY, low_all = INFINITY, high_all = INFINITY;
#pragma unroll
    for (int s = 0; s < 8; ++s) {
      const float16 error = misses16(b, c, s, axis), none = INFINITY;
      const int16 is_body = (int16)(tissue[KVX_IS_BODY + s / 2] >> (16 * (s & 1))) << (31 - KVX_LANE);
      const int16 counts = (int16)(tissue[KVX_IS_CARRIED + s / 2] >> (16 * (s & 1))) << (31 - KVX_LANE);
      low = least16(low, select(none, error, is_body)), high = least16(high, select(none, -error, is_body));
      low_all = least16(low_all, select(none, error, counts)),
      high_all = least16(high_all, select(none, -error, counts));
    }
    const float least = smallest16(low), most = -smallest16(high), least_all = smallest16(low_all),
                most_all = -smallest16(high_all);
    const float off = least <= most ? clamp(0.5f * (least + most), -0.25f * SMOOTH, 0.25f * SMOOTH) : 0.0f;
    c->inverse[4 * axis + 3] += off, moved[axis] = off;
    small = small && !(4.0f * fmax(most - off, off - least) >= SMOOTH) &&
            4.0f * fmax(most_all - off, off - least_all) < SMOOTH_AIR;
  }
  return small;
}

// False where steps would not settle, the volume is out of bounds or the nodes are missed by too much.
static bool fit_cell(const KvxBlock* b, const int3 first_node, global const uint* tissue, const bool grown,
                     const float volume_ratio, KvxCell* c, int* box) {
  KvxFrame f;
  float off[3];
  if (!set_map(b, volume_ratio, c, &f) || !set_steps(c) || !settle_errors(b, tissue, c, off)) return false;
  vstore3(convert_float3(first_node) + 2.0f, 0, c->middle);
  c->core = 0.5f + GROW, c->reach = grown ? 0.625f : c->core;
  const float3 pad = (c->reach - 0.5f + 0.5f * c->slack) * (fabs(f.x) + fabs(f.y) + fabs(f.z)) + 1e-3f;
  const float3 moved = off[0] * f.x + off[1] * f.y + off[2] * f.z;
  vstore3(convert_int3_sat(ceil(f.lo - moved - pad)), 0, box),
      vstore3(convert_int3_sat(floor(f.hi - moved + pad)), 0, box + 3);
  return true;
}
