// Bone is what looks like its strokes and is not reached from elsewhere more easily. What looks like marrow
// may be fat, so looks alone never speak for bone; the dark wall of the cortex decides.
#include "pipeline/segmentation/mr/search/stroke_bone.h"

#include <cmath>

#include "core/numbers/quantile.h"
#include "core/voxels/distance_transform.h"
#include "pipeline/segmentation/mr/levels/marrow_level.h"
#include "pipeline/segmentation/mr/search/refined.h"
#include "pipeline/segmentation/strokes/stroke_remoteness.h"

namespace kvx {
namespace {

constexpr float kDark = 0.45f;            // cortex for sure
constexpr double kLeastDeviation = 0.06;  // of a tissue's relative intensity
constexpr double kMostNats = 3.0;         // a single voxel's say
constexpr double kFatNats = 0.5;          // the same, for bone
constexpr double kLeanNats = 3.0;
constexpr double kLinkNats = 6.0;
constexpr double kLeastEdge = 0.12;  // change of relative intensity that is an edge
constexpr float kNotBone = -0.3f;    // lean
constexpr float kRemote = 2.0f;      // remoteness that no bone has
constexpr double kFarthest = 0.6;    // contrast on a way from the strokes that leaves every bone
constexpr double kFarther = 2.1, kFartherWays = 1.5;  // times, in a search that goes farther
constexpr size_t kGroups = 24, kFewGroups = 8;        // of strokes that have to agree; few: in such a search
constexpr double kFoundWall = 0.12;                   // contrast on a way out of marrow that was found

// Of a cut with the shell: surfaces say more there.
constexpr double kFatNatsInShell = 1.0, kLeanNatsInShell = 2.0;
constexpr double kShellLinkNats = 4.0;
constexpr double kShellNats = 0.3;                       // of every voxel of the shell
constexpr double kAboveCortex = 0.5, kDarkScale = 0.15;  // from the cortex' intensity to no cortex
constexpr double kDarkNats = 1.0, kBrightNats = 1.5;     // for and against the shell

// What is so far from all that may be bone by its lean is none: nothing is looked for there.
void CloseFarFrom(const Image<float>& lean, Image<Side>& sides) {
  constexpr double kFarMm = 8;
  constexpr float kSurelyNot = -0.99f;
  Mask possible(lean.grid);
  for (size_t v = 0; v < possible.values.size(); ++v) possible.values[v] = lean.values[v] > kSurelyNot;
  const Image<double> squared_mm = SquaredDistanceMm(possible);
  for (size_t v = 0; v < sides.values.size(); ++v) {
    if (squared_mm.values[v] > kFarMm * kFarMm && sides.values[v] == Side::kFree)
      sides.values[v] = Side::kOutside;
  }
}

// By the ways from the bone and from elsewhere. What is remote from the strokes is rather not bone; `tight`:
// surely not.
float LeanOf(float own, float other, float remoteness, bool tight) {
  if (!std::isfinite(own)) return -1.0f;
  const float lean = std::isfinite(other) ? 2 * (other - own) / std::max(own + other, 1e-6f) : 1.0f;
  const float slope = tight ? 2.0f : 1.2f, most = tight ? 2.0f : 1.0f;
  return std::max(-1.0f, std::clamp(lean, -1.0f, 1.0f) - std::clamp(slope * (remoteness - 1), 0.0f, most));
}

}  // namespace

void TissueCounts::Add(const TissueCounts& other) {
  marrow.Add(other.marrow), rest.Add(other.rest), cortex.Add(other.cortex);
}

double TissueCounts::CortexLevel() const {
  constexpr double kEnough = 20, kUsual = 0.2;
  return cortex.Total() > kEnough ? cortex.Quantile(0.3) : kUsual;
}

StrokeBone::StrokeBone(const Volume& scan, const LabelMap& strokes, const LabelMap& air, int label,
                       const VoxelBox& box, const StrokeSearch& search)
    : search_(search),
      label_(label),
      box_(box),
      inner_low_(box.low.array() > 0),
      inner_high_(box.high.array() < scan.grid.size.array()),
      scan_(Cropped(scan, box)) {
  LabelMap marks = Cropped(strokes, box), beside = Cropped(air, box);
  if (search.fine) scan_ = Refined(scan_), marks = Refined(marks), beside = Refined(beside);
  own_ = other_ = air_ = Mask(scan_.grid);
  for (size_t v = 0; v < marks.values.size(); ++v) {
    own_.values[v] = marks.values[v] == label_;
    other_.values[v] = marks.values[v] != 0 && !own_.values[v];
    air_.values[v] = beside.values[v] != 0 && marks.values[v] == 0;
  }
  relative_ = Relative(own_);
  noise_ = EdgeOf(Noise());
  size_mm_ = SizeMm();
  remoteness_ = search.tight ? RemotenessFromHull(own_) : RemotenessFromLines(own_);
  if (search.far) {
    for (float& remoteness : remoteness_.values) remoteness /= float(kFarther);
  }
  FindLean();
}

// Strokes are too few, and too many of them on borders, to tell a slope by.
Volume StrokeBone::Relative(const Mask& bone) const {
  const bool sloping = !found_.values.empty() && size_mm_ > kLongMm;
  return RelativeTo(MarrowLevel(SamplesOf(scan_, bone), sloping ? MarrowLevel::kPlane : MarrowLevel::kMean),
                    scan_);
}

bool StrokeBone::SureStroke(size_t v) const { return own_.values[v] && relative_.values[v] >= kSurelyMarrow; }

// From what neighbouring voxels along i differ by in the strokes. What lies between voxels is no measurement.
double StrokeBone::Noise() const {
  constexpr double kUsual = 0.06, kLeast = 0.03, kMost = 0.08;
  const int voxel = search_.fine ? 2 : 1;  // samples
  std::vector<float> changes;
  for (size_t v = 0; v < own_.values.size(); ++v) {
    const Eigen::Array3i p = scan_.grid.Ijk(v);
    if (!own_.values[v] || (p / voxel * voxel != p).any() || p.x() + voxel >= scan_.grid.size.x()) continue;
    const float here = relative_.values[v], next = relative_.values[v + size_t(voxel)];
    if (std::min(here, next) >= kSurelyMarrow) changes.push_back(std::abs(next - here));
  }
  if (changes.size() < 30) return kUsual;
  return std::clamp(TakeMedian(changes) / kMadOfPairs, kLeast,
                    kMost);  // the median of |a - b| of two normal deviates
}

double StrokeBone::EdgeOf(double per_voxel) const { return search_.fine ? per_voxel / 2 : per_voxel; }

double StrokeBone::SizeMm() const { return DiagonalMm(BoxOf(own_), own_.grid); }

// A bone ends inside its box, unless the scan does.
bool StrokeBone::OnInnerSide(size_t v) const {
  const Eigen::Vector3i p = scan_.grid.Ijk(v);
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] == 0 && inner_low_[axis]) return true;
    if (p[axis] + 1 == scan_.grid.size[axis] && inner_high_[axis]) return true;
  }
  return false;
}

