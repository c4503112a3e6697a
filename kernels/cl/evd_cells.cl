// Cuts the posed bricks into cells on which the forward map is inverted by a few multiplications: a smooth brick stays
// whole, a fairly smooth one is refined against its nodes; of others the eighths that are smooth, else unit cells, and
// tetrahedra where those fold. CPU twin: kernels/reference/evd_cells.cpp.
#include "evd_bricks.cl.h"
#include "evd_fit.cl.h"
#include "evd_misfit.cl.h"
#include "evd_units.cl.h"

// An eighth of a brick that is not smooth, as one cell or as unit cells.
static void take_eighth(const KvxBlock* b, const int3 first, const int3 at, global const uint* tissue, global const ulong* cuts,
                        const float volume_ratio, const float4 posed_mm, const float4 template_mm, const int4 size,
                        KvxSink* sink) {
  if (!(kvx_bits_from(tissue, KVX_IS_CARRIED, at) & KVX_EIGHTH_BITS)) return;
  const ulong units = 0x330033ul << (16 * at.z + 4 * at.y + at.x);
  KvxCell c;
  KvxBox box;
  if (fit_cell(b, first, at, 2, (cuts[1] & units) != 0, volume_ratio, &c, &box) &&
      greatest_error(b, tissue + KVX_IS_CARRIED, at, &c) < SMOOTH) {
    c.all_inner = (kvx_bits_from(tissue, KVX_IS_INNER, at) & KVX_EIGHTH_BITS) == KVX_EIGHTH_BITS;
    take(sink, &c, &box);
    return;
  }
  for (int n = 0; n < 8; ++n) {
    take_unit(b, first, at + (int3)(n & 1, (n >> 1) & 1, n >> 2), tissue, cuts, volume_ratio, posed_mm, template_mm, size, sink);
  }
}

// The brick as one cell, if need be refined against its nodes; false where that would not settle.
static bool fit_brick(const KvxBlock* b, const int3 first, global const uint* tissue, const bool grown, const float volume_ratio,
                      KvxCell* c, KvxBox* box) {
  if (!fit_cell(b, first, (int3)(0), 4, grown, volume_ratio, c, box)) return false;
  global const uint* inner = tissue + KVX_IS_INNER;
  c->all_inner = (inner[0] & inner[1] & inner[2]) == 0xFFFFFFFFu && inner[3] == 0x1FFFFFFFu;
  const float error = greatest_error(b, tissue + KVX_IS_CARRIED, (int3)(0), c);
  if (error < SMOOTH) return true;
  if (!(error < FAIR && greatest_bend(b, c) < BEND)) return false;
  c->nodes = 0, c->steps = min(c->steps, 1), c->slack += error * 0.3f;
  for (int a = 0; a < 3; ++a) --box->lo[a], ++box->hi[a];
  return true;
}

// One work-item per listed brick with cells. `ranges`: eight per listed brick, first cell and number of cells, in order.
// `size`: of the posed grid; what misses it is left out. `shift` moves the posed nodes to another grid of the same lattice.
// `used`: cells and blocks of nodes taken so far beyond the first `count` cells; more than there is room for: run again with
// more. Which block or stretch of cells a brick takes depends on the order of work-items, what is in them does not.
kernel void evd_cells(global const int* list, const int count, global const int* brick_at, const int4 bricks,
                      global const int4* first_nodes, global const float* posed, global const uint* tissue,
                      global const ulong* cuts, const float4 shift, const float volume_ratio, const float4 posed_mm,
                      const float4 template_mm, const int4 size, const int4 room, volatile global int* used, global KvxCell* cells,
                      global KvxBox* boxes, global float4* nodes, global int2* ranges, global KvxBrickCells* found) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[item];
  const int3 first = first_nodes[brick].xyz;
  global const uint* words = tissue + KVX_TISSUE_WORDS * (size_t)brick;
  global const ulong* brick_cuts = cuts + 2 * (size_t)brick;
  KvxBlock block;
  load_block(brick_at, bricks, first_nodes[brick], posed, shift.xyz, &block);
  KvxSink sink;
  sink.found = (KvxBrickCells){{INT_MAX, INT_MAX, INT_MAX, INT_MIN, INT_MIN, INT_MIN}, 0, 0};
  for (int part = 0; part < 8; ++part) ranges[8 * item + part] = (int2)(0, 0);
  const int side = side_of_grid(&block, size);
  if (side == OUTSIDE) {
    found[item] = sink.found;
    return;
  }
  sink.partly = side == PARTLY;
  KvxCell c;
  KvxBox box;
  if (fit_brick(&block, first, words, brick_cuts[1] != 0, volume_ratio, &c, &box)) {
    if (c.nodes == 0) {
      c.nodes = atomic_inc(used + 1);
      for (int n = 0; c.nodes < room.y && n < KVX_BLOCK_NODES; ++n) {
        nodes[(size_t)c.nodes * KVX_BLOCK_NODES + n] = (float4)(node_at(&block, 8 * (n / 5) + n % 5), 0.0f);
      }
    }
    cells[item] = c, boxes[item] = box;
    cover(&sink.found, &box);
    ranges[8 * item] = (int2)(item, 1);
  } else {
    for (int part = 0; part < 8; ++part) {
      sink.count = 0;
      take_eighth(&block, first, 2 * (int3)(part & 1, (part >> 1) & 1, part >> 2), words, brick_cuts, volume_ratio, posed_mm,
                  template_mm, size, &sink);
      if (sink.count == 0) continue;
      const int start = count + atomic_add(used, sink.count);
      ranges[8 * item + part] = (int2)(start, sink.count);
      for (int n = 0; start + sink.count <= room.x && n < sink.count; ++n)
        cells[start + n] = sink.cells[n], boxes[start + n] = sink.boxes[n];
    }
  }
  found[item] = sink.found;
}
