// Smoothing and coarsening of volumes. One work-item per output voxel; borders repeat. CPU twin:
// kernels/reference/pyramid.cpp.

static int kvx_at(const int4 size, const int3 p) {
  const int3 q = clamp(p, (int3)(0), size.xyz - 1);
  return (q.z * size.y + q.y) * size.x + q.x;
}

// (1 6 1) / 8 along one axis, of voxels `axis` apart: a Gaussian of half of that.
kernel void smooth_axis(global const float* in, const int4 size, const int4 axis, global float* out) {
  const int3 p = (int3)(get_global_id(0), get_global_id(1), get_global_id(2));
  if (p.x >= size.x || p.y >= size.y || p.z >= size.z) return;
  const int v = kvx_at(size, p);
  out[v] = 0.75f * in[v] + 0.125f * (in[kvx_at(size, p - axis.xyz)] + in[kvx_at(size, p + axis.xyz)]);
}

// Mean over 2 x 2 x 2 voxels; `size` is that of the output.
kernel void halve(global const float* in, const int4 in_size, const int4 size, global float* out) {
  const int3 p = (int3)(get_global_id(0), get_global_id(1), get_global_id(2));
  if (p.x >= size.x || p.y >= size.y || p.z >= size.z) return;
  float sum = 0.0f;
  for (int c = 0; c < 8; ++c) sum += in[kvx_at(in_size, 2 * p + (int3)(c & 1, (c >> 1) & 1, c >> 2))];
  out[kvx_at(size, p)] = 0.125f * sum;
}
