// Half way up the rise from a shell to what lies beyond is outside a bone when the shell is thinner than the
// blur, so a model of the profile takes the place of a level. Neighbours on the surface decide together, on
// the thickness, too: shafts have more cortex than ends.
#include "pipeline/segmentation/mr/shells/place_shells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/sample_clamped.h"
#include "pipeline/segmentation/mr/shells/shell_models.h"
#include "pipeline/segmentation/mr/shells/smooth_surface.h"

namespace kvx {
namespace {

constexpr double kTogetherVoxels = 1.0;  // normal deviation of the neighbourhood that decides together
constexpr double kCalmVoxels = 0.7;      // the same, of the offsets that were found
constexpr float kMostMisfit = 0.05;      // a profile that nothing explains says no more than that
constexpr double kLeastBlur = 0.4, kMostBlur = 1.0, kBlurStep = 0.1;
constexpr double kAlike = 1.25;          // thicknesses of a scan's thin shells, to the median
constexpr double kThicknessTie = 0.006;  // misfit of a shell a voxel off what is usual for the bone
constexpr double kResolvedTie = 0.001;   // the same, of one that is resolved
constexpr double kStayTie = 0.0005;      // misfit of moving such a one by a voxel
constexpr double kUnseenTie = 1e-5;      // the same, of others: a surface of which nothing is seen stays
constexpr double kBeside = 1.3;  // half a voxel on either side of a shell, and what the thickness may err by
constexpr double kResolved = 1.4;  // blurs: a shell as thick is as dark in its middle as it is

constexpr size_t kProfiles = 400, kFewProfiles = 100;  // that a thickness is read from, about
constexpr int kRounds = 3;  // a surface that was found is a better start than the first

constexpr int kThicknesses = ShellModels::kThicknesses;
const double kOffsetStep = ShellProfile::OffsetOf(1) - ShellProfile::OffsetOf(0);

struct Profile {
  ShellProfile::Samples samples;
  int radius = 0;  // number of the bone's
};
using Profiles = std::vector<Profile>;
using MisfitTable = std::array<ShellProfile::Misfits, kThicknesses>;

Profiles ProfilesAt(const Volume& relative, const SmoothSurface& surface) {
  const double voxel_mm = relative.grid.MeanSpacingMm();
  const Eigen::Vector3d voxels_per_mm = relative.grid.spacing_mm.cwiseInverse();
  Profiles profiles(surface.points().size());
  for (size_t p = 0; p < profiles.size(); ++p) {
    const SurfacePoint& point = surface.points()[p];
    profiles[p].radius = ShellModels::NumberOfRadius(point.depth_mm / voxel_mm);
    for (int n = 0; n < ShellProfile::kSamples; ++n) {
      const Eigen::Vector3d mm = point.at_mm + ShellProfile::PlaceOf(n) * voxel_mm * point.outwards;
      profiles[p].samples[n] = SampleClamped(relative, PointVox{mm.cwiseProduct(voxels_per_mm)});
    }
  }
  return profiles;
}

// Of about so many profiles.
double MedianOfLeast(const Profiles& profiles, const ShellModels& models, int thickness, size_t count) {
  std::vector<float> least;
  const size_t step = profiles.size() / count + 1;
  for (size_t p = 0; p < profiles.size(); p += step) {
    const auto misfits = models.MisfitsOf(profiles[p].samples, profiles[p].radius, thickness);
    least.push_back(*std::ranges::min_element(misfits));
  }
  return TakeMedian(least);
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

struct Thickness {
  double voxels = 0, misfit = 1;
};

Thickness ThicknessOf(const Profiles& profiles, const ShellModels& models, size_t count) {
  if (profiles.empty()) return {};
  std::array<double, kThicknesses> misfits;
  for (int t = 0; t < kThicknesses; ++t) misfits[t] = MedianOfLeast(profiles, models, t, count);
  return {ShellModels::ThicknessOf(LeastOf(misfits)), *std::ranges::min_element(misfits)};
}

// Thin shells of one person are much alike; that of a bone a few voxels thick is hard to read. What is usual
// of them; 0 where none is thin.
double MakeAlike(std::vector<PlacedShell>& shells) {
  std::vector<double> thin;
  for (const PlacedShell& shell : shells) {
    if (!shell.resolved) thin.push_back(shell.thickness_voxels);
  }
  if (thin.empty()) return 0;
  std::ranges::sort(thin);
  const double usual = thin[thin.size() / 2];
  for (PlacedShell& shell : shells) {
    if (!shell.resolved)
      shell.thickness_voxels = std::clamp(shell.thickness_voxels, usual / kAlike, usual * kAlike);
  }
  return usual;
}

// The blur that explains all bones best, each with its own thickness. A coarse search of few profiles does.
double BlurOf(const std::vector<Profiles>& bones) {
  const int steps = int(std::lround((kMostBlur - kLeastBlur) / kBlurStep));
  std::vector<double> misfits(size_t(steps) + 1, 0);
  ParallelFor(misfits.size(), [&](size_t n) {
    const ShellModels models(kLeastBlur + kBlurStep * double(n));
    for (const Profiles& bone : bones)
      misfits[n] += std::log(ThicknessOf(bone, models, kFewProfiles).misfit + 1e-9);
  });
  return kLeastBlur + kBlurStep * LeastOf(misfits);
}

std::vector<MisfitTable> MisfitsOf(const Profiles& profiles, const ShellModels& models, double stay_tie) {
  std::vector<MisfitTable> tables(profiles.size());
  ParallelFor(tables.size(), [&](size_t p) {
    for (int t = 0; t < kThicknesses; ++t) {
      tables[p][t] = models.MisfitsOf(profiles[p].samples, profiles[p].radius, t);
      for (int o = 0; o < ShellProfile::kOffsets; ++o) {
        const double moved = ShellProfile::OffsetOf(o);
        tables[p][t][o] = std::min(tables[p][t][o], kMostMisfit) + float(stay_tie * moved * moved);
      }
    }
  });
  return tables;
}

// Where the shell's outer side is, in voxels, by the sums over a neighbourhood of so many profiles. A shell
// may be thinner here than is usual for the bone, or thicker, but says so at a price.
double OffsetBy(const MisfitTable& sums, double profiles, const PlacedShell& usual) {
  const double tie = usual.resolved ? kResolvedTie : kThicknessTie;
  std::array<double, kThicknesses> least;
  for (int t = 0; t < kThicknesses; ++t) {
    const double unusual = ShellModels::ThicknessOf(t) - usual.thickness_voxels;
    least[t] = *std::ranges::min_element(sums[t]) + profiles * tie * unusual * unusual;
  }
  const double at = LeastOf(least);
  const int thinner = std::min(int(at), kThicknesses - 2);
  const double number = std::lerp(LeastOf(sums[thinner]), LeastOf(sums[thinner + 1]), at - thinner);
  return ShellProfile::OffsetOf(0) + kOffsetStep * number;
}

// One per point of the surface, in voxels; none (NaN) of those that were not chosen.
std::vector<double> OffsetsOf(const SmoothSurface& surface, const std::vector<MisfitTable>& own,
                              const PlacedShell& usual) {
  const double together_mm = kTogetherVoxels * usual.mask.grid.MeanSpacingMm();
  std::vector<double> offsets(own.size(), NAN);
  ParallelFor(own.size(), [&](size_t p) {
    if (!surface.points()[p].chosen) return;
    MisfitTable sums{};
    double weights = 0;
    surface.ForEachNear(surface.points()[p].at_mm, together_mm, [&](size_t q, double weight) {
      weights += weight;
      for (int t = 0; t < kThicknesses; ++t) {
        for (size_t o = 0; o < sums[t].size(); ++o) sums[t][o] += float(weight) * own[q][t][o];
      }
    });
    offsets[p] = OffsetBy(sums, weights, usual);
  });
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
      if (surface.points()[p].chosen) sum += weight * offset_voxels[p], weights += weight;
    });
    if (weights > 0) moved.values[v] = nearest->beyond_mm < voxel_mm * sum / weights;
  }
  return moved;
}

