// Bricks of 4x4x4 template nodes and what they do to posed voxels. Host layout: kernels/bricked_body.h,
// kernels/evd_cells.h. `brick_at` is dense over bricks (-1: not stored); bricks below bricks.w hold cells,
// the others only their neighbours' nodes.
#define KVX_NODES 64
#define KVX_BRICK_FLOATS 192  // posed nodes of a brick: [axis][node], voxels of the posed grid

#define KVX_BONE_ROWS 5       // of a pose, per bone: evd_forward.cl

// Of half the angle between two bones: blends of rotations within 60 degrees stay far from singular.
#define KVX_SAFE_COSINE 0.866f

// What a posed voxel may be claimed as: the least wins, and of equals the first in the order of bricks and
// unit cells.
#define KVX_BONE 0      // soft tissue gives way where parts overlap
#define KVX_BODY 1
#define KVX_RIM 2       // body next to air in the template
#define KVX_MARGIN 3    // air carried along
#define KVX_GROWN 4     // half a template voxel beyond a cell beside a tear or a cut end
#define KVX_INVERTED 5  // a cell turned inside out
#define KVX_UNCLAIMED 6

// Words of a brick's bits, from which its body, what is carried along, the body without its rim and its bones
// start.
#define KVX_TISSUE_WORDS 16
#define KVX_IS_BODY 0
#define KVX_IS_CARRIED 4
#define KVX_IS_INNER 8
#define KVX_IS_BONE 12
#define KVX_BLOCK_NODES 125

// Tiles of the posed grid: 16 x 8 x 8 voxels in blocks of 2 x 2 x 2, x fastest in a block and among blocks.
#define TILE_X 16
#define TILE_ROWS 64     // 8 x 8
#define TILE_BLOCKS 128  // 8 x 4 x 4

// A smooth brick and the inverse of the forward map in it. With h = -0.5 .. 0.5 along each axis the forward
// map is p = m + J (h + n(h)); inverse: h = q - n(h), q = J^-1 (p - m), iterated `steps` times.
typedef struct {
  float inverse[12];     // rows of q = A p + b
  float middle[3];       // of the brick, template voxels
  float core, reach;     // |h| within which it claims in full, and at all
  float slack;           // greatest |n|
  int steps, all_inner;  // all nodes inner body
  int bone_nodes;        // how many are bone, of KVX_BLOCK_NODES
  float squares[9], products[9],
      cube[3];  // n = squares h_i^2 + products (yz, zx, xy) + cube xyz; [term][axis]
  int unused[2];
} KvxCell;  // 176 bytes

// Posed voxels that unit cells of a rough brick may claim. A landing's 64 bits are its rank and, 15 bits
// each, its template place z, y, x in steps of KVX_PLACE_STEP voxels from one voxel below the brick's first
// node. Rank: claim << 16 | unit cell << 10 | voxel in its tile: block << 3 | voxel in the block.
#define KVX_LANDINGS 64
#define KVX_PLACE_STEP (6.0f / 32768.0f)
typedef struct {
  int next;                // the next chunk of the same brick, or -1
  float base[3];           // one voxel below the brick's first node
  int tile[KVX_LANDINGS];  // -1 beyond the last
  uint landing[KVX_LANDINGS][2];
} KvxChunk;

// What became of a brick: the box of the voxels that it may claim, how many unit cells of body folded, and
// its first chunk of landings, or KVX_SMOOTH where it is a cell.
#define KVX_SMOOTH -2
typedef struct {
  int box[6];
  int folded, first_chunk;
} KvxBrickCells;

// Axes in the order in which a tetrahedron's path from corner (0,0,0) to corner (1,1,1) takes them; even ones
// first.
constant int KVX_PATH[18] = {0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 2, 1, 2, 1, 0, 1, 0, 2};

// Bits of a brick's 5x5x5 nodes, from the layer at height z on.
static ulong kvx_bits_from(global const uint* tissue, const int word, const int z) {
  const ulong low = tissue[word] | (ulong)tissue[word + 1] << 32,
              high = tissue[word + 2] | (ulong)tissue[word + 3] << 32;
  const int first = 25 * z;
  if (first == 0) return low;
  return first < 64 ? low >> first | high << (64 - first) : high >> (first - 64);
}
