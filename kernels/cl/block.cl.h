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

// Of the four coefficients around a place, f of the way between the middle two.
static float4 kvx_spline_weights(const float f) {
  const float g = 1.0f - f;
  const float4 weights = (float4)(g * g * g, 4.0f - 3.0f * f * f * (2.0f - f),
                                  4.0f - 3.0f * g * g * (2.0f - g), f * f * f);
  return weights / 6.0f;
}

// On a cubic B-spline; what was not taken beyond the hull of voxel centres. `size`: of the image, at least
// two voxels along every axis; its coefficients have one voxel more on every side.
static float kvx_sample_spline(global const float* coefficients, const int4 size, const float3 p) {
  const float3 top = convert_float3(size.xyz - 1);
  if (!(p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x <= top.x && p.y <= top.y && p.z <= top.z))
    return KVX_UNSEEN;
  const int3 lo = min(convert_int3(p), size.xyz - 2);
  const float3 f = p - convert_float3(lo);
  const size_t row = size.x + 2, slice = row * (size.y + 2);  // the margin may lead beyond 32 bits
  global const float* at = coefficients + lo.z * slice + lo.y * row + lo.x;
  const float4 x = kvx_spline_weights(f.x), y = kvx_spline_weights(f.y), z = kvx_spline_weights(f.z);
  const float weights[4] = {z.x, z.y, z.z, z.w};
  float4 sum = 0.0f;
  for (int k = 0; k < 4; ++k, at += slice) {
    const float4 rows = y.x * vload4(0, at) + y.y * vload4(0, at + row) + y.z * vload4(0, at + 2 * row) +
                        y.w * vload4(0, at + 3 * row);
    sum += weights[k] * rows;
  }
  return dot(sum, x);
}
