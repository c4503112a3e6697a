// Local means tell tissue from air where single voxels do not; they are taken away from bright tissue, of
// which a voxel beside it holds a part.
#include "pipeline/skinning/dim_tissue.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "core/voxels/gaussian_blur.h"

namespace kvx {
namespace {

constexpr int kShy = 2;               // voxels that means keep away from the body
constexpr int kBlurs = 4;             // a Gaussian of 1.4 voxels, some hundred voxels
constexpr double kAboveAir = 0.6;     // of air's standard deviation
constexpr double kAboveMeans = 3;     // of the standard deviation of air's local means
constexpr double kMostOpen = 0.2;     // of a piece's surface may be open to air
constexpr double kMostCut = 0.7;      // of its surface to the body is as large as what the view cuts of it
constexpr double kSmallPiece = 1e-3;  // of the body: smaller ones are left to FillHoles

// The mean around each voxel, over the mask only.
Volume LocalMeans(const Volume& volume, const Mask& mask) {
  Volume sum(volume.grid), count(volume.grid);
  ParallelEach(sum.values.size(), [&](size_t v) {
    count.values[v] = mask.values[v] ? 1.0f : 0.0f;
    sum.values[v] = count.values[v] * volume.values[v];
  });
  BinomialBlur(sum, kBlurs), BinomialBlur(count, kBlurs);
  ParallelEach(sum.values.size(), [&](size_t v) { sum.values[v] /= std::max(count.values[v], 1e-6f); });
  return sum;
}

// What local means of air do not reach: most of what lies beside a body is air.
double MostOfAir(const Volume& means, const Mask& away, const AirLevel& level) {
  const size_t slices = size_t(away.grid.size.z()), voxels = away.values.size() / slices;  // of a slice
  std::vector<float> values = ParallelCollect<float>(slices, [&](std::vector<float>& list, size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v)
      if (away.values[v]) list.push_back(means.values[v]);
  });
  if (values.empty()) return 0;
  const double middle = TakeMedian(values);
  return middle + std::max(kAboveAir * level.spread, kAboveMeans * (middle - TakeQuantile(values, 0.16)));
}

// Brighter than air, away from the body, and back to it.
Mask DimVoxels(const Volume& smooth, const Mask& outside, const AirLevel& level) {
  Mask away = outside;
  for (int n = 0; n < kShy; ++n) away = Eroded(away);
  const Volume means = LocalMeans(smooth, away);
  const double least = MostOfAir(means, away, level);
  Mask dim(outside.grid);
  ParallelEach(dim.values.size(),
               [&](size_t v) { dim.values[v] = away.values[v] && means.values[v] > least; });
  for (int n = 0; n < kShy; ++n) {
    dim = Dilated(dim);
    ParallelEach(dim.values.size(), [&](size_t v) { dim.values[v] &= outside.values[v]; });
  }
  return dim;
}

// Faces of voxels.
struct Surface {
  size_t to_body = 0, to_air = 0, beyond_view = 0;
  bool Enclosed() const {
    return double(to_air) <= kMostOpen * double(to_air + to_body) &&
           double(beyond_view) <= kMostCut * double(to_body);
  }
};

// Dark holes in a piece (bones) are none of its surface.
std::vector<Surface> SurfacesOf(const Components& pieces, const Mask& body) {
  std::vector<Surface> out(pieces.voxels.size());
  Mask all = body;
  ParallelEach(all.values.size(), [&](size_t v) { all.values[v] |= pieces.piece.values[v] >= 0; });
  all = FillHoles(all);
  const Grid& grid = body.grid;
  for (size_t v = 0; v < body.values.size(); ++v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece < 0) continue;
    const Eigen::Vector3i p = grid.Ijk(v);
    size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool up : {false, true}) {
        if (up ? p[axis] + 1 == grid.size[axis] : p[axis] == 0) {
          ++out[piece].beyond_view;
          continue;
        }
        const size_t beside = up ? v + stride : v - stride;
        if (pieces.piece.values[beside] >= 0) continue;
        if (body.values[beside]) ++out[piece].to_body;
        if (!all.values[beside]) ++out[piece].to_air;
      }
      stride *= size_t(grid.size[axis]);
    }
  }
  return out;
}

}  // namespace

Mask WithDimTissue(const Volume& smooth, const Mask& body, const AirLevel& level) {
  const Components pieces = LabelComponents(DimVoxels(smooth, Complement(body), level));
  const std::vector<Surface> surfaces = SurfacesOf(pieces, body);
  const double least = kSmallPiece * double(std::ranges::count(body.values, 1));
  Mask out = body;
  ParallelEach(out.values.size(), [&](size_t v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece < 0 || double(pieces.voxels[piece]) < least) return;
    out.values[v] = surfaces[piece].Enclosed();
  });
  return out;
}

}  // namespace kvx
