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
// forward map is p = m + J (h + n(h)); inverse: h = q - n(h), q = J^-1 (p - m), iterated `steps` times.
// A tetrahedron has n = 0 and holds the h whose coordinates fall along its path of axes.
typedef struct {
  float inverse[12];  // rows of q = A p + b
  float middle[3];    // of the cell, template voxels
  float edge;         // template voxels
  int box[6];         // posed voxels it may cover: x, y, z, first and last
  int first_node[3];  // of its brick
  float core, reach;  // |h| within which it claims in full, and at all
  float slack;        // greatest |n|
  int tetrahedron;    // 0 to 5; -1: a whole cell
  int steps, inverted, all_inner;  // all nodes inner body
  float squares[9], products[9], cube[3];  // n = squares h_i^2 + products (yz, zx, xy) + cube xyz; [term][axis]
  int nodes;          // block of posed nodes against which the inverse is refined; -1: none is needed
  int unused[2];
} KvxCell;            // 224 bytes

#define KVX_BLOCK_NODES 125  // [z][y][x] of a brick's 5x5x5 nodes

// What became of a brick: the box of its cells, and how many unit cells of body folded.
typedef struct {
  int box[6];
  int folded, unused;
} KvxBrickCells;

// Axes in the order in which a tetrahedron's path from corner (0,0,0) to corner (1,1,1) takes them; even ones first.
constant int KVX_PATH[18] = {0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 2, 1, 2, 1, 0, 1, 0, 2};

// One bit of a brick's 5x5x5 nodes.
static bool kvx_tissue(global const uint* tissue, const int word, const int x, const int y, const int z) {
  const int bit = (z * 5 + y) * 5 + x;
  return (tissue[word + (bit >> 5)] >> (bit & 31)) & 1;
}
