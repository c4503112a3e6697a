// One half-sweep of red-black over-relaxation of the graph Laplace equation, for eight fields at once:
//   f_n <- f_n + omega ((anchor_n + sum_d c_nd f_neighbour(n, d)) / diagonal_n - f_n).
// One work-item per node of the colour [first, first + count). No node has a neighbour of its own colour, so
// the order of work-items does not matter. A missing neighbour is the node itself with conductance 0.
// `change`: the largest step of the eight fields. CPU twin: kernels/reference/harmonic.cpp.
kernel void harmonic_sweep(const int first, const int count, const float omega, global const int* neighbours,
                           global const float* conductance, global const float* inverse_diagonal,
                           global const float* anchor, global float* fields, global float* change) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const int node = first + item;
  global const int* next = neighbours + 6 * (size_t)node;
  global const float* weight = conductance + 6 * (size_t)node;
  float8 sum = vload8(node, anchor);
  for (int d = 0; d < 6; ++d) sum += weight[d] * vload8(next[d], fields);
  const float8 old = vload8(node, fields);
  const float8 step = omega * (sum * inverse_diagonal[node] - old);
  vstore8(old + step, node, fields);
  const float8 size = fabs(step);
  const float4 four = fmax(size.lo, size.hi);
  const float2 two = fmax(four.lo, four.hi);
  change[node] = fmax(two.x, two.y);
}
