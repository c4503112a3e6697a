// Bricks of 4x4x4 template nodes and the cells of the inverse map. Host layout: kernels/bricked_body.h, kernels/evd_cells.h.
// `brick_at` is dense over bricks (-1: not stored); bricks below bricks.w hold cells, the others only their neighbours' nodes.
#define KVX_NODES 64
#define KVX_BRICK_FLOATS 192  // posed nodes of a brick: [axis][node], voxels of the posed grid

// What a posed voxel may be claimed as: the least wins, and of equals the first in the order of bricks and cells.
#define KVX_BODY 0
#define KVX_RIM 1        // body next to air in the template
#define KVX_MARGIN 2     // air carried along
#define KVX_GROWN 3      // half a template voxel beyond a cell beside a tear or a cut end
#define KVX_INVERTED 4   // a cell turned inside out
#define KVX_UNCLAIMED 5

// Words of a brick's bits, from which its body, what is carried along and the body without its rim start.
#define KVX_TISSUE_WORDS 12
#define KVX_IS_BODY 0
#define KVX_IS_CARRIED 4
#define KVX_IS_INNER 8

// A template cell of edge 4, 2 or 1 and the inverse of the forward map in it. With h = -0.5 .. 0.5 along each axis the
// forward map is p = m + J (h + n(h)); inverse: h = q - n(h), q = J^-1 (p - m), iterated `steps` times, or by Newton's method
// (KVX_NEWTON) in a cell of edge 1 that bends too much for that and does not fold.
// A tetrahedron has n = 0 and holds the h whose coordinates fall along its path of axes.
typedef struct {
  float inverse[12];  // rows of q = A p + b
  float middle[3];    // of the cell, template voxels
  float edge;         // template voxels
  int first_node[3];  // of its brick
  float core, reach;  // |h| within which it claims in full, and at all
  float slack;        // greatest |n|
  int tetrahedron;    // 0 to 5; -1: a whole cell
  int steps, inverted, all_inner;  // all nodes inner body
  float squares[9], products[9], cube[3];  // n = squares h_i^2 + products (yz, zx, xy) + cube xyz; [term][axis]
  int nodes;          // block of posed nodes against which the inverse is refined; -1: none is needed
} KvxCell;            // 192 bytes

// The posed voxels that a cell may cover, first and last: beside the cells, as a tile looks at many more boxes than cells.
typedef struct {
  int lo[3], hi[3], unused[2];
} KvxBox;

#define KVX_NEWTON -1
#define KVX_BLOCK_NODES 125  // [z][y][x] of a brick's 5x5x5 nodes

// What became of a brick: the box of its cells, and how many unit cells of body folded.
typedef struct {
  int box[6];
  int folded, unused;
} KvxBrickCells;

// Axes in the order in which a tetrahedron's path from corner (0,0,0) to corner (1,1,1) takes them; even ones first.
constant int KVX_PATH[18] = {0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 2, 1, 2, 1, 0, 1, 0, 2};

#define KVX_UNIT_BITS 0xC6000063ul                                                  // the nodes of a cell of edge 1 ...
#define KVX_EIGHTH_BITS (0x1CE7ul | 0x1CE7ul << 25 | 0x1CE7ul << 50)  // ... and of edge 2, from its lowest node on

// Bits of a brick's 5x5x5 nodes, from node `at` on.
static ulong kvx_bits_from(global const uint* tissue, const int word, const int3 at) {
  const ulong low = tissue[word] | (ulong)tissue[word + 1] << 32, high = tissue[word + 2] | (ulong)tissue[word + 3] << 32;
  const int first = (at.z * 5 + at.y) * 5 + at.x;
  if (first == 0) return low;
  return first < 64 ? low >> first | high << (64 - first) : high >> (first - 64);
}
