// Eight nodes of an elastic lattice side by side: the energy of frames, a function of the nodes' positions.
// A frame is a node's three edges towards one octant, each relative to its length at rest.
#define KVX_WHOLE 1e30f  // an edge through tissue weakens no frame

typedef struct {
  float8 x, y, z;
} KvxEight;

// Gradient and Hessian of the energy in the nodes' positions.
typedef struct {
  KvxEight gradient;
  float8 xx, xy, xz, yy, yz, zz, shear;
} KvxLocal;

KVX_INLINE KvxEight times(const float8 s, const KvxEight v) { return (KvxEight){s * v.x, s * v.y, s * v.z}; }
KVX_INLINE KvxEight plus(const KvxEight a, const KvxEight b) {
  return (KvxEight){a.x + b.x, a.y + b.y, a.z + b.z};
}
KVX_INLINE KvxEight minus(const KvxEight a, const KvxEight b) {
  return (KvxEight){a.x - b.x, a.y - b.y, a.z - b.z};
}
KVX_INLINE float8 dot8(const KvxEight a, const KvxEight b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
KVX_INLINE KvxEight cross8(const KvxEight a, const KvxEight b) {
  return (KvxEight){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
KVX_INLINE KvxEight load(global const float* planes, const int plane, const int at) {
  planes += at;
  return (KvxEight){vload8(0, planes), vload8(0, planes + plane), vload8(0, planes + 2 * plane)};
}
// What an edge leaves of a frame's stiffness.
KVX_INLINE float8 edge(global const uchar* edges, const int at, const float air) {
  const int8 code = convert_int8(vload8(0, edges + at));
  const float8 there = select((float8)(KVX_WHOLE), (float8)(air), code == 1);
  return select(there, (float8)(0.0f), code == 0);
}

// A frame into which the position enters as frame += shift * weights^T: frame * weights, the slope of its
// determinant, and that determinant.
KVX_INLINE void add(KvxLocal* l, const KvxEight stretch, const KvxEight slope, const float8 determinant,
                    const float weights_squared, const float8 stiffness, const float volume) {
  const float8 pressure = stiffness * (volume * (determinant - 1.0f) - 1.0f);
  l->gradient = plus(l->gradient, plus(times(stiffness, stretch), times(pressure, slope)));
  const KvxEight scaled = times(stiffness * volume, slope);
  l->xx += scaled.x * slope.x;
  l->xy += scaled.x * slope.y;
  l->xz += scaled.x * slope.z;
  l->yy += scaled.y * slope.y;
  l->yz += scaled.y * slope.z;
  l->zz += scaled.z * slope.z;
  l->shear += stiffness * weights_squared;
}

// The symmetric `holds` (xx xy xz yy yz zz) times how far the nodes are off.
KVX_INLINE void add_hold(KvxLocal* l, const KvxEight off, global const float* holds, const int plane) {
  float8 h[6];
  for (int n = 0; n < 6; ++n) h[n] = vload8(0, holds + n * plane);
  l->gradient.x += h[0] * off.x + h[1] * off.y + h[2] * off.z;
  l->gradient.y += h[1] * off.x + h[3] * off.y + h[4] * off.z;
  l->gradient.z += h[2] * off.x + h[4] * off.y + h[5] * off.z;
  l->xx += h[0], l->xy += h[1], l->xz += h[2], l->yy += h[3], l->yz += h[4], l->zz += h[5];
}

// Hessian^-1 gradient, by L D L^T.
KVX_INLINE KvxEight step_of(const KvxLocal* l) {
  const float8 d0 = l->xx + l->shear, l1 = l->xy / d0, l2 = l->xz / d0;
  const float8 d1 = l->yy + l->shear - l1 * l->xy, m = (l->yz - l2 * l->xy) / d1;
  const float8 d2 = l->zz + l->shear - l2 * l->xz - m * m * d1;
  const float8 y = l->gradient.y - l1 * l->gradient.x;
  const float8 z = (l->gradient.z - l2 * l->gradient.x - m * y) / d2;
  const float8 y_out = y / d1 - m * z;
  return (KvxEight){l->gradient.x / d0 - l1 * y_out - l2 * z, y_out, z};
}

// What the nodes see of their neighbours before and after along every axis.
typedef struct {
  KvxEight edge[3][2];                     // relative to its length at rest, towards rising places
  float8 joined[3][2], stiff[3][2], mine;  // mine: the nodes' own stiffness
} KvxAround;

// The frames that the nodes span themselves.
KVX_INLINE void add_own(KvxLocal* l, const KvxAround* n, const float* per_mm, const float volume) {
#pragma unroll
  for (int octant = 0; octant < 8; ++octant) {
    const int i = octant & 1, j = octant >> 1 & 1, k = octant >> 2;
    const KvxEight x = n->edge[0][i], y = n->edge[1][j], z = n->edge[2][k], yz = cross8(y, z);
    const float u = i ? -per_mm[0] : per_mm[0];
    const float v = j ? -per_mm[1] : per_mm[1];
    const float w = k ? -per_mm[2] : per_mm[2];
    const float8 frame = fmin(fmin(n->joined[0][i], n->joined[1][j]), n->joined[2][k]);
    const float8 most = fmax(fmax(n->mine, n->stiff[0][i]), fmax(n->stiff[1][j], n->stiff[2][k]));
    const KvxEight slope = plus(times(u, yz), plus(times(v, cross8(z, x)), times(w, cross8(x, y))));
    add(l, plus(times(u, x), plus(times(v, y), times(w, z))), slope, dot8(x, yz), u * u + v * v + w * w,
        fmin(frame, most), volume);
  }
}
