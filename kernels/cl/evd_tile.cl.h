// A tile of posed voxels in local memory, and where the voxels of a pair of its blocks lie around their
// middle.
#define LANE_X                                                                                          \
  (float16)(-1.5f, -0.5f, -1.5f, -0.5f, -1.5f, -0.5f, -1.5f, -0.5f, 0.5f, 1.5f, 0.5f, 1.5f, 0.5f, 1.5f, \
            0.5f, 1.5f)
#define LANE_Y                                                                                          \
  (float16)(-0.5f, -0.5f, 0.5f, 0.5f, -0.5f, -0.5f, 0.5f, 0.5f, -0.5f, -0.5f, 0.5f, 0.5f, -0.5f, -0.5f, \
            0.5f, 0.5f)
#define LANE_Z                                                                                          \
  (float16)(-0.5f, -0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f, -0.5f, -0.5f, -0.5f, -0.5f, 0.5f, 0.5f, \
            0.5f, 0.5f)

// Block by block, what claims its voxels, and the template place that lands there. While bricks claim, a
// claim is followed by the brick's place in the tile's list and its unit cell: of equals the first wins.
typedef struct {
  int claim[8 * TILE_BLOCKS];
  float x[8 * TILE_BLOCKS], y[8 * TILE_BLOCKS], z[8 * TILE_BLOCKS];
} KvxTile;
