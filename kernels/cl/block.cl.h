// Voxels and cells of a registration level: see kernels/block_level.h. A cell is 2 x 2 x 2 voxels.

#define KVX_UNSEEN -1e30f  // what the scan shows where it was not taken

static int kvx_voxel(const int4 size, const int i, const int j, const int k) {
  if (i < 0 || j < 0 || k < 0 || i >= size.x || j >= size.y || k >= size.z) return -1;
  return (k * size.y + j) * size.x + i;
}

static int3 kvx_cell(const int4 cells, const int index) {
  const int row = index / cells.x;
  return (int3)(index - row * cells.x, row % cells.y, row / cells.y);
}

// Trilinear; p must lie in the hull of voxel centres, every axis has at least two voxels.
static float4 kvx_sample4(global const float4* image, const int4 size, const float3 p) {
  const int3 lo = min(convert_int3(p), size.xyz - 2);
  const float3 f = p - convert_float3(lo);
  const int row = size.x, slice = size.x * size.y;
  global const float4* at = image + (lo.z * size.y + lo.y) * size.x + lo.x;
  const float4 a = mix(mix(at[0], at[1], f.x), mix(at[row], at[row + 1], f.x), f.y);
  at += slice;
  const float4 b = mix(mix(at[0], at[1], f.x), mix(at[row], at[row + 1], f.x), f.y);
  return mix(a, b, f.z);
}
