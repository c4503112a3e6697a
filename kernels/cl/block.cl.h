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

// Trilinear; what was not taken beyond the hull of voxel centres. Every axis has at least two voxels.
static float kvx_sample1(global const float* image, const int4 size, const float3 p) {
  const float3 top = convert_float3(size.xyz - 1);
  if (!(p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x <= top.x && p.y <= top.y && p.z <= top.z))
    return KVX_UNSEEN;
  const int3 lo = min(convert_int3(p), size.xyz - 2);
  const float3 f = p - convert_float3(lo);
  const int row = size.x, slice = size.x * size.y;
  global const float* at = image + (lo.z * size.y + lo.y) * size.x + lo.x;
  const float2 r00 = vload2(0, at), r10 = vload2(0, at + row);
  const float2 r01 = vload2(0, at + slice), r11 = vload2(0, at + slice + row);
  const float4 x = mix((float4)(r00.x, r01.x, r10.x, r11.x), (float4)(r00.y, r01.y, r10.y, r11.y), f.x);
  const float2 y = mix(x.lo, x.hi, f.y);
  return mix(y.x, y.y, f.z);
}
