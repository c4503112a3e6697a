// A stroke voxel on a slope of the picture, or a dark one, starts late: it may lie on the bone's border.
#include "pipeline/segmentation/strokes/stroke_reach.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr size_t kLeastVoxels = 3;        // of a group
constexpr double kSameCompartment = 0.3;  // contrast on the way between two groups
constexpr float kBright = 0.75f;          // of the marrow's level

using Groups = std::vector<std::vector<size_t>>;

// Farthest-point sampling, then every voxel goes to the nearest of the sampled ones. Many are as far from
// each other, so distances are those of the grid, where no rounding of places in the world decides.
Groups GroupsByPlace(const Grid& grid, const std::vector<size_t>& voxels, size_t most) {
  const size_t count = std::clamp<size_t>(voxels.size() / kLeastVoxels, 1, most);
  const auto place = [&](size_t v) -> Eigen::Vector3d {
    return grid.Ijk(v).cast<double>().cwiseProduct(grid.spacing_mm);
  };
  std::vector<double> nearest(voxels.size(), 1e300);
  std::vector<size_t> group(voxels.size(), 0);
  size_t centre = 0;
  for (size_t g = 0; g < count; ++g) {
    for (size_t n = 0; n < voxels.size(); ++n) {
      const double d = (place(voxels[n]) - place(voxels[centre])).squaredNorm();
      if (d < nearest[n]) nearest[n] = d, group[n] = g;
    }
    centre = size_t(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  Groups groups(count);
  for (size_t n = 0; n < voxels.size(); ++n) groups[group[n]].push_back(voxels[n]);
  return groups;
}

// Half the largest change across the voxel along an axis.
double Slope(const Volume& relative, size_t v) {
  const Eigen::Vector3i p = relative.grid.Ijk(v);
  double slope = 0;
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] > 0 && p[axis] + 1 < relative.grid.size[axis]) {
      slope =
          std::max(slope, 0.5 * std::abs(double(relative.values[v + stride]) - relative.values[v - stride]));
    }
    stride *= size_t(relative.grid.size[axis]);
  }
  return slope;
}

// The group's voxels, the ones most surely in the bone first; none of a group without a bright one.
std::vector<GeodesicSource> SourcesOf(const Volume& relative, const std::vector<size_t>& voxels,
                                      const GeodesicOptions& options) {
  std::vector<GeodesicSource> sources;
  float least = INFINITY;
  for (const size_t v : voxels) {
    const double doubt = Slope(relative, v) + std::max(0.0, 1.0 - relative.values[v]);
    sources.push_back({v, float(options.mm_per_contrast * doubt)});
    if (relative.values[v] >= kBright) least = std::min(least, sources.back().head_start_mm);
  }
  if (least == INFINITY) return {};
  for (GeodesicSource& source : sources) source.head_start_mm = std::max(0.0f, source.head_start_mm - least);
  return sources;
}

// Numbers of the compartments: groups that reach each other are in one.
std::vector<int> Compartments(const std::vector<Image<float>>& distance, const Groups& groups,
                              double same_mm) {
  std::vector<int> compartment(groups.size());
  std::iota(compartment.begin(), compartment.end(), 0);
  for (size_t a = 0; a < groups.size(); ++a) {
    for (size_t b = 0; b < groups.size(); ++b) {
      float way = INFINITY;
      for (const size_t v : groups[b]) way = std::min(way, distance[a].values[v]);
      if (way > same_mm || compartment[a] == compartment[b]) continue;
      const int from = compartment[b], to = compartment[a];  // not elements of what is changed
      std::replace(compartment.begin(), compartment.end(), from, to);
    }
  }
  return compartment;
}

}  // namespace

Image<float> ReachFromStrokes(const Volume& relative, const std::vector<size_t>& strokes,
                              const GeodesicOptions& options, size_t most_groups) {
  Groups groups;
  std::vector<std::vector<GeodesicSource>> sources;
  for (std::vector<size_t>& group : GroupsByPlace(relative.grid, strokes, most_groups)) {
    std::vector<GeodesicSource> from = SourcesOf(relative, group, options);
    if (from.empty()) continue;  // it reaches nothing, and has no say in what others do
    groups.push_back(std::move(group));
    sources.push_back(std::move(from));
  }
  std::vector<Image<float>> distance(groups.size());
  ParallelFor(groups.size(), [&](size_t g) {
    distance[g] = GeodesicDistance(relative, sources[g], options);
    for (float& d : distance[g].values) d = std::min(d, float(options.most_mm));
  });
  const std::vector<int> compartment =
      Compartments(distance, groups, kSameCompartment * options.mm_per_contrast);
  Image<float> reach(relative.grid, float(options.most_mm));
  std::vector<float> ways;
  for (size_t c = 0; c < groups.size(); ++c) {
    const size_t members = size_t(std::count(compartment.begin(), compartment.end(), int(c)));
    if (members == 0) continue;
    const size_t agreed = std::min<size_t>((members - 1) / 4, 3);
    for (size_t v = 0; v < reach.values.size(); ++v) {
      ways.clear();
      for (size_t g = 0; g < groups.size(); ++g) {
        if (compartment[g] == int(c)) ways.push_back(distance[g].values[v]);
      }
      std::nth_element(ways.begin(), ways.begin() + agreed, ways.end());
      reach.values[v] = std::min(reach.values[v], ways[agreed]);
    }
  }
  return reach;
}

}  // namespace kvx
