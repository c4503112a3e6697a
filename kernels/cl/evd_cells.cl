// Inverts the forward map in the posed bricks. A smooth brick becomes a cell in which evd_pull.cl inverts by
// a few multiplications; in others every unit cell finds what lands in it: those that fold are six
// tetrahedra, and where parts drew apart there are none. CPU twin: kernels/reference/evd_cells.cpp.
#include "inline.cl.h"
#include "evd_bricks.cl.h"
#include "evd_wide.cl.h"
#include "evd_block.cl.h"
#include "evd_fit.cl.h"
#include "evd_layer.cl.h"
#include "evd_land.cl.h"
#include "evd_newton.cl.h"
#include "evd_units.cl.h"

// One work-item per listed brick with cells. `shift` moves the posed nodes to another grid of the same
// lattice. used[0] counts chunks: more than `room` of them, run again with more. Which chunks a brick takes
// depends on the order of work-items, what is in them does not.
kernel void evd_cells(global const int* list, const int count, global const int* brick_at, const int4 bricks,
                      global const int4* first_nodes, global const float* posed, global const uint* tissue,
                      global const ulong* cuts, const float4 shift, const float volume_ratio,
                      const float4 posed_mm, const float4 template_mm, const int4 size, const int4 tiles,
                      const int room, volatile global int* used, global KvxCell* cells,
                      global KvxChunk* chunks, global KvxBrickCells* found) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int brick = list[item];
  global const uint* words = tissue + KVX_TISSUE_WORDS * (size_t)brick;
  global const ulong* brick_cuts = cuts + 2 * (size_t)brick;
  KvxBrickCells what = {{INT_MAX, INT_MAX, INT_MAX, INT_MIN, INT_MIN, INT_MIN}, 0, -1};
  KvxBlock block;
  load_block(brick_at, bricks, first_nodes[brick], posed, shift.xyz, &block);
  if (!misses_grid(&block, size)) {
    KvxCell c;
    if (fit_cell(&block, first_nodes[brick].xyz, words, brick_cuts[1] != 0, volume_ratio, &c, what.box)) {
      global const uint* inner = words + KVX_IS_INNER;
      c.all_inner = (inner[0] & inner[1] & inner[2]) == 0xFFFFFFFFu && inner[3] == 0x1FFFFFFFu;
      const uint4 bone = popcount(vload4(0, words + KVX_IS_BONE));
      c.bone_nodes = (int)(bone.x + bone.y + bone.z + bone.w);
      cells[item] = c, what.first_chunk = KVX_SMOOTH;
    } else {
      KvxSink sink;
      open_sink(&sink, chunks, used, room, first_nodes[brick].xyz);
      what.folded =
          land_units(&block, words, brick_cuts, volume_ratio, posed_mm, template_mm, size, tiles, &sink);
      close_sink(&sink, &what);
    }
  }
  found[item] = what;
}
