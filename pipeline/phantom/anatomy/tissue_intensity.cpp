// Tissues are painted from the inside out: fat, muscles, cords, bones, skin; each covers what its distance
// says, edges soft.
#include "pipeline/phantom/anatomy/tissue_intensity.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/numbers/smooth_step.h"
#include "pipeline/phantom/trilinear.h"

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

constexpr double kSeptumMm = 0.9;  // of fat between two muscles
constexpr double kReachMm = 6;     // beyond which a shape cannot matter to a point

// air, skin, subcutaneous fat, muscle, tendon, cortical, marrow, cartilage, vessel, deep fat, capsule (joint
// fluid)
constexpr std::array<double, kTissueCount> kMeans = {0, 100, 186, 88, 32, 18, 176, 120, 44, 158, 80};
constexpr std::array<double, kTissueCount> kContrast = {0,   .15, .18, .24, .15, .12,
                                                        .22, .10, .12, .24, .08};  // of texture
constexpr std::array<double, kTissueCount> kGrainMm = {1, 8, 13, 10, 6, 6, 13, 8, 6, 13, 8};

std::vector<Box> BoxesOf(const auto& parts) {
  std::vector<Box> boxes;
  for (const auto& part : parts) boxes.push_back(part.shape.Bounds().Grown(kReachMm));
  return boxes;
}

}  // namespace

// The picture so far at one point. A layer with signed distance d covers 1 inside, 0 outside, linearly over
// the edge.
struct TissueModel::Layers {
  TissueSample sample;
  double edge_mm;

  template <class Intensity>
  void Paint(Tissue tissue, double distance_mm, const Intensity& intensity) {
    const double cover = std::clamp(0.5 - distance_mm / edge_mm, 0.0, 1.0);
    if (cover <= 0) return;
    sample.intensity += cover * (intensity() - sample.intensity);
    if (distance_mm <= 0) sample.tissue = tissue;
  }
};

TissueModel::TissueModel(const Anatomy& anatomy, uint64_t seed)
    : anatomy_(anatomy),
      seed_(Stream(seed, "texture")),
      muscle_boxes_(BoxesOf(anatomy.muscles)),
      cord_boxes_(BoxesOf(anatomy.cords)),
      bone_boxes_(BoxesOf(anatomy.bones)) {
  Random random(seed, "tissue means");
  for (size_t t = 1; t < kTissueCount; ++t) means_[t] = kMeans[t] * random.Uniform(0.93, 1.07);
}

double TissueModel::Textured(Tissue tissue, const Vector3d& rest, int part) const {
  const size_t t = size_t(tissue);
  Vector3d p = rest / kGrainMm[t];
  const uint64_t seed = seed_ + 131 * t + 7 * uint64_t(part + 1);
  if (tissue == Tissue::kMuscle) {  // bundles: long along the fibre
    const Vector3d& fibre = anatomy_.muscles[size_t(part)].fibre;
    p -= 0.85 * fibre * fibre.dot(p);
  }
  const double shading = SmoothNoise(rest / 35.0, seed ^ 0x55) * 0.5;
  return means_[t] * (1.0 + kContrast[t] * (LayeredNoise(p, seed, 3) + shading));
}

void TissueModel::PaintSoft(const Vector3d& rest, double depth, Layers& layers) const {
  const double fat =
      anatomy_.fat_mm * (1.0 + 0.25 * SmoothNoise(rest / 40.0, seed_ ^ 0x77)) + anatomy_.skin_mm;
  layers.Paint(Tissue::kDeepFat, -1e3, [&] { return Textured(Tissue::kDeepFat, rest, 0); });
  layers.Paint(Tissue::kSubcutaneousFat, depth - fat,
               [&] { return Textured(Tissue::kSubcutaneousFat, rest, 0); });
  int muscle = -1;
  double nearest = 1e3, second = 1e3;
  for (size_t m = 0; m < anatomy_.muscles.size(); ++m) {
    if (!muscle_boxes_[m].Contains(rest)) continue;
    const double d = anatomy_.muscles[m].shape.Distance(rest);
    if (d < nearest)
      second = nearest, nearest = d, muscle = int(m);
    else
      second = std::min(second, d);
  }
  if (muscle >= 0) {  // muscles that meet keep a septum between them, and stay under the fat
    const double d = std::max({nearest, 0.5 * (nearest - second + kSeptumMm), fat - depth});
    layers.Paint(Tissue::kMuscle, d, [&] { return Textured(Tissue::kMuscle, rest, muscle); });
  }
  for (size_t c = 0; c < anatomy_.cords.size(); ++c) {
    if (!cord_boxes_[c].Contains(rest)) continue;
    const Tissue tissue = anatomy_.cords[c].tissue;
    layers.Paint(tissue, anatomy_.cords[c].shape.Distance(rest),
                 [&] { return Textured(tissue, rest, int(c)); });
  }
}

