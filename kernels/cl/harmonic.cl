// Multigrid for the graph Laplace equation, diagonal_n f_n = drive_n + sum_d c_nd f_neighbour(n, d), for
// eight fields at once. A missing neighbour is the node itself with conductance 0. CPU twin:
// kernels/reference/harmonic.cpp.

float8 kvx_pull(const int node, global const int* neighbours, global const float* conductance,
                global const float* drive, global const float* fields) {
  global const int* next = neighbours + 6 * (size_t)node;
  global const float* weight = conductance + 6 * (size_t)node;
  float8 sum = vload8(node, drive);
  for (int d = 0; d < 6; ++d) sum += weight[d] * vload8(next[d], fields);
  return sum;
}

// One half-sweep of red-black over-relaxation, one work-item per node of the colour [first, first + count).
// No node has a neighbour of its own colour, so the order of work-items does not matter.
kernel void harmonic_sweep(const int first, const int count, const float omega, global const int* neighbours,
                           global const float* conductance, global const float* inverse_diagonal,
                           global const float* drive, global float* fields) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int node = first + item;
  const float8 sum = kvx_pull(node, neighbours, conductance, drive, fields);
  const float8 old = vload8(node, fields);
  vstore8(old + omega * (sum * inverse_diagonal[node] - old), node, fields);
}

// What drives the correction at a coarse node: the sum of its finer nodes' residuals, after a sweep. Those of
// the second colour have none then.
kernel void harmonic_restrict(const int count, global const int* children, global const int* neighbours,
                              global const float* conductance, global const float* inverse_diagonal,
                              global const float* drive, global const float* fields,
                              global float* coarse_drive) {
  const int coarse = get_global_id(0);
  if (coarse >= count) return;
  float8 sum = 0;
  for (int c = 0; c < 4; ++c) {
    const int node = children[4 * (size_t)coarse + c];
    if (node < 0 || inverse_diagonal[node] == 0) continue;
    sum += kvx_pull(node, neighbours, conductance, drive, fields) -
           vload8(node, fields) / inverse_diagonal[node];
  }
  vstore8(sum, coarse, coarse_drive);
}

// Adds the coarser level's correction, linear between its nodes.
kernel void harmonic_correct(const int count, global const int* around, global const float* coarse_fields,
                             global float* fields) {
  const int node = get_global_id(0);
  if (node >= count) return;
  global const int* from = around + 4 * (size_t)node;
  const float8 step =
      0.25f * (vload8(from[0], coarse_fields) + vload8(from[1], coarse_fields) +
               vload8(from[2], coarse_fields) + vload8(from[3], coarse_fields));
  vstore8(vload8(node, fields) + step, node, fields);
}

// What has changed `before`, which becomes `fields`: the largest of the eight.
kernel void harmonic_change(const int count, global const float* fields, global float* before,
                            global float* change) {
  const int node = get_global_id(0);
  if (node >= count) return;
  const float8 now = vload8(node, fields);
  const float8 size = fabs(now - vload8(node, before));
  vstore8(now, node, before);
  const float4 four = fmax(size.lo, size.hi);
  const float2 two = fmax(four.lo, four.hi);
  change[node] = fmax(two.x, two.y);
}
