// Correlation sums of many candidate poses of one bone; one work-item per candidate, a loop over the bone's samples.
// samples: (x, y, z in mm about the bone's centroid, template value). candidates: three rows of the affine that takes such a
// point to scan voxels. Samples outside the hull of scan voxel centres are left out and not counted.
// sums: (count, t, tt, s, ss, ts, 0, 0), s = scan, t = template. CPU twin: kernels/reference/bone_scores.cpp.
#include "grid.cl.h"

kernel void bone_scores(global const float* scan, const int4 size, global const float4* samples, const int sample_count,
                        global const float4* candidates, const int candidate_count, global float8* sums) {
  const int c = get_global_id(0);
  if (c >= candidate_count) return;
  const float4 row0 = candidates[3 * c], row1 = candidates[3 * c + 1], row2 = candidates[3 * c + 2];
  const float3 top = convert_float3(size.xyz - 1);
  float count = 0, t = 0, tt = 0, s = 0, ss = 0, ts = 0;
  for (int n = 0; n < sample_count; ++n) {
    const float4 sample = samples[n];
    const float3 p = kvx_apply(row0, row1, row2, sample.xyz);
    if (!(p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x <= top.x && p.y <= top.y && p.z <= top.z)) continue;
    const float value = kvx_sample(scan, size, p, 0.0f);
    count += 1.0f;
    t += sample.w;
    tt += sample.w * sample.w;
    s += value;
    ss += value * value;
    ts += sample.w * value;
  }
  sums[c] = (float8)(count, t, tt, s, ss, ts, 0.0f, 0.0f);
}
