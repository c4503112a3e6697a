// What a voxel adds to the information of both images is log p(s, t) / (p(s) p(t)), p from the joint
// histogram of the level as it is registered so far (Viola and Wells 1997). Its slope in s leads to the
// target; how firmly is the Fisher information of p(s | t).
#include "pipeline/registration/blocks/information_targets.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"

namespace kvx {
namespace {

constexpr int kBins = 64;                                   // per axis
constexpr double kTemplateTail = 0.005, kScanTail = 0.002;  // of the greys, in the first bin and in the last
constexpr std::array<double, 5> kParzen = {0.266, 0.213, 0.109, 0.036, 0.008};  // 1.5 bins; centre, one side
constexpr double kNoVoxels = 0.02;                                  // in every bin beside those that are
constexpr double kLeastFirm = 0.01, kMostFirm = 20, kFarthest = 6;  // in units of noise
// What greys' joint histogram gets wrong is wrong over whole tissues: two voxels say no more than one.
constexpr double kVoxelsAWord = 2;
// Of the target: the rest is the template's grey in the scan's contrast, which knows what lies beside it.
constexpr double kOfHistogram = 0.3;

using Joint = std::vector<double>;  // by template's bin, then by scan's

struct Bins {
  float low = 0, width = 1;
  Bins(std::vector<float> greys, double tail) {
    low = TakeQuantile(greys, tail);
    width = std::max(1e-6f, (TakeQuantile(greys, 1 - tail) - low) / (kBins - 1));
  }
  double At(float grey) const { return std::clamp((grey - low) / width, 0.0f, float(kBins - 1)); }
};

// The bin below, and how far it is on the way to the next one.
struct Place {
  int bin;
  double on;
  explicit Place(double at) : bin(std::min(int(at), kBins - 2)), on(at - bin) {}
};

void Smooth(Joint& joint, int stride, int other_stride) {
  const Joint before = joint;
  for (int line = 0; line < kBins; ++line) {
    for (int b = 0; b < kBins; ++b) {
      double sum = 0;
      for (int d = 1 - int(kParzen.size()); d < int(kParzen.size()); ++d)
        sum += kParzen[size_t(std::abs(d))] *
               before[size_t(line * other_stride + std::clamp(b + d, 0, kBins - 1) * stride)];
      joint[size_t(line * other_stride + b * stride)] = sum;
    }
  }
}

struct Scores {
  Joint slope;                 // of the information, per unit of the scan's grey
  std::vector<double> fisher;  // by template's bin
};

Scores ScoresOf(Joint joint, double width) {
  Smooth(joint, 1, kBins), Smooth(joint, kBins, 1);
  std::vector<double> of_scan(kBins, 0), of_template(kBins, 0);
  for (int n = 0; n < kBins * kBins; ++n) {
    joint[size_t(n)] += kNoVoxels;
    of_template[size_t(n / kBins)] += joint[size_t(n)], of_scan[size_t(n % kBins)] += joint[size_t(n)];
  }
  Scores out{Joint(joint.size()), std::vector<double>(kBins, 0)};
  for (int n = 0; n < kBins * kBins; ++n) {
    const int row = n / kBins * kBins, lo = std::max(0, n % kBins - 1),
              hi = std::min(kBins - 1, n % kBins + 1);
    const double step = (hi - lo) * width;
    const double of_joint = std::log(joint[size_t(row + hi)] / joint[size_t(row + lo)]) / step;
    out.fisher[size_t(n / kBins)] += joint[size_t(n)] / of_template[size_t(n / kBins)] * of_joint * of_joint;
    out.slope[size_t(n)] = of_joint - std::log(of_scan[size_t(hi)] / of_scan[size_t(lo)]) / step;
  }
  return out;
}

}  // namespace

GreyTargets InformationTargets::Of(std::span<const float> seen) const {
  GreyTargets out{level_.intensity, level_.weight};
  std::vector<size_t> counting;
  std::vector<float> in_template, in_scan;
  for (size_t v = 0; v < seen.size(); ++v) {
    if (level_.weight[v] <= 0 || seen[v] == kUnseen) continue;
    counting.push_back(v);
    in_template.push_back(level_.own_greys[v]), in_scan.push_back(seen[v]);
  }
  if (counting.empty()) return out;
  const Bins rows(std::move(in_template), kTemplateTail), columns(std::move(in_scan), kScanTail);
  const auto corners = [&](size_t v, auto visit) {  // visit(bin, share)
    const Place t(rows.At(level_.own_greys[v])), s(columns.At(seen[v]));
    for (int c = 0; c < 4; ++c)
      visit(size_t((t.bin + c / 2) * kBins + s.bin + c % 2),
            (c / 2 ? t.on : 1 - t.on) * (c % 2 ? s.on : 1 - s.on));
  };
  Joint joint(kBins * kBins, 0);
  for (const size_t v : counting) corners(v, [&](size_t bin, double share) { joint[bin] += share; });
  const Scores scores = ScoresOf(std::move(joint), double(columns.width));
  ParallelEach(counting.size(), [&](size_t n) {
    const size_t v = counting[n];
    double slope = 0, fisher = 0;
    corners(v, [&](size_t bin, double share) {
      slope += share * scores.slope[bin], fisher += share * scores.fisher[bin / kBins];
    });
    fisher = std::clamp(fisher, kLeastFirm, kMostFirm);
    const double way = std::clamp(slope / fisher, -kFarthest, kFarthest);
    out.greys[v] += float(kOfHistogram * (double(seen[v]) + way - double(level_.intensity[v])));
    // What an edge errs, and what disagrees, beyond the noise of images in one contrast
    const double beside = std::max(0.0, 1 / (level_.weight[v] * level_.voxels_a_measurement) - 1);
    out.weights[v] = float(1 / (kVoxelsAWord * level_.voxels_a_measurement * (1 / fisher + beside)));
  });
  return out;
}

}  // namespace kvx
