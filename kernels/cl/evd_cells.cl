// Cuts the posed bricks into cells on which the forward map is inverted by a few multiplications: a brick that is smooth
// stays whole, its eighths where those are, unit cells elsewhere, tetrahedra where those fold. CPU twin: kernels/reference/evd_cells.cpp.
#include "evd_fit.cl.h"
#define MAX_STRETCH 4.0f   // of an edge that touches air: beyond it, two parts drew away from each other
#define TORN 1.5f          // of an edge between parts that may draw apart

typedef struct {
  global KvxCell* cells;   // 0: only count
  KvxBrickCells found;
} KvxSink;

static void take(KvxSink* sink, const KvxCell* c) {
  for (int a = 0; a < 3; ++a) {
    sink->found.box[a] = min(sink->found.box[a], c->box[a]);
    sink->found.box[a + 3] = max(sink->found.box[a + 3], c->box[a + 3]);
  }
  if (sink->cells) sink->cells[sink->found.cells] = *c;
  ++sink->found.cells;
}

// How many of the nodes of the cell of edge s at `at` are body (word 0) or carried (word 4).
static int tissue_nodes(global const uint* tissue, const int word, const int3 at, const int s) {
  int sum = 0;
  for (int z = at.z; z <= at.z + s; ++z) {
    for (int y = at.y; y <= at.y + s; ++y) {
      for (int x = at.x; x <= at.x + s; ++x) sum += kvx_tissue(tissue, word, x, y, z);
    }
  }
  return sum;
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
    set_box(c, fmin(fmin(v0, v1), fmin(v2, v3)), fmax(fmax(v0, v1), fmax(v2, v3)),
            (c->reach - 0.5f) * (fabs(column[0]) + fabs(column[1]) + fabs(column[2])) + 1e-3f);
    take(sink, c);
  }
  return turned;
}

static void take_unit(const KvxBlock* b, const int3 first, const int3 at, global const uint* tissue, global const ulong* cuts,
                      const float volume_ratio, const float4 posed_mm, const float4 template_mm, KvxSink* sink) {
  if (!tissue_nodes(tissue, 4, at, 1)) return;
  const bool all_body = tissue_nodes(tissue, 0, at, 1) == 8;
  const int slot = 16 * at.z + 4 * at.y + at.x, n0 = ROW(at.y, at.z) + at.x;
  const bool cut = (cuts[0] >> slot) & 1, grown = (cuts[1] >> slot) & 1;
  const float most = !all_body ? MAX_STRETCH : TORN;
  if ((!all_body || cut) && greatest_stretch(b, n0, posed_mm, template_mm) > most) return;
  KvxCell c;
  const bool fits = fit_cell(b, first, at, 1, grown, volume_ratio, &c);
  c.all_body = all_body;
  if (fits) {
    take(sink, &c);
  } else {
    set_place(&c, first, at, 1, grown);
    if (take_tetrahedra(b, n0, volume_ratio, &c, sink) && all_body) ++sink->found.folded;
  }
}

// Eighths and unit cells of a brick that is not smooth.
static void take_parts(const KvxBlock* b, const int3 first, global const uint* tissue, global const ulong* cuts,
                       const float volume_ratio, const float4 posed_mm, const float4 template_mm, KvxSink* sink) {
  for (int part = 0; part < 8; ++part) {
    const int3 at = 2 * (int3)(part & 1, (part >> 1) & 1, part >> 2);
    if (!tissue_nodes(tissue, 4, at, 2)) continue;
    const ulong units = 0x330033ul << (16 * at.z + 4 * at.y + at.x);
    KvxCell c;
    if (fit_cell(b, first, at, 2, (cuts[1] & units) != 0, volume_ratio, &c) && is_smooth(b, at, &c)) {
      c.all_body = tissue_nodes(tissue, 0, at, 2) == 27;
      take(sink, &c);
      continue;
    }
    for (int n = 0; n < 8; ++n) {
      take_unit(b, first, at + (int3)(n & 1, (n >> 1) & 1, n >> 2), tissue, cuts, volume_ratio, posed_mm, template_mm, sink);
    }
  }
}

static KvxSink empty_sink(global KvxCell* cells) {
  const KvxSink sink = {cells, {{INT_MAX, INT_MAX, INT_MAX, INT_MIN, INT_MIN, INT_MIN}, 0, 0}};
  return sink;
}

// One work-item per listed brick with cells. A smooth brick leaves its one cell at its place in the list; of the others
// the cells are counted. `shift` moves the posed nodes to another grid of the same lattice.
kernel void evd_cells(global const int* list, const int count, global const int* brick_at, const int4 bricks,
                      global const int4* first_nodes, global const float* posed, global const uint* tissue,
                      global const ulong* cuts, const float4 shift, const float volume_ratio, const float4 posed_mm,
                      const float4 template_mm, global KvxCell* cells, global KvxBrickCells* found) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[item];
  const int4 first = first_nodes[brick];
  KvxBlock block;
  load_block(brick_at, bricks, first, posed, shift.xyz, &block);
  KvxCell c;
  KvxSink sink = empty_sink(0);
  if (fit_cell(&block, first.xyz, (int3)(0), 4, cuts[2 * brick + 1] != 0, volume_ratio, &c) && is_smooth(&block, (int3)(0), &c)) {
    global const uint* body = tissue + 8 * brick;
    c.all_body = (body[0] & body[1] & body[2]) == 0xFFFFFFFFu && body[3] == 0x1FFFFFFFu;
    take(&sink, &c);
    cells[item] = c;
    sink.found.cells = 0;
  } else {
    take_parts(&block, first.xyz, tissue + 8 * brick, cuts + 2 * brick, volume_ratio, posed_mm, template_mm, &sink);
    sink.found.cells = max(sink.found.cells, 0) + 1;  // 0 says that the brick is whole
  }
  found[item] = sink.found;
}

// The cells of the bricks that are not smooth: of list[fine[i]], from cells[offsets[i]] on.
kernel void evd_fine_cells(global const int* list, global const int* fine, global const int* offsets, const int count,
                           global const int* brick_at, const int4 bricks, global const int4* first_nodes,
                           global const float* posed, global const uint* tissue, global const ulong* cuts, const float4 shift,
                           const float volume_ratio, const float4 posed_mm, const float4 template_mm, global KvxCell* cells) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[fine[item]];
  const int4 first = first_nodes[brick];
  KvxBlock block;
  load_block(brick_at, bricks, first, posed, shift.xyz, &block);
  KvxSink sink = empty_sink(cells + offsets[item]);
  take_parts(&block, first.xyz, tissue + 8 * brick, cuts + 2 * brick, volume_ratio, posed_mm, template_mm, &sink);
}