// Of marrow's voxels and the outermost of the shell, the centres are at most so far apart.
Mask NearMarrow(const RoughBone& bone, double thickness_voxels) {
  const double reach_mm = (kBeside + thickness_voxels) * bone.mask.grid.MeanSpacingMm();
  const Volume from_marrow_mm = DistanceMapMm(bone.marrow);
  Mask near = bone.mask;
  for (size_t v = 0; v < near.values.size(); ++v) near.values[v] &= from_marrow_mm.values[v] <= reach_mm;
  return near;
}

// Marrow in the bone stays: where no shell lies under the surface (a cut end), the surface has nothing to go
// by.
void Settle(const RoughBone& bone, const ShellModels& models, PlacedShell& shell) {
  for (int round = 0; round < kRounds; ++round) {
    const SmoothSurface surface(shell.mask);
    const std::vector<MisfitTable> misfits =
        MisfitsOf(ProfilesAt(bone.relative, surface), models, shell.resolved ? kStayTie : kUnseenTie);
    shell.mask = Moved(shell.mask, surface, OffsetsOf(surface, misfits, shell));
    for (size_t v = 0; v < shell.mask.values.size(); ++v)
      shell.mask.values[v] |= bone.marrow.values[v] & bone.mask.values[v];
  }
}

Profiles ProfilesAround(const Volume& relative, const Mask& mask) {
  return ProfilesAt(relative, SmoothSurface(mask));
}

