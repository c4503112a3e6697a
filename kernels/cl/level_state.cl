// What a whole level shows under its field, and the composition of a sweep's steps with the field.
// One work-item per active cell; `keep`: cells that have not changed keep what they have.
// CPU twins: kernels/reference/block_moments.cpp.
#include "block.cl.h"
#include "grid.cl.h"

static float3 kvx_shifted(const KvxGrid grid, const int3 voxel, const float3 mm) {
  const float3 shift = (float3)(dot(grid.vox_from_mm[0].xyz, mm), dot(grid.vox_from_mm[1].xyz, mm),
                                dot(grid.vox_from_mm[2].xyz, mm));
  return clamp(convert_float3(voxel) + shift, (float3)(0.0f), convert_float3(grid.size.xyz - 1));
}

// seen(v) = scan at start(v + d(v)); what was seen before where nothing has changed.
kernel void see(global const int* active, const int count, const int4 cells, const KvxGrid grid,
                global const float4* start, global const float4* field, global const float* scan,
                const int4 scan_size, global const uchar* changed, const int keep, global const float* before,
                global float* seen) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const bool look = changed[active[n]];
  if (!look && keep) return;
  const int3 first = 2 * kvx_cell(cells, active[n]);
  for (int corner = 0; corner < 8; ++corner) {
    const int3 at = first + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
    const int v = (at.z * grid.size.y + at.y) * grid.size.x + at.x;
    if (!look) {
      seen[v] = before[v];
      continue;
    }
    const float4 p = kvx_sample4(start, grid.size, kvx_shifted(grid, at, field[v].xyz));
    seen[v] = kvx_sample(scan, scan_size, p.xyz, KVX_UNSEEN);
  }
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

// d'(v) = u(v) + d(v + u(v)), u = mobility * the cells' steps, linear between the cells' centres.
kernel void compose(global const int* active, const int count, const int4 cells, const KvxGrid grid,
                    global const float4* cell_steps, global const float* mobility, global const float4* field,
                    global const uchar* touched, const int keep, global uchar* changed,
                    global float4* trial) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const bool look = kvx_marked_near(touched, cells, kvx_cell(cells, active[n]));
  changed[active[n]] = look;
  if (!look && keep) return;
  const int3 first = 2 * kvx_cell(cells, active[n]);
  const float3 top = convert_float3(cells.xyz - 1);
  for (int corner = 0; corner < 8; ++corner) {
    const int3 at = first + (int3)(corner & 1, (corner >> 1) & 1, corner >> 2);
    const int v = (at.z * grid.size.y + at.y) * grid.size.x + at.x;
    if (!look) {
      trial[v] = field[v];
      continue;
    }
    const float3 in_cells = clamp(0.5f * convert_float3(at) - 0.25f, (float3)(0.0f), top);
    const float4 u = mobility[v] * kvx_sample4(cell_steps, cells, in_cells);
    trial[v] = u + kvx_sample4(field, grid.size, kvx_shifted(grid, at, u.xyz));
  }
}

// The field on every second voxel.
kernel void cell_field(global const int* active, const int count, const int4 cells, const int4 size,
                       global const float4* field, global float4* out) {
  const int n = get_global_id(0);
  if (n >= count) return;
  const int3 at = 2 * kvx_cell(cells, active[n]);
  out[active[n]] = field[(at.z * size.y + at.y) * size.x + at.x];
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
