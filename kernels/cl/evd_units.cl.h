// Unit cells of the inverse map: as they are where they can be inverted by steps, tetrahedra where they fold, none where parts
// drew apart. CPU twin: kernels/reference/evd_cells.cpp.
#define MAX_STRETCH 4.0f   // of an edge that touches air: beyond it, two parts drew away from each other
#define TORN 1.5f          // of an edge between parts that may draw apart

#define MOST_PARTS 48      // cells of an eighth: six tetrahedra in each of eight unit cells

typedef struct {
  KvxCell cells[MOST_PARTS];
  KvxBox boxes[MOST_PARTS];
  int count;
  bool partly;  // in the posed grid: cells that miss it are left out
  KvxBrickCells found;
} KvxSink;

#define INSIDE 0
#define PARTLY 1
#define OUTSIDE 2

// Whether a unit cell of nodes in lo .. hi misses the grid; it reaches at most half its edges beyond.
static bool box_misses(const float3 lo, const float3 hi, const int4 size) {
  const float3 pad = 1.5f * (hi - lo) + 0.01f;
  return any(hi + pad < 0.0f) || any(lo - pad > convert_float3(size.xyz - 1));
}

static bool unit_misses(const KvxBlock* b, const int n0, const int4 size) {
  float3 lo = INFINITY, hi = -INFINITY;
  for (int n = 0; n < 8; ++n) {
    const float3 p = node_at(b, n0 + (n & 1) + 8 * ((n >> 1) & 1) + 40 * (n >> 2));
    lo = fmin(lo, p), hi = fmax(hi, p);
  }
  return box_misses(lo, hi, size);
}

// The least of a brick's nodes along an axis, or of their negatives.
static float least_node(const float* at, const float sign) {
  float8 least = sign * vload8(0, at);
  for (int row = 1; row < 25; ++row) {
    const float8 v = sign * vload8(row, at);
    least = v < least ? v : least;
  }
  const float4 four = fmin(least.lo, least.hi);
  return fmin(fmin(four.x, four.y), fmin(four.z, four.w));
}

// Where the brick is against the grid; its cells reach less than half its width beyond it.
static int side_of_grid(const KvxBlock* b, const int4 size) {
  const float3 lo = (float3)(least_node(b->at[0], 1.0f), least_node(b->at[1], 1.0f), least_node(b->at[2], 1.0f));
  const float3 hi = -(float3)(least_node(b->at[0], -1.0f), least_node(b->at[1], -1.0f), least_node(b->at[2], -1.0f));
  const float3 pad = 0.5f * (hi - lo) + 1.0f;
  if (any(hi + pad < 0.0f) || any(lo - pad > convert_float3(size.xyz - 1))) return OUTSIDE;
  return all(lo >= 0.0f) && all(hi <= convert_float3(size.xyz - 1)) ? INSIDE : PARTLY;
}

static void cover(KvxBrickCells* found, const KvxBox* box) {
  for (int a = 0; a < 3; ++a) {
    found->box[a] = min(found->box[a], box->lo[a]);
    found->box[a + 3] = max(found->box[a + 3], box->hi[a]);
  }
}

static void take(KvxSink* sink, const KvxCell* c, const KvxBox* box) {
  cover(&sink->found, box);
  sink->boxes[sink->count] = *box;
  sink->cells[sink->count++] = *c;
}

static float greatest_stretch(const KvxBlock* b, const int n0, const float4 posed_mm, const float4 template_mm) {
  const int step[3] = {1, 8, 40};
  const float mm[3] = {template_mm.x, template_mm.y, template_mm.z};
  float most = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = step[(axis + 1) % 3], v = step[(axis + 2) % 3];
    for (int side = 0; side < 4; ++side) {
      const int n = n0 + (side & 1) * u + (side >> 1) * v;
      most = fmax(most, length((node_at(b, n + step[axis]) - node_at(b, n)) * posed_mm.xyz) / mm[axis]);
    }
  }
  return most;
}

// The six tetrahedra of a unit cell; returns whether one is inside out.
static bool take_tetrahedra(const KvxBlock* b, const int n0, const float volume_ratio, KvxCell* c, KvxSink* sink) {
  const int step[3] = {1, 8, 40};
  bool turned = false;
  for (int tet = 0; tet < 6; ++tet) {
    constant int* path = KVX_PATH + 3 * tet;
    const float3 v0 = node_at(b, n0), v1 = node_at(b, n0 + step[path[0]]);
    const float3 v2 = node_at(b, n0 + step[path[0]] + step[path[1]]), v3 = node_at(b, n0 + 49);
    float3 column[3];
    column[path[0]] = v1 - v0, column[path[1]] = v2 - v1, column[path[2]] = v3 - v2;
    const float ratio = dot(column[0], cross(column[1], column[2])) * volume_ratio;
    turned = turned || !(ratio > 0.0f);
    if (!(fabs(ratio) > MIN_RATIO && fabs(ratio) < MAX_RATIO)) continue;
    if (!set_inverse(c, 0.5f * (v0 + v3), column[0], column[1], column[2])) continue;
    c->tetrahedron = tet, c->inverted = ratio < 0.0f, c->steps = 0, c->slack = 0.0f;
    KvxBox box;
    set_box(&box, fmin(fmin(v0, v1), fmin(v2, v3)), fmax(fmax(v0, v1), fmax(v2, v3)),
            (c->reach - 0.5f) * (fabs(column[0]) + fabs(column[1]) + fabs(column[2])) + 1e-3f);
    take(sink, c, &box);
  }
  return turned;
}

static void take_unit(const KvxBlock* b, const int3 first, const int3 at, global const uint* tissue, global const ulong* cuts,
                      const float volume_ratio, const float4 posed_mm, const float4 template_mm, const int4 size,
                      KvxSink* sink) {
  if (!(kvx_bits_from(tissue, KVX_IS_CARRIED, at) & KVX_UNIT_BITS)) return;
  const ulong of_body = kvx_bits_from(tissue, KVX_IS_BODY, at) & KVX_UNIT_BITS;
  const bool all_body = of_body == KVX_UNIT_BITS, touches_body = of_body != 0;
  const int slot = 16 * at.z + 4 * at.y + at.x, n0 = ROW(at.y, at.z) + at.x;
  if (sink->partly && unit_misses(b, n0, size)) return;
  const bool cut = (cuts[0] >> slot) & 1, grown = (cuts[1] >> slot) & 1;
  const float most = !all_body ? MAX_STRETCH : TORN;
  if ((!all_body || cut) && greatest_stretch(b, n0, posed_mm, template_mm) > most) return;
  KvxCell c;
  KvxBox box;
  if (fit_cell(b, first, at, 1, grown, volume_ratio, &c, &box)) {
    c.all_inner = (kvx_bits_from(tissue, KVX_IS_INNER, at) & KVX_UNIT_BITS) == KVX_UNIT_BITS;
    take(sink, &c, &box);
  } else if (touches_body) {  // air that folds is left out
    set_place(&c, first, at, 1, grown);
    c.all_inner = (kvx_bits_from(tissue, KVX_IS_INNER, at) & KVX_UNIT_BITS) == KVX_UNIT_BITS;
    if (take_tetrahedra(b, n0, volume_ratio, &c, sink) && all_body) ++sink->found.folded;
  }
}
