// Fits a cell to the posed nodes of a brick. CPU twin: kernels/reference/evd_cells.cpp.
#define SMOOTH 0.08f       // template voxels by which the inverse of a smooth brick may miss a node
#define SETTLED 0.004f     // template voxels left after the steps
#define MOST_STEPS 8
#define CONTRACTION 0.5f   // greatest slope of n in a smooth brick
#define LEAST_RATIO 0.08f  // of its volume to the template's
#define MOST_RATIO 5.0f
#define GROW 0.025f        // of the edge: by which it overlaps its neighbours, more than they disagree

static float3 by_rows(const float* a, const float3 v) {
  return (float3)(a[0] * v.x + a[1] * v.y + a[2] * v.z, a[4] * v.x + a[5] * v.y + a[6] * v.z, a[8] * v.x + a[9] * v.y + a[10] * v.z);
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

// False where steps would not settle or the volume is out of bounds.
static bool fit_cell(const KvxBlock* b, const int3 first_node, const bool grown, const float volume_ratio, KvxCell* c, int* box) {
  float3 p[8], lo = INFINITY, hi = -INFINITY;
  for (int n = 0; n < 8; ++n) {
    p[n] = node_at(b, ((n & 1) ? 4 : 0) + ROW((n & 2) ? 4 : 0, (n & 4) ? 4 : 0));
    lo = fmin(lo, p[n]), hi = fmax(hi, p[n]);
  }
  const float3 x0 = p[1] - p[0], x1 = p[3] - p[2], x2 = p[5] - p[4], x3 = p[7] - p[6];
  const float3 s0 = p[1] + p[0], s1 = p[3] + p[2], s2 = p[5] + p[4], s3 = p[7] + p[6], m = node_at(b, ROW(2, 2) + 2);
  const float3 xa = node_at(b, ROW(2, 2)), xb = node_at(b, ROW(2, 2) + 4), ya = node_at(b, ROW(0, 2) + 2);
  const float3 yb = node_at(b, ROW(4, 2) + 2), za = node_at(b, ROW(2, 0) + 2), zb = node_at(b, ROW(2, 4) + 2);
  const float3 x = 0.125f * (x0 + x1 + x2 + x3) + 0.5f * (xb - xa), y = 0.125f * (s1 - s0 + s3 - s2) + 0.5f * (yb - ya);
  const float3 z = 0.125f * (s2 - s0 + s3 - s1) + 0.5f * (zb - za);
  const float ratio = dot(x, cross(y, z)) * volume_ratio / 64.0f;
  if (!(ratio > LEAST_RATIO && ratio < MOST_RATIO) || !set_inverse(c, m, x, y, z)) return false;
  set_term(c->squares, by_rows(c->inverse, 2.0f * (xa + xb - 2.0f * m)));
  set_term(c->squares + 3, by_rows(c->inverse, 2.0f * (ya + yb - 2.0f * m)));
  set_term(c->squares + 6, by_rows(c->inverse, 2.0f * (za + zb - 2.0f * m)));
  set_term(c->products, by_rows(c->inverse, (s0 - s1 - s2 + s3) * 0.5f));
  set_term(c->products + 3, by_rows(c->inverse, (x3 + x2 - x1 - x0) * 0.5f));
  set_term(c->products + 6, by_rows(c->inverse, (x3 - x2 + x1 - x0) * 0.5f));
  set_term(c->cube, by_rows(c->inverse, x3 - x2 - x1 + x0));
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
  vstore3(convert_float3(first_node) + 2.0f, 0, c->middle);
  c->slack = most * 1.3f, c->core = 0.5f + GROW, c->reach = grown ? 0.625f : c->core;
  const float3 pad = (c->reach - 0.5f + 0.5f * c->slack) * (fabs(x) + fabs(y) + fabs(z)) + 1e-3f;
  vstore3(convert_int3_sat(ceil(lo - pad)), 0, box), vstore3(convert_int3_sat(floor(hi + pad)), 0, box + 3);
  return true;
}

// How far the inverse misses the carried nodes of the brick, template voxels.
static float greatest_error(const KvxBlock* b, global const uint* carried, const KvxCell* c) {
  const int8 node = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
  const float8 x = convert_float8(node) * 0.25f - 0.5f;
  float8 worst = 0.0f;
  for (int k = 0; k < 5; ++k) {
    const int layer = (int)(kvx_bits_from(carried, 0, k) & 0x1FFFFFF);
    for (int j = 0; j < 5; ++j) {
      const int bits = (layer >> (5 * j)) & 31;
      if (!bits) continue;
      const int8 counts = (int8)(bits) << (31 - node);
      const float y = 0.25f * j - 0.5f, z = 0.25f * k - 0.5f;
      const float8 px = vload8(5 * k + j, b->at[0]), py = vload8(5 * k + j, b->at[1]), pz = vload8(5 * k + j, b->at[2]);
      for (int axis = 0; axis < 3; ++axis) {
        const float* sq = c->squares + axis;
        const float* pr = c->products + axis;
        const float* a = c->inverse + 4 * axis;
        const float constant_part = sq[3] * y * y + sq[6] * z * z + pr[0] * y * z - a[3] + (axis == 1 ? y : axis == 2 ? z : 0.0f);
        const float linear_part = pr[3] * z + pr[6] * y + c->cube[axis] * y * z + (axis == 0 ? 1.0f : 0.0f);
        const float8 error = constant_part + x * (linear_part + sq[0] * x) - (a[0] * px + (a[1] * py + a[2] * pz));
        worst = fmax(worst, select((float8)(0.0f), fabs(error), counts));
      }
    }
  }
  const float4 four = fmax(worst.lo, worst.hi);
  const float most = 4.0f * fmax(fmax(four.x, four.y), fmax(four.z, four.w));
  return most < INFINITY ? most : INFINITY;  // NaN is no fit
}
