// Voxels of a registration level: where they land in the scan, and trilinear sampling of four-component images.
// The level's state is described in kernels/block_level.h.

static int kvx_voxel(const int4 size, const int i, const int j, const int k) {
  if (i < 0 || j < 0 || k < 0 || i >= size.x || j >= size.y || k >= size.z) return -1;
  return (k * size.y + j) * size.x + i;
}

// Position in scan voxels of the material point at voxel v displaced by d mm: base + linear d.
static float3 kvx_land(global const float* base, global const float* linear, const int v, const float3 d) {
  const float3 r0 = vload3(3 * v, linear), r1 = vload3(3 * v + 1, linear), r2 = vload3(3 * v + 2, linear);
  return vload3(v, base) + (float3)(dot(r0, d), dot(r1, d), dot(r2, d));
}

// linear^T g: a slope per scan voxel becomes a slope per mm of displacement.
static float3 kvx_pull(global const float* linear, const int v, const float3 g) {
  return vload3(3 * v, linear) * g.x + vload3(3 * v + 1, linear) * g.y + vload3(3 * v + 2, linear) * g.z;
}

static bool kvx_inside(const int4 size, const float3 p) {
  const float3 top = convert_float3(size.xyz - 1);
  return p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x <= top.x && p.y <= top.y && p.z <= top.z;
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
