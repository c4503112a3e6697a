// The posed nodes of one brick, gathered from it and its neighbours.
// The brick's posed 5x5x5 nodes, and the last once more where sixteens need it.
typedef struct {
  float at[3][128];
} KvxBlock;
#define ROW(y, z) (5 * ((z)*5 + (y)))

static float3 node_at(const KvxBlock* b, const int n) {
  return (float3)(b->at[0][n], b->at[1][n], b->at[2][n]);
}

static void load_block(global const int* brick_at, const int4 bricks, const int4 first,
                       global const float* posed, const float3 shift, KvxBlock* block) {
  const int3 at = first.xyz >> 2;
  size_t near[8];
  for (int n = 0; n < 8; ++n) {
    const int3 b = at + (int3)(n & 1, (n >> 1) & 1, n >> 2);
    near[n] = (size_t)brick_at[(b.z * bricks.y + b.y) * bricks.x + b.x] * KVX_BRICK_FLOATS;
  }
  const float by[3] = {shift.x, shift.y, shift.z};
  // The brick across the edge is new to the cache: its sixteens are asked for all at once.
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
#pragma unroll
    for (int z = 0; z < 4; ++z)
      block->at[axis][ROW(4, z) + 4] = posed[near[3] + axis * KVX_NODES + 16 * z] + by[axis];
    block->at[axis][124] = posed[near[7] + axis * KVX_NODES] + by[axis];
  }
  for (int z = 0; z < 5; ++z) {
#pragma unroll
    for (int y = 0; y < 5; ++y) {
      const int side = 2 * (y == 4) + 4 * (z == 4), in_brick = 16 * (z & 3) + 4 * (y & 3);
      global const float *here = posed + near[side] + in_brick, *beyond = posed + near[side + 1] + in_brick;
#pragma unroll
      for (int axis = 0; axis < 3; ++axis) {
        vstore4(vload4(0, here + axis * KVX_NODES) + by[axis], 0, block->at[axis] + ROW(y, z));
        if (y < 4) block->at[axis][ROW(y, z) + 4] = beyond[axis * KVX_NODES] + by[axis];
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    for (int n = 125; n < 128; ++n) block->at[axis][n] = block->at[axis][124];
}

// The least of a brick's nodes along an axis, or of their negatives.
static float least_node(const float* at, const float sign) {
  float16 least = sign * vload16(0, at);
  for (int s = 1; s < 8; ++s) least = least16(least, sign * vload16(s, at));
  return smallest16(least);
}

// Whether nothing of the brick can reach the grid: its cells reach less than half its width beyond it.
static bool misses_grid(const KvxBlock* b, const int4 size) {
  const float3 lo =
      (float3)(least_node(b->at[0], 1.0f), least_node(b->at[1], 1.0f), least_node(b->at[2], 1.0f));
  const float3 hi =
      -(float3)(least_node(b->at[0], -1.0f), least_node(b->at[1], -1.0f), least_node(b->at[2], -1.0f));
  const float3 pad = 0.5f * (hi - lo) + 1.0f;
  return any(hi + pad < 0.0f) || any(lo - pad > convert_float3(size.xyz - 1));
}
