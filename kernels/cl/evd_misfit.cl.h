// How far a fitted cell is from the posed nodes that it stands for. CPU twin: kernels/reference/evd_cells.cpp.
// How far the inverse misses the carried nodes of the cell, template voxels.
static float greatest_error(const KvxBlock* b, global const uint* carried, const int3 at, const KvxCell* c) {
  const int s = c->edge;
  const float8 x = (float8)(0, 1, 2, 3, 4, 5, 6, 7) / c->edge - 0.5f;
  float8 worst = 0.0f;
  for (int row = 0; row < (s + 1) * (s + 1); ++row) {
    const int j = row % (s + 1), k = row / (s + 1), n = ROW(at.y + j, at.z + k) + at.x;
    const int first = (at.z + k) * 25 + (at.y + j) * 5 + at.x, word = first >> 5;
    const ulong pair = carried[word] | ((ulong)(word < 3 ? carried[word + 1] : 0) << 32);
    const int bits = (int)(pair >> (first & 31)) & ((2 << s) - 1);
    if (!bits) continue;
    const int8 counts = (int8)(bits) << (31 - (int8)(0, 1, 2, 3, 4, 5, 6, 7));
    const float y = j / c->edge - 0.5f, z = k / c->edge - 0.5f;
    const float8 px = vload8(0, b->at[0] + n), py = vload8(0, b->at[1] + n), pz = vload8(0, b->at[2] + n);
    for (int axis = 0; axis < 3; ++axis) {
      const float* sq = c->squares + axis;
      const float* pr = c->products + axis;
      const float* a = c->inverse + 4 * axis;
      const float constant_part = sq[3] * y * y + sq[6] * z * z + pr[0] * y * z - a[3] + (axis == 1 ? y : axis == 2 ? z : 0.0f);
      const float linear_part = pr[3] * z + pr[6] * y + c->cube[axis] * y * z + (axis == 0 ? 1.0f : 0.0f);
      const float8 error = constant_part + x * (linear_part + sq[0] * x) - (a[0] * px + (a[1] * py + a[2] * pz));
      worst = fmax(worst, select((float8)(0.0f), fabs(error), counts));
    }
  }
  const float4 four = fmax(worst.lo, worst.hi);
  const float most = fmax(fmax(four.x, four.y), fmax(four.z, four.w)) * c->edge;
  return most < INFINITY ? most : INFINITY;  // NaN is no fit
}

// The greatest change of slope between the cell as fitted and its edges of one voxel, of brick nodes; 0 where they agree.
static float greatest_bend(const KvxBlock* b, const KvxCell* c) {
  const int step[3] = {1, 8, 40};
  const int8 last = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
  float8 worst = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const int8 counts = axis == 0 ? last < 4 : last < 5;
    for (int row = 0; row < 25; ++row) {
      if ((axis == 1 && row % 5 == 4) || (axis == 2 && row >= 20)) continue;
      const int n = 8 * row;
      const float8 dx = vload8(0, b->at[0] + n + step[axis]) - vload8(0, b->at[0] + n);
      const float8 dy = vload8(0, b->at[1] + n + step[axis]) - vload8(0, b->at[1] + n);
      const float8 dz = vload8(0, b->at[2] + n + step[axis]) - vload8(0, b->at[2] + n);
      for (int r = 0; r < 3; ++r) {
        const float* a = c->inverse + 4 * r;
        const float8 bend = 4.0f * (a[0] * dx + (a[1] * dy + a[2] * dz)) - (r == axis ? 1.0f : 0.0f);
        worst = fmax(worst, select((float8)(0.0f), fabs(bend), counts));
      }
    }
  }
  const float4 four = fmax(worst.lo, worst.hi);
  return fmax(fmax(four.x, four.y), fmax(four.z, four.w));
}