// Strokes reach each other more easily than what is not the bone. In relative intensity.
double StrokeBone::WallOf(const Image<float>& reach, const std::vector<size_t>& strokes) const {
  constexpr double kUsual = 0.4, kLeast = 0.25, kMost = 0.45;
  const double farther = search_.far ? kFarther : 1;
  std::vector<float> ways;
  for (const size_t v : strokes) {
    if (SureStroke(v)) ways.push_back(float(reach.values[v] / size_mm_));
  }
  if (ways.empty()) return farther * kUsual;
  const auto middle = ways.begin() + (ways.size() - 1) / 2;
  std::nth_element(ways.begin(), middle, ways.end());
  return farther * std::clamp(1.5 * *middle + 0.06, kLeast, kMost);
}

void StrokeBone::FindLean() {
  std::vector<size_t> own;
  std::vector<GeodesicSource> elsewhere;
  for (size_t v = 0; v < own_.values.size(); ++v) {
    if (own_.values[v]) own.push_back(v);
    if (IsElsewhere(v) || (!own_.values[v] && OnInnerSide(v))) elsewhere.push_back({v, 0});
  }
  GeodesicOptions options{.mm_per_contrast = size_mm_, .noise = noise_};
  options.most_mm = (search_.far ? kFartherWays : 1) * kFarthest * size_mm_;
  const Image<float> other = GeodesicDistance(relative_, elsewhere, options);
  const Image<float> reach = ReachFromStrokes(relative_, own, options, search_.far ? kFewGroups : kGroups);
  const float wall = float(WallOf(reach, own) * size_mm_);
  lean_ = Image<float>(scan_.grid);
  for (size_t v = 0; v < lean_.values.size(); ++v) {
    const float own_mm = reach.values[v] < options.most_mm ? reach.values[v] : INFINITY;
    lean_.values[v] = LeanOf(own_mm, std::min(other.values[v], wall), remoteness_.values[v], search_.tight);
  }
}

