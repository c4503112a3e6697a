// Cuts the posed bricks into cells on which the forward map is inverted by a few multiplications: a smooth brick stays
// whole, a fairly smooth one is refined against its nodes; of others the eighths that are smooth, else unit cells, and
// tetrahedra where those fold. CPU twin: kernels/reference/evd_cells.cpp.
#include "evd_bricks.cl.h"
#include "evd_fit.cl.h"
#define MAX_STRETCH 4.0f   // of an edge that touches air: beyond it, two parts drew away from each other
#define TORN 1.5f          // of an edge between parts that may draw apart

#define MOST_PARTS 48      // cells of an eighth: six tetrahedra in each of eight unit cells

typedef struct {
  KvxCell cells[MOST_PARTS];
  int count;
  KvxBrickCells found;
} KvxSink;

static void cover(KvxBrickCells* found, const KvxCell* c) {
  for (int a = 0; a < 3; ++a) {
    found->box[a] = min(found->box[a], c->box[a]);
    found->box[a + 3] = max(found->box[a + 3], c->box[a + 3]);
  }
}

static void take(KvxSink* sink, const KvxCell* c) {
  cover(&sink->found, c);
  sink->cells[sink->count++] = *c;
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
  const int of_body = tissue_nodes(tissue, 0, at, 1);
  const bool all_body = of_body == 8, touches_body = of_body > 0;
  const int slot = 16 * at.z + 4 * at.y + at.x, n0 = ROW(at.y, at.z) + at.x;
  const bool cut = (cuts[0] >> slot) & 1, grown = (cuts[1] >> slot) & 1;
  const float most = !all_body ? MAX_STRETCH : TORN;
  if ((!all_body || cut) && greatest_stretch(b, n0, posed_mm, template_mm) > most) return;
  KvxCell c;
  const bool fits = fit_cell(b, first, at, 1, grown, volume_ratio, &c);
  c.all_body = all_body;
  if (fits) {
    take(sink, &c);
  } else if (touches_body) {  // air that folds is left out
    set_place(&c, first, at, 1, grown);
    if (take_tetrahedra(b, n0, volume_ratio, &c, sink) && all_body) ++sink->found.folded;
  }
}

// An eighth of a brick that is not smooth, as one cell or as unit cells.
static void take_eighth(const KvxBlock* b, const int3 first, const int3 at, global const uint* tissue, global const ulong* cuts,
                        const float volume_ratio, const float4 posed_mm, const float4 template_mm, KvxSink* sink) {
  if (!tissue_nodes(tissue, 4, at, 2)) return;
  const ulong units = 0x330033ul << (16 * at.z + 4 * at.y + at.x);
  KvxCell c;
  if (fit_cell(b, first, at, 2, (cuts[1] & units) != 0, volume_ratio, &c) && greatest_error(b, tissue + 4, at, &c) < SMOOTH) {
    c.all_body = tissue_nodes(tissue, 0, at, 2) == 27;
    take(sink, &c);
    return;
  }
  for (int n = 0; n < 8; ++n) {
    take_unit(b, first, at + (int3)(n & 1, (n >> 1) & 1, n >> 2), tissue, cuts, volume_ratio, posed_mm, template_mm, sink);
  }
}

// The brick as one cell, if need be refined against its nodes; false where that would not settle.
static bool fit_brick(const KvxBlock* b, const int3 first, global const uint* tissue, const bool grown, const float volume_ratio,
                      KvxCell* c) {
  if (!fit_cell(b, first, (int3)(0), 4, grown, volume_ratio, c)) return false;
  c->all_body = (tissue[0] & tissue[1] & tissue[2]) == 0xFFFFFFFFu && tissue[3] == 0x1FFFFFFFu;
  const float error = greatest_error(b, tissue + 4, (int3)(0), c);
  if (error < SMOOTH) return true;
  if (!(error < FAIR && greatest_bend(b, c) < BEND)) return false;
  c->nodes = 0, c->steps = min(c->steps, 1), c->slack += error * 0.3f;
  for (int a = 0; a < 3; ++a) c->box[a] -= 1, c->box[a + 3] += 1;
  return true;
}

// One work-item per listed brick with cells. `ranges`: eight per listed brick, first cell and number of cells, in order.
// `shift` moves the posed nodes to another grid of the same lattice.
// `used`: cells and blocks of nodes taken so far beyond the first `count` cells; more than there is room for: run again with
// more. Which block or stretch of cells a brick takes depends on the order of work-items, what is in them does not.
kernel void evd_cells(global const int* list, const int count, global const int* brick_at, const int4 bricks,
                      global const int4* first_nodes, global const float* posed, global const uint* tissue,
                      global const ulong* cuts, const float4 shift, const float volume_ratio, const float4 posed_mm,
                      const float4 template_mm, const int4 room, volatile global int* used, global KvxCell* cells,
                      global float4* nodes, global int2* ranges, global KvxBrickCells* found) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[item];
  const int3 first = first_nodes[brick].xyz;
  global const uint* words = tissue + 8 * (size_t)brick;
  global const ulong* brick_cuts = cuts + 2 * (size_t)brick;
  KvxBlock block;
  load_block(brick_at, bricks, first_nodes[brick], posed, shift.xyz, &block);
  KvxSink sink;
  sink.found = (KvxBrickCells){{INT_MAX, INT_MAX, INT_MAX, INT_MIN, INT_MIN, INT_MIN}, 0, 0};
  for (int part = 0; part < 8; ++part) ranges[8 * item + part] = (int2)(0, 0);
  KvxCell c;
  if (fit_brick(&block, first, words, brick_cuts[1] != 0, volume_ratio, &c)) {
    if (c.nodes == 0) {
      c.nodes = atomic_inc(used + 1);
      for (int n = 0; c.nodes < room.y && n < KVX_BLOCK_NODES; ++n) {
        nodes[(size_t)c.nodes * KVX_BLOCK_NODES + n] = (float4)(node_at(&block, 8 * (n / 5) + n % 5), 0.0f);
      }
    }
    cells[item] = c;
    cover(&sink.found, &c);
    ranges[8 * item] = (int2)(item, 1);
  } else {
    for (int part = 0; part < 8; ++part) {
      sink.count = 0;
      take_eighth(&block, first, 2 * (int3)(part & 1, (part >> 1) & 1, part >> 2), words, brick_cuts, volume_ratio, posed_mm,
                  template_mm, &sink);
      if (sink.count == 0) continue;
      const int start = count + atomic_add(used, sink.count);
      ranges[8 * item + part] = (int2)(start, sink.count);
      for (int n = 0; start + sink.count <= room.x && n < sink.count; ++n) cells[start + n] = sink.cells[n];
    }
  }
  found[item] = sink.found;
}
