// One colour of a sweep over an elastic lattice: every node goes to where the energy of the frames around it
// is least (kernels/elastic_lattice.h). One work-item per segment: eight nodes of the colour side by side in
// a row. Nodes of a colour are in no common frame, so their order does not matter.
// Layout: kernels/elastic_sweeps.cpp. CPU twin: kernels/reference/elastic_relaxation.cpp.
#include "inline.cl.h"
#include "elastic_frames.cl.h"
#define KVX_SEGMENT 8

// Of the segment at `at` and those with nodes that share a frame with one of its own. Nothing lies before the
// first node of a row, nor behind its last: what is there in memory is of the segment's own colour, which
// others write meanwhile.
KVX_INLINE int last_stirred(global const int* stirred, const int at, const int4 beside) {
  const int half_row = beside.z / 2, in_half = at % half_row;
  const bool even = beside.x > 0;
  const bool has_before = !even || in_half != 0, has_after = even || in_half + KVX_SEGMENT != half_row;
  int last = 0;
#pragma unroll
  for (int row = 0; row < 9; ++row) {
    const int y = row % 3 - 1, z = row / 3 - 1;
    const int there = at + y * beside.z + z * beside.w;
    last = max(last, stirred[there / KVX_SEGMENT]);
    if (y != 0 && z != 0) continue;  // no frame has a node there that is beside along x as well
    if (has_before) last = max(last, stirred[(there + beside.x) / KVX_SEGMENT]);
    if (has_after) last = max(last, stirred[(there + beside.y + KVX_SEGMENT - 1) / KVX_SEGMENT]);
  }
  return last;
}

// `beside`: how far in memory the nodes before and after along x lie, a row, a slice. `stretch`: 1 / spacing
// at rest (mm), w: over-relaxation. `tissue`: stiffness against changes of volume, of frames through air; z:
// 0 where no stiffness is given. `hold`: values per plane of the holds (0: none), nodes per cell, values per
// half a row of nodes, rows per slice. `stirred`: per segment in memory the last sweep in which a node of it
// went further than `still_mm`; segments around which nothing did since the sweep before `sweep` are left be.
kernel void elastic_sweep(global const int* segments, const int count, const int plane, const int4 beside,
                          const float4 stretch, const float4 tissue, global const uchar* moves,
                          global const uchar* edges, global const float* stiffness, const int4 hold,
                          global const float* holds, global const float* held, global float* positions,
                          const float still_mm, global int* stirred, const int sweep) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int at = segments[item];
  if (last_stirred(stirred, at, beside) < sweep - 1) return;
  const int to[3][2] = {{beside.x, beside.y}, {-beside.z, beside.z}, {-beside.w, beside.w}};
  const float per_mm[3] = {stretch.x, stretch.y, stretch.z};
  const bool graded = tissue.z != 0.0f;
  const KvxEight p = load(positions, plane, at);
  KvxAround n;
  n.mine = graded ? vload8(0, stiffness + at) : (float8)(1.0f);
#pragma unroll
  for (int face = 0; face < 6; ++face) {
    const int a = face >> 1, side = face & 1, other = at + to[a][side];
    n.edge[a][side] = times(side ? per_mm[a] : -per_mm[a], minus(load(positions, plane, other), p));
    n.joined[a][side] = edge(edges + a * plane, side ? at : other, tissue.y);
    n.stiff[a][side] = graded ? vload8(0, stiffness + other) : (float8)(1.0f);
  }
  KvxLocal l = {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
  add_own(&l, &n, per_mm, tissue.x);
#pragma unroll
  for (int face = 0; face < 6; ++face) {  // a neighbour's frames that look back: only that edge moves
    const int a = face >> 1, side = face & 1, b = (a + 1) % 3, c = (a + 2) % 3;
    const int other = at + to[a][side];
    const KvxEight q = load(positions, plane, other);
    KvxEight across[2][2];
    float8 joined[2][2], stiff[2][2];
#pragma unroll
    for (int m = 0; m < 4; ++m) {
      const int axis = m < 2 ? b : c, s = m & 1, far = other + to[axis][s];
      across[m >> 1][s] = times(s ? per_mm[axis] : -per_mm[axis], minus(load(positions, plane, far), q));
      joined[m >> 1][s] = edge(edges + axis * plane, s ? other : far, tissue.y);
      stiff[m >> 1][s] = graded ? vload8(0, stiffness + far) : (float8)(1.0f);
    }
    const float weight = side ? -per_mm[a] : per_mm[a];
#pragma unroll
    for (int pair = 0; pair < 4; ++pair) {
      const int s = pair & 1, t = pair >> 1;
      const KvxEight cofactors = cross8(across[0][s], across[1][t]);
      const float8 frame = fmin(fmin(joined[0][s], joined[1][t]), n.joined[a][side]);
      const float8 most = fmax(fmax(n.mine, n.stiff[a][side]), fmax(stiff[0][s], stiff[1][t]));
      add(&l, times(weight, n.edge[a][side]), times(weight, cofactors), dot8(n.edge[a][side], cofactors),
          weight * weight, fmin(frame, most), tissue.x);
    }
  }
  if (hold.x) {
    const int row = at / (2 * hold.z), y = row % hold.w / 2, z = row / hold.w / 2;
    const int cell = hold.y == 1 ? at : (z * (hold.w / 2) + y) * hold.z + at % hold.z;
    add_hold(&l, minus(p, load(held, plane, at)), holds + cell, hold.x);
  }
  const int8 going = convert_int8(vload8(0, moves + at)) != 0 && l.shear > 0.0f;
  const KvxEight step = times(stretch.w, step_of(&l));
  if (any(going & (dot8(step, step) > still_mm * still_mm))) stirred[at / KVX_SEGMENT] = sweep;
  vstore8(select(p.x, p.x - step.x, going), 0, positions + at);
  vstore8(select(p.y, p.y - step.y, going), 0, positions + plane + at);
  vstore8(select(p.z, p.z - step.z, going), 0, positions + 2 * plane + at);
}