void StrokeBone::Reconsider() {
  relative_ = Relative(found_);
  std::vector<GeodesicSource> from, elsewhere;
  for (size_t v = 0; v < found_.values.size(); ++v) {
    if (found_.values[v])
      from.push_back({v, 0});
    else if (IsElsewhere(v) || OnInnerSide(v) || remoteness_.values[v] > kRemote)
      elsewhere.push_back({v, 0});
  }
  const GeodesicOptions options{
      .mm_per_contrast = size_mm_, .noise = noise_, .most_mm = 2 * kFoundWall * size_mm_};
  const Image<float> own = GeodesicDistance(relative_, from, options);
  const Image<float> other = GeodesicDistance(relative_, elsewhere, options);
  const float wall = float(kFoundWall * size_mm_);
  for (size_t v = 0; v < lean_.values.size(); ++v) {
    const float lean =
        LeanOf(own.values[v], std::min(other.values[v], wall), remoteness_.values[v], search_.tight);
    lean_.values[v] = 0.25f * lean_.values[v] + 0.75f * lean;
  }
}

TissueCounts StrokeBone::Count() const {
  TissueCounts counts;
  const bool first = found_.values.empty();
  for (size_t v = 0; v < relative_.values.size(); ++v) {
    const float r = relative_.values[v];
    const bool cortex = own_.values[v] && r < kDark;
    if (cortex) counts.cortex.Add(r);
    if (first ? SureStroke(v) : found_.values[v] != 0) counts.marrow.Add(r);
    if (first ? cortex || other_.values[v] || lean_.values[v] < kNotBone : !found_.values[v])
      counts.rest.Add(r);
  }
  return counts;
}

CutLayer StrokeBone::MarrowLayer(const TissueCounts& tissues, double fat_nats, double lean_nats) const {
  const IntensityMixture marrow(tissues.marrow, 3, kLeastDeviation), rest(tissues.rest, 5, kLeastDeviation);
  CutLayer layer{
      Image<float>(scan_.grid),
      Image<Side>(scan_.grid, Side::kFree),
      {.strength = kLinkNats, .contrast = std::max(EdgeOf(kLeastEdge), 2 * noise_), .falls_outwards = 1}};
  for (size_t v = 0; v < relative_.values.size(); ++v) {
    const double looks = rest.LogDensity(relative_.values[v]) - marrow.LogDensity(relative_.values[v]);
    layer.inside_cost.values[v] =
        float(std::clamp(looks, -fat_nats, kMostNats) - lean_nats * lean_.values[v]);
    if (IsElsewhere(v)) layer.sides.values[v] = Side::kOutside;
    if (SureStroke(v)) layer.sides.values[v] = Side::kInside;
  }
  return layer;
}

void StrokeBone::Cut(const TissueCounts& tissues) {
  found_ = MinimumCut(MarrowLayer(tissues, kFatNats, kLeanNats), relative_);
}

void StrokeBone::CutWithShell(const TissueCounts& tissues) {
  CutLayer alone = MarrowLayer(tissues, kFatNatsInShell, kLeanNatsInShell);
  CloseFarFrom(lean_, alone.sides);
  std::vector<CutLayer> layers(2, alone);
  CutLayer &marrow = layers[0], &bone = layers[1];
  bone.links.strength = kShellLinkNats;
  bone.links.falls_outwards = -1;
  const double not_dark = tissues.CortexLevel() + kAboveCortex;
  for (size_t v = 0; v < relative_.values.size(); ++v) {
    const double brighter = (relative_.values[v] - not_dark) / kDarkScale;
    const double shell_cost = kShellNats + std::clamp(brighter, -kDarkNats, kBrightNats);
    bone.inside_cost.values[v] = float(shell_cost);
    marrow.inside_cost.values[v] -= float(shell_cost);
    if (own_.values[v]) bone.sides.values[v] = Side::kInside;
  }
  found_ = std::move(NestedCut(layers, relative_).front());
}

Mask StrokeBone::Marrow() const {
  Mask marrow = found_;
  for (size_t v = 0; v < marrow.values.size(); ++v)
    marrow.values[v] |= own_.values[v] && relative_.values[v] >= kDark;
  return marrow;
}

size_t StrokeBone::Voxels() const {
  return found_.values.size() - size_t(std::count(found_.values.begin(), found_.values.end(), 0));
}

bool StrokeBone::ReachesBox() const {
  for (size_t v = 0; v < found_.values.size(); ++v) {
    if (found_.values[v] && OnInnerSide(v)) return true;
  }
  return false;
}

}  // namespace kvx
