// Dense things in a CT that lie in air, as a scanner's table or a cast does, and not in tissue, as bones do.
#pragma once
#include "core/image.h"

namespace kvx {

struct DenseInAir {
  int dropped;  // pieces
  bool
      all;  // nothing as large as a bone would be left: bones without flesh, or a cast that touches its bones
};

// Clears the pieces of `dense` of 5 cm3 and more whose surface mostly falls to air within 4 mm, always
// downhill in density; none where no other piece is as large as a bone.
DenseInAir DropPiecesInAir(const Volume& scan_hu, Mask& dense);

}  // namespace kvx
