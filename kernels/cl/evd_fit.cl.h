// Fits cells to the posed nodes of a brick. CPU twin: kernels/reference/evd_cells.cpp.
#define SMOOTH 0.08f       // template voxels by which the inverse of a cell of edge 4 or 2 may miss a node
#define SETTLED 0.004f     // template voxels left after the steps
#define MOST_STEPS 8
#define CONTRACTION 0.5f   // greatest slope of n in a cell of edge 4 or 2, and of edge 1, that is inverted by steps
#define CONTRACTION_UNIT 0.7f
#define FAIR 1.0f          // and a whole brick, where refining against its nodes settles
#define BEND 0.35f         // greatest change of slope in such a brick
#define GROW 0.1f          // template voxels by which cells overlap, more than neighbours of other sizes disagree
#define GROW_UNIT 0.02f    // against rounding
#define MIN_RATIO 0.001f   // volume ratios outside are no tissue
#define MAX_RATIO 20.0f

// The brick's posed 5x5x5 nodes, rows of eight that end with their last node.
typedef struct {
  float at[3][208];
} KvxBlock;
#define ROW(y, z) (8 * ((z) * 5 + (y)))

static float3 node_at(const KvxBlock* b, const int n) { return (float3)(b->at[0][n], b->at[1][n], b->at[2][n]); }

static void load_block(global const int* brick_at, const int4 bricks, const int4 first, global const float* posed,
                       const float3 shift, KvxBlock* block) {
  const int3 at = first.xyz >> 2;
  size_t near[8];
  for (int n = 0; n < 8; ++n) {
    const int3 b = at + (int3)(n & 1, (n >> 1) & 1, n >> 2);
    near[n] = (size_t)brick_at[(b.z * bricks.y + b.y) * bricks.x + b.x] * KVX_BRICK_FLOATS;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const float by = axis == 0 ? shift.x : axis == 1 ? shift.y : shift.z;
    for (int row = 0; row < 25; ++row) {
      const int y = row % 5, z = row / 5, side = 2 * (y == 4) + 4 * (z == 4);
      const int in_brick = axis * KVX_NODES + 16 * (z & 3) + 4 * (y & 3);
      const float4 four = vload4(0, posed + near[side] + in_brick) + by;
      const float last = posed[near[side + 1] + in_brick] + by;
      vstore8((float8)(four, last, last, last, last), 0, block->at[axis] + 8 * row);
    }
  }
}

static float greatest(const float3 v) { return fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z))); }
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

static void set_box(KvxBox* box, const float3 lo, const float3 hi, const float3 pad) {
  const int3 a = convert_int3_sat(ceil(lo - pad)), b = convert_int3_sat(floor(hi + pad));
  vstore3(a, 0, box->lo), vstore3(b, 0, box->hi);
}

static void set_place(KvxCell* c, const int3 first_node, const int3 at, const int s, const bool grown) {
  const float3 middle = convert_float3(first_node + at) + 0.5f * s;
  c->middle[0] = middle.x, c->middle[1] = middle.y, c->middle[2] = middle.z;
  c->first_node[0] = first_node.x, c->first_node[1] = first_node.y, c->first_node[2] = first_node.z;
  c->edge = s, c->nodes = -1;
  c->core = 0.5f + (s > 1 ? GROW : GROW_UNIT) / s, c->reach = grown ? 0.5f + 0.5f / s : c->core;
}

// Whether the trilinear map of eight corners keeps its hand at each of them.
static bool stays_upright(const float3* p, const float volume_ratio) {
  bool upright = true;
  for (int n = 0; n < 8; ++n) {
    const float3 x = p[n | 1] - p[n & 6], y = p[n | 2] - p[n & 5], z = p[n | 4] - p[n & 3];
    upright = upright && dot(x, cross(y, z)) * volume_ratio > MIN_RATIO;
  }
  return upright;
}

// The whole cell of edge s at block node (i, j, k); false where steps would not settle or its volume is out of bounds.
static bool fit_cell(const KvxBlock* b, const int3 first_node, const int3 at, const int s, const bool grown, const float volume_ratio,
                     KvxCell* c, KvxBox* box) {
  const int n0 = ROW(at.y, at.z) + at.x, dx = s, dy = 8 * s, dz = 40 * s;
  float3 p[8], lo = INFINITY, hi = -INFINITY;
  for (int n = 0; n < 8; ++n) {
    p[n] = node_at(b, n0 + ((n & 1) ? dx : 0) + ((n & 2) ? dy : 0) + ((n & 4) ? dz : 0));
    lo = fmin(lo, p[n]), hi = fmax(hi, p[n]);
  }
  const float3 x0 = p[1] - p[0], x1 = p[3] - p[2], x2 = p[5] - p[4], x3 = p[7] - p[6];
  const float3 s0 = p[1] + p[0], s1 = p[3] + p[2], s2 = p[5] + p[4], s3 = p[7] + p[6];
  float3 m = (s0 + s1 + s2 + s3) / 8.0f, x = (x0 + x1 + x2 + x3) / 4.0f;
  float3 y = (s1 - s0 + s3 - s2) / 4.0f, z = (s2 - s0 + s3 - s1) / 4.0f, xx = 0.0f, yy = 0.0f, zz = 0.0f;
  if (s > 1) {
    const int half_x = dx / 2, half_y = dy / 2, half_z = dz / 2, centre = n0 + half_x + half_y + half_z;
    const float3 xa = node_at(b, centre - half_x), xb = node_at(b, centre + half_x), ya = node_at(b, centre - half_y);
    const float3 yb = node_at(b, centre + half_y), za = node_at(b, centre - half_z), zb = node_at(b, centre + half_z);
    m = node_at(b, centre);
    xx = 2.0f * (xa + xb - 2.0f * m), yy = 2.0f * (ya + yb - 2.0f * m), zz = 2.0f * (za + zb - 2.0f * m);
    x = 0.5f * (x + xb - xa), y = 0.5f * (y + yb - ya), z = 0.5f * (z + zb - za);
  }
  const float ratio = dot(x, cross(y, z)) * volume_ratio / (s * s * s);
  if (!(ratio > (s > 1 ? 0.08f : MIN_RATIO) && ratio < (s > 1 ? 5.0f : MAX_RATIO)) || !set_inverse(c, m, x, y, z)) return false;
  set_term(c->squares, by_rows(c->inverse, xx)), set_term(c->squares + 3, by_rows(c->inverse, yy));
  set_term(c->squares + 6, by_rows(c->inverse, zz));
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
  const bool by_steps = slope < (s > 1 ? CONTRACTION : CONTRACTION_UNIT);
  if (!by_steps && !(s == 1 && stays_upright(p, volume_ratio))) return false;
  int steps = by_steps ? 0 : KVX_NEWTON;
  for (float left = most * s; by_steps && left > SETTLED && steps < MOST_STEPS; left *= slope) ++steps;
  c->steps = steps, c->slack = most * 1.3f, c->tetrahedron = -1, c->inverted = 0, c->all_inner = 0;
  set_place(c, first_node, at, s, grown);
  set_box(box, lo, hi, (c->reach - 0.5f + (s > 1 ? 0.5f * c->slack : 0.0f)) * (fabs(x) + fabs(y) + fabs(z)) + 1e-3f);
  return true;
}
