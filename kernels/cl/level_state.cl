// What a whole level shows under its field, and the composition of a sweep's steps with the field.
// One work-item per active cell; `keep`: cells that have not changed keep what they have.
// CPU twins: kernels/reference/block_moments.cpp.
#include "block.cl.h"
#include "grid.cl.h"
#include "inline.cl.h"

// From a cell's first voxel to another of it, in memory.
static int kvx_to_corner(const int4 size, const int corner) {
  return ((corner >> 2) * size.y + ((corner >> 1) & 1)) * size.x + (corner & 1);
}

// seen(v) = scan at start(v + d(v)), the scan by the coefficients of its spline; what was seen before where
// nothing has changed. All voxels of a cell take each step together: one waits for memory while others do.
kernel void see(global const int* active, const int count, const int4 cells, const KvxGrid grid,
                global const float4* start, global const float4* field, global const float* scan,
                const int4 scan_size, global const uchar* changed, const int keep, global const float* before,
                global float* seen) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const bool look = changed[active[n]];
  if (!look && keep) return;
  const int3 first = 2 * kvx_cell(cells, active[n]);
  const int v = (first.z * grid.size.y + first.y) * grid.size.x + first.x;
  if (!look) {
    for (int corner = 0; corner < 8; ++corner) {
      const int u = v + kvx_to_corner(grid.size, corner);
      seen[u] = before[u];
    }
    return;
  }
  const KvxPerMm per_mm = kvx_per_mm(grid);
  float3 places[8];
  for (int corner = 0; corner < 8; ++corner) {
    const int3 at = first + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
    places[corner] = kvx_shifted(per_mm, grid.size, at, field[v + kvx_to_corner(grid.size, corner)].xyz);
  }
  for (int corner = 0; corner < 8; ++corner)
    places[corner] = kvx_sample4(start, grid.size, places[corner]).xyz;
  for (int corner = 0; corner < 8; ++corner)
    seen[v + kvx_to_corner(grid.size, corner)] = kvx_sample_spline(scan, scan_size, places[corner]);
}

// Whether a cell or one of those around it is marked.
static bool kvx_marked_near(global const uchar* marks, const int4 cells, const int3 cell) {
  const int3 lo = max(cell - 1, (int3)(0)), hi = min(cell + 1, cells.xyz - 1);
  int marked = 0;
  for (int k = lo.z; k <= hi.z; ++k) {
    for (int j = lo.y; j <= hi.y; ++j) {
      for (int i = lo.x; i <= hi.x; ++i) marked |= marks[(k * cells.y + j) * cells.x + i];
    }
  }
  return marked != 0;
}

// Of a row of cells: linear between their centres, at the two voxels of the middle one.
KVX_INLINE float8 kvx_pair(const float4 before, const float4 middle, const float4 after) {
  return (float8)(mix(before, middle, 0.75f), mix(middle, after, 0.25f));
}

// The same at the four voxels of the middle one, of a slice of cells.
KVX_INLINE float16 kvx_four(global const float4* slice, const int3 x, const int3 rows) {
  global const float4 *a = slice + rows.x, *b = slice + rows.y, *c = slice + rows.z;
  const float8 before = kvx_pair(a[x.x], a[x.y], a[x.z]), middle = kvx_pair(b[x.x], b[x.y], b[x.z]),
               after = kvx_pair(c[x.x], c[x.y], c[x.z]);
  return (float16)(mix(before, middle, 0.75f), mix(middle, after, 0.25f));
}

// The same at all voxels of a cell, four numbers each, beyond the last cells as there.
KVX_INLINE void kvx_eight(global const float4* image, const int4 cells, const int3 cell, float* out) {
  const int3 lo = max(cell - 1, (int3)(0)), hi = min(cell + 1, cells.xyz - 1);
  const int3 x = (int3)(lo.x, cell.x, hi.x), rows = cells.x * (int3)(lo.y, cell.y, hi.y);
  const int slice = cells.x * cells.y;
  const float16 before = kvx_four(image + lo.z * slice, x, rows);
  const float16 middle = kvx_four(image + cell.z * slice, x, rows);
  const float16 after = kvx_four(image + hi.z * slice, x, rows);
  vstore16(mix(before, middle, 0.75f), 0, out);
  vstore16(mix(middle, after, 0.25f), 1, out);
}

// d'(v) = u(v) + d(v + u(v)), u = mobility * the cells' steps, linear between the cells' centres.
kernel void compose(global const int* active, const int count, const int4 cells, const KvxGrid grid,
                    global const float4* cell_steps, global const float* mobility, global const float4* field,
                    global const uchar* touched, const int keep, global uchar* changed,
                    global float4* trial) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const int3 cell = kvx_cell(cells, active[n]);
  const bool look = kvx_marked_near(touched, cells, cell);
  changed[active[n]] = look;
  if (!look && keep) return;
  const int3 first = 2 * cell;
  const int v = (first.z * grid.size.y + first.y) * grid.size.x + first.x;
  if (!look) {
    for (int corner = 0; corner < 8; ++corner) {
      const int u = v + kvx_to_corner(grid.size, corner);
      trial[u] = field[u];
    }
    return;
  }
  float steps[32];
  kvx_eight(cell_steps, cells, cell, steps);
  const KvxPerMm per_mm = kvx_per_mm(grid);
  float3 places[8];
  for (int corner = 0; corner < 8; ++corner) {
    const int3 at = first + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
    const float4 u = mobility[v + kvx_to_corner(grid.size, corner)] * vload4(corner, steps);
    vstore4(u, corner, steps);
    places[corner] = kvx_shifted(per_mm, grid.size, at, u.xyz);
  }
  for (int corner = 0; corner < 8; ++corner)
    trial[v + kvx_to_corner(grid.size, corner)] =
        vload4(corner, steps) + kvx_sample4(field, grid.size, places[corner]);
}

// The field's mean over each cell: as it is at the centre, where the cell's steps are. Beyond the active
// cells it was filled with 0.
kernel void cell_field(global const int* active, const int count, const int4 cells, const int4 size,
                       global const float4* field, global float4* out) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const int3 at = 2 * kvx_cell(cells, active[n]);
  global const float4* first = field + (at.z * size.y + at.y) * size.x + at.x;
  float4 sum = 0.0f;
  for (int corner = 0; corner < 8; ++corner)
    sum += first[((corner >> 2) * size.y + ((corner >> 1) & 1)) * size.x + (corner & 1)];
  out[active[n]] = 0.125f * sum;
}

// stiffness * laplacian of the cells' field, 0 on the border. `axis`: 1 / (2 spacing)^2 per axis in mm.
kernel void cell_curvature(global const int* active, const int count, const int4 cells,
                           global const float4* field, global const float* stiffness, const float4 axis,
                           global float4* out) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const int c = active[n], row = cells.x, slice = cells.x * cells.y;
  const int3 p = kvx_cell(cells, c);
  if (p.x == 0 || p.y == 0 || p.z == 0 || p.x == cells.x - 1 || p.y == cells.y - 1 || p.z == cells.z - 1)
    return;
  const float4 middle = 2.0f * field[c];
  out[c] = stiffness[c] * (axis.x * (field[c - 1] + field[c + 1] - middle) +
                           axis.y * (field[c - row] + field[c + row] - middle) +
                           axis.z * (field[c - slice] + field[c + slice] - middle));
}
