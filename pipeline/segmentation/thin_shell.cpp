// Half way up the rise from a shell to what lies beyond is outside a bone when the shell is thinner than the
// blur, so a model of the profile takes the place of a level. Neighbours on the surface decide together.
#include "pipeline/segmentation/thin_shell.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/parallel.h"
#include "core/sample_clamped.h"
#include "pipeline/segmentation/shell_profile.h"
#include "pipeline/segmentation/smooth_surface.h"

namespace kvx {
namespace {

constexpr double kTogetherVoxels = 1.5;  // normal deviation of the neighbourhood that decides together
constexpr double kCalmVoxels = 0.7;      // the same, of the offsets that were found
constexpr float kMostMisfit = 0.05;      // a profile that nothing explains says no more than that
constexpr double kLeastThickness = 0.1, kMostThickness = 2.0;  // voxels
constexpr double kLeastBlur = 0.4, kMostBlur = 1.0, kBlurStep = 0.1;
constexpr double kReadLow = 0.05;  // by how much a blur is read too low where the truth is known
constexpr double kAlike = 1.25;    // thicknesses of a scan's thin shells, to the median
constexpr double kResolved = 1.4;  // blurs: a shell as thick is as dark in its middle as it is

const double kOffsetStep = ShellProfile::OffsetOf(1) - ShellProfile::OffsetOf(0);

using Profiles = std::vector<ShellProfile::Samples>;

Profiles ProfilesAt(const Volume& relative, const SmoothSurface& surface) {
  const double voxel_mm = relative.grid.MeanSpacingMm();
  const Eigen::Vector3d voxels_per_mm = relative.grid.spacing_mm.cwiseInverse();
  Profiles profiles(surface.points().size());
  for (size_t p = 0; p < profiles.size(); ++p) {
    const SurfacePoint& point = surface.points()[p];
    for (int n = 0; n < ShellProfile::kSamples; ++n) {
      const Eigen::Vector3d mm = point.at_mm + ShellProfile::PlaceOf(n) * voxel_mm * point.outwards;
      profiles[p][n] = SampleClamped(relative, PointVox{mm.cwiseProduct(voxels_per_mm)});
    }
  }
  return profiles;
}

// Of about so many profiles.
double MedianOfLeast(const Profiles& profiles, const ShellProfile& model, size_t count) {
  if (profiles.empty()) return 1;
  std::vector<float> least;
  const size_t step = profiles.size() / count + 1;
  for (size_t p = 0; p < profiles.size(); p += step) {
    const ShellProfile::Misfits misfits = model.MisfitsOf(profiles[p]);
    least.push_back(*std::ranges::min_element(misfits));
  }
  const auto middle = least.begin() + std::ptrdiff_t(least.size() / 2);
  std::nth_element(least.begin(), middle, least.end());
  return *middle;
}

struct Thickness {
  double voxels = kLeastThickness, misfit = INFINITY;
};

Thickness ThicknessOf(const Profiles& profiles, double blur, double step, size_t count) {
  Thickness best;
  for (double t = kLeastThickness; t <= kMostThickness; t += step) {
    const double misfit = MedianOfLeast(profiles, ShellProfile(blur, t), count);
    if (misfit < best.misfit) best = {t, misfit};
  }
  return best;
}

// The place of the least of a parabola through the least value and its neighbours.
template <class Values>
double LeastOf(const Values& values) {
  const int last = int(values.size()) - 1;
  const int at = std::clamp(int(std::ranges::min_element(values) - values.begin()), 1, last - 1);
  const double before = values[at - 1], after = values[at + 1];
  const double bend = std::max(before - 2.0 * values[at] + after, 1e-9);
  return at + std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
}

// Thin shells of one person are much alike; that of a bone a few voxels thick is hard to read.
void MakeAlike(std::vector<ThinShell>& shells) {
  std::vector<double> thin;
  for (const ThinShell& shell : shells) {
    if (!shell.resolved) thin.push_back(shell.thickness_voxels);
  }
  if (thin.empty()) return;
  std::ranges::sort(thin);
  const double usual = thin[thin.size() / 2];
  for (ThinShell& shell : shells) {
    if (!shell.resolved)
      shell.thickness_voxels = std::clamp(shell.thickness_voxels, usual / kAlike, usual * kAlike);
  }
}

// The blur that explains all bones best, each with its own thickness. A coarse search of few profiles does.
double BlurOf(const std::vector<Profiles>& bones) {
  std::vector<double> misfits;
  for (double blur = kLeastBlur; blur < kMostBlur + kBlurStep / 2; blur += kBlurStep) {
    std::vector<double> of_bone(bones.size(), 0);
    ParallelFor(bones.size(), [&](size_t b) {
      of_bone[b] = std::log(ThicknessOf(bones[b], blur, 0.2, 100).misfit + 1e-9);
    });
    misfits.push_back(std::accumulate(of_bone.begin(), of_bone.end(), 0.0));
  }
  return kLeastBlur + kBlurStep * LeastOf(misfits) + kReadLow;
}

// One per point of the surface, in voxels.
std::vector<double> OffsetsOf(const SmoothSurface& surface, const Profiles& profiles,
                              const ShellProfile& model, double voxel_mm) {
  std::vector<ShellProfile::Misfits> own(profiles.size());
  for (size_t p = 0; p < own.size(); ++p) {
    own[p] = model.MisfitsOf(profiles[p]);
    for (float& m : own[p]) m = std::min(m, kMostMisfit);
  }
  std::vector<double> offsets(own.size());
  for (size_t p = 0; p < own.size(); ++p) {
    ShellProfile::Misfits sum{};
    surface.ForEachNear(surface.points()[p].at_mm, kTogetherVoxels * voxel_mm, [&](size_t q, double weight) {
      for (size_t o = 0; o < sum.size(); ++o) sum[o] += float(weight) * own[q][o];
    });
    offsets[p] = ShellProfile::OffsetOf(0) + kOffsetStep * LeastOf(sum);
  }
  return offsets;
}

Mask Moved(const Mask& mask, const SmoothSurface& surface, const std::vector<double>& offset_voxels) {
  const double voxel_mm = mask.grid.MeanSpacingMm();
  Mask moved = mask;
  for (size_t v = 0; v < moved.values.size(); ++v) {
    const std::optional<SurfacePoint> nearest = surface.Under(v);
    if (!nearest) continue;
    double sum = 0, weights = 0;
    surface.ForEachNear(nearest->at_mm, kCalmVoxels * voxel_mm, [&](size_t p, double weight) {
      sum += weight * offset_voxels[p], weights += weight;
    });
    if (weights > 0) moved.values[v] = nearest->beyond_mm < voxel_mm * sum / weights;
  }
  return moved;
}

void Settle(const SmoothSurface& surface, const Profiles& profiles, const ShellProfile& model,
            ThinShell& shell) {
  shell.mask =
      Moved(shell.mask, surface, OffsetsOf(surface, profiles, model, shell.mask.grid.MeanSpacingMm()));
}

}  // namespace

std::vector<ThinShell> FitThinShells(const std::vector<RoughBone>& bones) {
  if (bones.empty()) return {};
  std::vector<ThinShell> shells(bones.size());
  std::vector<SmoothSurface> surfaces(bones.size());
  std::vector<Profiles> profiles(bones.size());
  ParallelFor(bones.size(), [&](size_t b) {
    shells[b].mask = bones[b].mask;
    surfaces[b] = SmoothSurface(bones[b].mask);
    profiles[b] = ProfilesAt(bones[b].relative, surfaces[b]);
  });
  const double blur = BlurOf(profiles);
  ParallelFor(bones.size(), [&](size_t b) {
    shells[b].thickness_voxels = ThicknessOf(profiles[b], blur, 0.1, 400).voxels;
    shells[b].resolved = profiles[b].empty() || shells[b].thickness_voxels > kResolved * blur;
  });
  MakeAlike(shells);
  ParallelFor(bones.size(), [&](size_t b) {
    const ShellProfile model(blur, shells[b].thickness_voxels);
    if (!shells[b].resolved) Settle(surfaces[b], profiles[b], model, shells[b]);
  });
  return shells;
}

}  // namespace kvx
