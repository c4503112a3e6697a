// Bricks of 4x4x4 template nodes and the Kuhn tetrahedra of their cells. Host layout: kernels/bricked_body.h.
// `brick_at` is dense over bricks (-1: not stored); bricks below bricks.w hold cells, the others only their neighbours' nodes.
#define KVX_NODES 64
#define KVX_TETS 6
#define KVX_SLOTS 65       // cells of a brick: slot 0 is the whole brick as one cell, 1 + n the unit cell at node n
#define KVX_NONE 0xFFFFFFFFu
#define KVX_CLASS_SHIFT 30 // owner = class << 30 | (brick * KVX_SLOTS + slot) * KVX_TETS + tet; the smallest wins
#define KVX_BODY 0u
#define KVX_MARGIN 1u
#define KVX_INVERTED 2u

// Axes in the order in which a tetrahedron's path from corner (0,0,0) to corner (1,1,1) takes them; even ones first.
constant int KVX_PATH[18] = {0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 2, 1, 2, 1, 0, 1, 0, 2};

static int3 kvx_axis(const int a) { return (int3)(a == 0, a == 1, a == 2); }

static int kvx_brick(global const int* brick_at, const int4 bricks, const int3 node) {
  const int3 b = node >> 2;
  if (any(node < 0) || any(b >= bricks.xyz)) return -1;
  return brick_at[(b.z * bricks.y + b.y) * bricks.x + b.x];
}

static int kvx_slot(const int3 node) { return ((node.z & 3) << 4) | ((node.y & 3) << 2) | (node.x & 3); }

// The posed place of a node that is known to be stored.
static float3 kvx_posed(global const int* brick_at, const int4 bricks, global const float4* posed, const int3 node) {
  return posed[(size_t)kvx_brick(brick_at, bricks, node) * KVX_NODES + kvx_slot(node)].xyz;
}

static bool kvx_bit(global const int* brick_at, const int4 bricks, global const ulong* bits, const int3 node) {
  const int brick = kvx_brick(brick_at, bricks, node);
  return brick >= 0 && ((bits[brick] >> kvx_slot(node)) & 1);
}

// Template coordinates along the path: g_i = q_i . (p - start); inside where step >= g_0 >= g_1 >= g_2 >= 0.
typedef struct {
  int3 base;      // node of corner (0,0,0)
  int step;       // edge of the cell in voxels
  int a, b, c;    // axes along the path
  float3 start;   // posed place of the base node
  float3 e0, e1, e2, q0, q1, q2;
  float det;      // of d posed / d template, in voxels
} KvxTet;

static KvxTet kvx_tet(global const int* brick_at, const int4 bricks, global const float4* posed, const int3 base,
                      const int step, const int tet) {
  KvxTet t;
  t.base = base;
  t.step = step;
  t.a = KVX_PATH[3 * tet], t.b = KVX_PATH[3 * tet + 1], t.c = KVX_PATH[3 * tet + 2];
  const int3 n1 = base + step * kvx_axis(t.a), n2 = n1 + step * kvx_axis(t.b), n3 = base + step;
  t.start = kvx_posed(brick_at, bricks, posed, base);
  const float3 v1 = kvx_posed(brick_at, bricks, posed, n1), v2 = kvx_posed(brick_at, bricks, posed, n2);
  const float3 v3 = kvx_posed(brick_at, bricks, posed, n3);
  const float scale = 1.0f / step;
  t.e0 = (v1 - t.start) * scale, t.e1 = (v2 - v1) * scale, t.e2 = (v3 - v2) * scale;
  const float3 c12 = cross(t.e1, t.e2);
  const float det = dot(t.e0, c12);
  const float inverse = 1.0f / (fabs(det) > 1e-12f ? det : 1e-12f);
  t.q0 = c12 * inverse, t.q1 = cross(t.e2, t.e0) * inverse, t.q2 = cross(t.e0, t.e1) * inverse;
  t.det = tet < 3 ? det : -det;
  return t;
}

// Path coordinates to a template voxel position.
static float3 kvx_template_place(const KvxTet t, const float3 g) {
  return convert_float3(t.base) + g.x * convert_float3(kvx_axis(t.a)) + g.y * convert_float3(kvx_axis(t.b)) +
         g.z * convert_float3(kvx_axis(t.c));
}

static float3 kvx_path_place(const KvxTet t, const float3 p) {
  const float3 r = p - t.start;
  return (float3)(dot(t.q0, r), dot(t.q1, r), dot(t.q2, r));
}
