// Correlation sums of many candidate poses of one bone; one work-item per candidate, a loop over the bone's
// samples, eight at a time. samples: blocks of (x8, y8, z8 in mm about the bone's centroid, template value8);
// only every block_step-th block is looked at. candidates: three rows of the affine that takes such a point
// to scan voxels. Samples outside the hull of scan voxel centres are left out and not counted. sums: (count,
// t, tt, s, ss, ts, 0, 0), s = scan, t = template. CPU twin: kernels/reference/bone_scores.cpp.

static float8 scores_row(const float4 row, const float8 x, const float8 y, const float8 z) {
  return row.x * x + row.y * y + row.z * z + row.w;
}

// Pairs of neighbours along x, interpolated there. Loads by pairs: CPUs are slow at gathering eight single
// values.
static float8 scores_pairs(global const float* scan, const int8 at, const float8 x) {
  const float16 pairs = (float16)(vload2(0, scan + at.s0), vload2(0, scan + at.s1), vload2(0, scan + at.s2),
                                  vload2(0, scan + at.s3), vload2(0, scan + at.s4), vload2(0, scan + at.s5),
                                  vload2(0, scan + at.s6), vload2(0, scan + at.s7));
  return mix(pairs.even, pairs.odd, x);
}

static int8 scores_low(const float8 p, const int size) { return clamp(convert_int8(p), 0, max(size - 2, 0)); }

static float scores_sum(const float8 v) {
  const float4 half_sum = v.lo + v.hi;
  return (half_sum.x + half_sum.y) + (half_sum.z + half_sum.w);
}

kernel void bone_scores(global const float* scan, const int4 size, global const float8* samples,
                        const int block_count, const int block_step, global const float4* candidates,
                        const int candidate_count, global float8* sums) {
  const int c = get_global_id(0);
  if (c >= candidate_count) return;
  const float4 row0 = candidates[3 * c], row1 = candidates[3 * c + 1], row2 = candidates[3 * c + 2];
  const float3 top = convert_float3(size.xyz - 1);
  const int dy = min(size.y - 1, 1) * size.x, dz = min(size.z - 1, 1) * size.x * size.y;
  float8 count = 0, t = 0, tt = 0, s = 0, ss = 0, ts = 0;
  for (int n = 0; n < block_count; n += block_step) {
    const float8 sx = samples[4 * n], sy = samples[4 * n + 1], sz = samples[4 * n + 2];
    float8 x = scores_row(row0, sx, sy, sz), y = scores_row(row1, sx, sy, sz),
           z = scores_row(row2, sx, sy, sz);
    const int8 inside = x >= 0.0f & y >= 0.0f & z >= 0.0f & x <= top.x & y <= top.y & z <= top.z;
    if (!any(inside)) continue;
    x = clamp(x, 0.0f, top.x), y = clamp(y, 0.0f, top.y), z = clamp(z, 0.0f, top.z);
    const int8 i = scores_low(x, size.x), j = scores_low(y, size.y), k = scores_low(z, size.z);
    const int8 at = (k * size.y + j) * size.x + i;
    x -= convert_float8(i), y -= convert_float8(j), z -= convert_float8(k);
    const float8 low = mix(scores_pairs(scan, at, x), scores_pairs(scan + dy, at, x), y);
    const float8 high = mix(scores_pairs(scan + dz, at, x), scores_pairs(scan + dz + dy, at, x), y);
    const float8 value = select((float8)(0.0f), mix(low, high, z), inside);
    const float8 w = select((float8)(0.0f), samples[4 * n + 3], inside);
    count += select((float8)(0.0f), (float8)(1.0f), inside);
    t += w, tt += w * w, s += value, ss += value * value, ts += w * value;
  }
  sums[c] = (float8)(scores_sum(count), scores_sum(t), scores_sum(tt), scores_sum(s), scores_sum(ss),
                     scores_sum(ts), 0.0f, 0.0f);
}
