// A regular grid and trilinear sampling, shared by the kernels. Host layout: ClGrid in
// kernels/device/launch.h.

#define KVX_ROUNDING 1e-3f  // of positions, in voxels

typedef struct {
  float4 mm_from_vox[3];
  float4 vox_from_mm[3];
  int4 size;
} KvxGrid;

static float3 kvx_apply(const float4 row0, const float4 row1, const float4 row2, const float3 p) {
  return (float3)(dot(row0.xyz, p) + row0.w, dot(row1.xyz, p) + row1.w, dot(row2.xyz, p) + row2.w);
}

static float3 kvx_to_mm(const KvxGrid g, const float3 vox) {
  return kvx_apply(g.mm_from_vox[0], g.mm_from_vox[1], g.mm_from_vox[2], vox);
}

static float3 kvx_to_vox(const KvxGrid g, const float3 mm) {
  return kvx_apply(g.vox_from_mm[0], g.vox_from_mm[1], g.vox_from_mm[2], mm);
}

// Columns: what a millimetre along x, y, z is in voxels.
typedef struct {
  float3 x, y, z;
} KvxPerMm;

static KvxPerMm kvx_per_mm(const KvxGrid g) {
  const KvxPerMm out = {(float3)(g.vox_from_mm[0].x, g.vox_from_mm[1].x, g.vox_from_mm[2].x),
                        (float3)(g.vox_from_mm[0].y, g.vox_from_mm[1].y, g.vox_from_mm[2].y),
                        (float3)(g.vox_from_mm[0].z, g.vox_from_mm[1].z, g.vox_from_mm[2].z)};
  return out;
}

// The place of a voxel that is moved by mm, no farther than the hull of voxel centres.
static float3 kvx_shifted(const KvxPerMm per_mm, const int4 size, const int3 voxel, const float3 mm) {
  const float3 shift = per_mm.x * mm.x + per_mm.y * mm.y + per_mm.z * mm.z;
  return clamp(convert_float3(voxel) + shift, (float3)(0.0f), convert_float3(size.xyz - 1));
}

// Trilinear value at a voxel position; `outside` where it leaves the hull of voxel centres by more than what
// rounding may do.
static float kvx_sample(global const float* image, const int4 size, const float3 at, const float outside) {
  const float3 p = clamp(at, (float3)(0.0f), convert_float3(size.xyz - 1));
  if (!all(fabs(at - p) <= KVX_ROUNDING)) return outside;
  const int3 lo = max(min(convert_int3(p), size.xyz - 2), (int3)(0));
  const int3 hi = min(lo + 1, size.xyz - 1);
  const float3 f = p - convert_float3(lo);
  const int r00 = (lo.z * size.y + lo.y) * size.x, r10 = (lo.z * size.y + hi.y) * size.x;
  const int r01 = (hi.z * size.y + lo.y) * size.x, r11 = (hi.z * size.y + hi.y) * size.x;
  const float a = mix(mix(image[r00 + lo.x], image[r00 + hi.x], f.x),
                      mix(image[r10 + lo.x], image[r10 + hi.x], f.x), f.y);
  const float b = mix(mix(image[r01 + lo.x], image[r01 + hi.x], f.x),
                      mix(image[r11 + lo.x], image[r11 + hi.x], f.x), f.y);
  return mix(a, b, f.z);
}
