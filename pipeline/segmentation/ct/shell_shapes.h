// What the dense parts of a bone enclose where a threshold found no more of it than a shell and a mesh.
#pragma once
#include <map>
#include <set>

#include "core/voxels/voxel_box.h"

namespace kvx {

struct ShellShape {
  VoxelBox box;  // of the parts' grid; the masks are in it
  Mask marrow;   // surely within the bone, and no part of its own or another's
  Mask reach;    // where its bone may be
};

// Of these labels of `parts`, each by itself. Marrow lies deep in what the part encloses once gaps of 4 mm (4
// voxels) are closed; the reach goes a little beyond what encloses all that is half as dense as `level_hu`
// near it.
std::map<int, ShellShape> ShapesOfShells(const Volume& scan_hu, const LabelMap& parts,
                                         const std::set<int>& labels, double level_hu);

}  // namespace kvx