// As it is before its surface moves. What is usual of a long bone holds for its ends, not for its shaft.
PlacedShell Judged(const RoughBone& bone, const Profiles& profiles, const ShellModels& models, double blur) {
  PlacedShell shell{bone.mask, ThicknessOf(profiles, models, kProfiles).voxels};
  shell.resolved = !bone.small || profiles.empty() || shell.thickness_voxels > kResolved * blur;
  if (shell.resolved) return shell;
  shell.mask = NearMarrow(bone, shell.thickness_voxels);
  shell.thickness_voxels = ThicknessOf(ProfilesAround(bone.relative, shell.mask), models, kProfiles).voxels;
  return shell;
}

// How far a voxel may lie beyond the marrow and be in the shell for sure; less, and then none, the better a
// scan shows where shells end.
double SurelyShellVoxels(double thickness_voxels, double usual_voxels, double blur) {
  constexpr double kShare = 0.6, kAlways = 0.3;
  constexpr double kHidden = 1.0, kSeen = 1.2;  // blurs
  constexpr double kLess = 0.3;                 // half-way
  const double hidden = std::clamp((kSeen - usual_voxels / blur) / (kSeen - kHidden), 1e-3, 1.0);
  return kAlways + kShare * thickness_voxels - kLess * (1 / hidden - 1);
}

// A shell thinner than the blur is as dark as one that is darker and thinner still, so a search may have
// ended in it: what is nearer to the marrow than the shell is thick is bone.
void FillShell(const RoughBone& bone, double usual_voxels, double blur, PlacedShell& shell) {
  const double voxel_mm = shell.mask.grid.MeanSpacingMm();
  const double sure_mm = SurelyShellVoxels(shell.thickness_voxels, usual_voxels, blur) * voxel_mm;
  if (shell.resolved || sure_mm <= 0) return;
  Mask marrow = bone.marrow;
  for (size_t v = 0; v < marrow.values.size(); ++v) marrow.values[v] &= shell.mask.values[v];
  const SmoothSurface surface(marrow);
  for (size_t v = 0; v < marrow.values.size(); ++v) {
    const std::optional<SurfacePoint> under = surface.Under(v);
    if (under && under->beyond_mm < sure_mm) shell.mask.values[v] = 1;
  }
}

}  // namespace

std::vector<PlacedShell> PlaceShells(const std::vector<RoughBone>& bones) {
  if (bones.empty()) return {};
  std::vector<Profiles> profiles(bones.size());
  ParallelFor(bones.size(),
              [&](size_t b) { profiles[b] = ProfilesAround(bones[b].relative, bones[b].mask); });
  const double blur = BlurOf(profiles);
  const ShellModels models(blur);
  std::vector<PlacedShell> shells(bones.size());
  ParallelFor(bones.size(), [&](size_t b) { shells[b] = Judged(bones[b], profiles[b], models, blur); });
  const double usual_voxels = MakeAlike(shells);
  ParallelFor(bones.size(), [&](size_t b) {
    FillShell(bones[b], usual_voxels, blur, shells[b]);
    Settle(bones[b], models, shells[b]);
  });
  return shells;
}

}  // namespace kvx