void TissueModel::PaintBones(const Vector3d& rest, Layers& layers) const {
  for (size_t b = 0; b < anatomy_.bones.size(); ++b) {
    if (!bone_boxes_[b].Contains(rest)) continue;
    const PhantomBone& bone = anatomy_.bones[b];
    const double d = bone.shape.Distance(rest);
    if (d > kReachMm) continue;
    layers.Paint(Tissue::kCartilage, anatomy_.RigidDistance(int(b), rest),
                 [&] { return Textured(Tissue::kCartilage, rest, 0); });
    layers.Paint(Tissue::kCortical, d, [&] { return Textured(Tissue::kCortical, rest, int(b)); });
    const Box box = bone.shape.Bounds();
    Eigen::Index axis;
    (box.high - box.low).maxCoeff(&axis);  // thick along the shaft, thin at the ends
    const double along =
        2.0 * (rest[axis] - 0.5 * (box.low[axis] + box.high[axis])) / (box.high[axis] - box.low[axis]);
    const double ends = SmoothStep(0.35, 0.8, std::abs(along));
    const double cortex = bone.cortex_shaft_mm + ends * (bone.cortex_end_mm - bone.cortex_shaft_mm);
    layers.Paint(Tissue::kMarrow, d + cortex, [&] { return Textured(Tissue::kMarrow, rest, int(b)); });
  }
}

TissueSample TissueModel::At(const Vector3d& rest, double edge_mm) const {
  const double skin = anatomy_.body.Distance(rest);
  if (skin > edge_mm) return {};
  Layers layers{{}, edge_mm};
  PaintSoft(rest, -skin, layers);
  PaintBones(rest, layers);
  layers.Paint(Tissue::kSkin, -skin - anatomy_.skin_mm, [&] { return Textured(Tissue::kSkin, rest, 0); });
  layers.Paint(Tissue::kAir, -skin, [] { return 0.0; });
  return layers.sample;
}

int TissueModel::BoneAt(const Vector3d& rest) const {
  for (size_t b = 0; b < anatomy_.bones.size(); ++b) {
    if (bone_boxes_[b].Contains(rest) && anatomy_.bones[b].shape.Distance(rest) <= 0) return int(b);
  }
  return -1;
}

MaterialMap::MaterialMap(const Anatomy& anatomy, const TissueModel& tissues, double step_mm)
    : step_mm_(step_mm), box_(anatomy.body.Bounds().Grown(2 * step_mm)) {
  size_ = ((box_.high - box_.low) / step_mm).array().ceil().cast<int>() + 1;
  intensities_.resize(size_t(size_.x()) * size_.y() * size_.z());
  ParallelFor(size_.z(), [&](int k) {
    size_t index = size_t(k) * size_.x() * size_.y();
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i, ++index) {
        intensities_[index] = float(tissues.At(box_.low + step_mm * Vector3d(i, j, k), step_mm).intensity);
      }
    }
  });
}

double MaterialMap::Intensity(const Vector3d& rest) const {
  return TrilinearAt(intensities_, size_, (rest - box_.low) / step_mm_).value_or(0);
}

double MaterialMap::MeanInBody() const {
  double sum = 0, count = 0;
  for (const float v : intensities_) {
    if (v > 10) sum += v, ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace kvx::phantom
