// Closes gaps of one or two voxels inside the posed body, left where cells folded or were culled: along each axis, linear
// between the body voxels on both sides. Reads owned voxels and writes unowned ones, so the order cannot show. In place.
// CPU twin: kernels/reference/fill_gaps.cpp.
#define NONE 0xFFFFFFFFu
#define CLASS_SHIFT 30   // class 0 is body, see evd_bricks.cl.h
#define WIDEST 3         // distance in voxels between the two body voxels; air between fingers is owned, or wider

// Steps to the first owned voxel, 0 where it is not body or too far.
static int steps_to_body(global const uint* owner, const size_t at, const long stride, const int room) {
  for (int d = 1; d < WIDEST && d <= room; ++d) {
    const uint o = owner[at + d * stride];
    if (o != NONE) return (o >> CLASS_SHIFT) == 0 ? d : 0;
  }
  return 0;
}

kernel void fill_gaps(global const uint* owner, const int4 size, const float air, global float* values) {
  const int i = get_global_id(0), j = get_global_id(1), k = get_global_id(2);
  if (i >= size.x || j >= size.y || k >= size.z) return;
  const size_t at = ((size_t)k * size.y + j) * size.x + i;
  if (owner[at] != NONE || values[at] != air) return;
  const int place[3] = {i, j, k}, extent[3] = {size.x, size.y, size.z};
  const long stride[3] = {1, size.x, (long)size.x * size.y};
  float sum = 0.0f, weight = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const int before = steps_to_body(owner, at, -stride[axis], place[axis]);
    const int after = steps_to_body(owner, at, stride[axis], extent[axis] - 1 - place[axis]);
    if (before == 0 || after == 0 || before + after > WIDEST) continue;
    const float low = values[at - before * stride[axis]], high = values[at + after * stride[axis]];
    const float w = 1.0f / (before + after);
    sum += w * w * (low * after + high * before);
    weight += w;
  }
  if (weight > 0.0f) values[at] = sum / weight;
}
