// What a step of a cell changes: see block_moments.cl for the channels.
#define CHANNELS 24

// A step p (mm) of a cell turns s into s + J.p in all its sums, and adds to the cell's step and field.
static void kvx_take_step(const int cell, const float3 p, global const float* cell_mobility,
                          global float* moments, global float4* cell_steps, global float4* cell_field) {
  cell_steps[cell] += (float4)(p, 0.0f);
  cell_field[cell] += cell_mobility[cell] * (float4)(p, 0.0f);
  global float* m = moments + (size_t)cell * CHANNELS;
  const float3 jj = (float3)(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[1] * p.x + m[3] * p.y + m[4] * p.z,
                             m[2] * p.x + m[4] * p.y + m[5] * p.z);
  const float js = m[6] * p.x + m[7] * p.y + m[8] * p.z;
  m[23] += 2.0f * js + dot(jj, p);
  m[22] += m[9] * p.x + m[10] * p.y + m[11] * p.z;
  m[20] += m[12] * p.x + m[13] * p.y + m[14] * p.z;
  m[6] += jj.x;
  m[7] += jj.y;
  m[8] += jj.z;
}
