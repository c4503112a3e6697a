// The field is smooth, so it is computed on a coarse lattice and read between.
#include "pipeline/segmentation/mr/levels/marrow_level.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr double kReachMm = 20;      // coils' fields change over centimetres
constexpr double kFlatMm = 6;        // samples that spread less than that are on no slope
constexpr double kMostChange = 0.5;  // of the mean, from where samples are to the place
constexpr double kDark = 0.62;       // of the level: cortical bone and what is half of it
constexpr int kRounds = 8;
constexpr size_t kMostSamples = 600;
constexpr double kLatticeMm = 8;

// Far samples keep some weight, so that the field goes on where there is none nearby.
double WeightAt(const Eigen::Vector3d& away_mm) {
  const double r2 = away_mm.squaredNorm() / (kReachMm * kReachMm);
  return 1.0 / ((1 + r2) * (1 + r2));
}

double MeanAround(const std::vector<LevelSample>& samples, const PointMm& place) {
  double sum = 0, weights = 0;
  for (const LevelSample& sample : samples) {
    const double weight = WeightAt(sample.at.lps - place.lps);
    sum += weight * sample.intensity, weights += weight;
  }
  return weights > 0 ? sum / weights : 0.0;
}

// By weighted least squares with a prior on the slope (local linear regression; Cleveland 1979). Beyond the
// samples the plane does not go on for ever.
double PlaneAround(const std::vector<LevelSample>& samples, const PointMm& place) {
  double sum = 0, weights = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), by_place = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const LevelSample& sample : samples) {
    const Eigen::Vector3d away_mm = sample.at.lps - place.lps;
    const double weight = WeightAt(away_mm);
    sum += weight * sample.intensity, weights += weight;
    middle += weight * away_mm, by_place += weight * sample.intensity * away_mm;
    squares += weight * away_mm * away_mm.transpose();
  }
  if (!(weights > 0)) return 0.0;
  const double mean = sum / weights;
  middle /= weights;
  squares = squares / weights - middle * middle.transpose();
  squares.diagonal().array() += kFlatMm * kFlatMm;
  const Eigen::Vector3d slope = squares.ldlt().solve(by_place / weights - mean * middle);
  const double most = kMostChange * std::abs(mean);
  return mean - std::clamp(slope.dot(middle), -most, most);
}

double LevelAround(const std::vector<LevelSample>& samples, MarrowLevel::Fit fit, const PointMm& place) {
  return fit == MarrowLevel::kPlane ? PlaneAround(samples, place) : MeanAround(samples, place);
}

std::vector<LevelSample> Thinned(const std::vector<LevelSample>& samples) {
  const size_t step = samples.size() / kMostSamples + 1;
  std::vector<LevelSample> thinned;
  for (size_t n = 0; n < samples.size(); n += step) thinned.push_back(samples[n]);
  return thinned;
}

Grid Lattice(const Grid& grid) {
  Grid lattice = grid;
  for (int axis = 0; axis < 3; ++axis) {
    const double length_mm = (grid.size[axis] - 1) * grid.spacing_mm[axis];
    lattice.size[axis] = int(std::ceil(length_mm / kLatticeMm)) + 2;
    lattice.spacing_mm[axis] = kLatticeMm;
  }
  return lattice;
}

}  // namespace

std::vector<LevelSample> SamplesOf(const Volume& scan, const Mask& where) {
  std::vector<LevelSample> samples;
  for (size_t v = 0; v < where.values.size(); ++v) {
    if (!where.values[v]) continue;
    samples.push_back({scan.grid.ToMm(PointVox{scan.grid.Ijk(v).cast<double>()}), scan.values[v]});
  }
  return samples;
}

MarrowLevel::MarrowLevel(std::vector<LevelSample> samples, Fit fit) : fit_(fit) {
  const std::vector<LevelSample> all = Thinned(samples);
  samples_ = all;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<LevelSample> bright;
    for (const LevelSample& sample : all) {
      if (sample.intensity >= kDark * LevelAround(samples_, fit_, sample.at)) bright.push_back(sample);
    }
    if (bright.empty() || bright.size() == samples_.size()) break;
    samples_ = std::move(bright);
  }
}

double MarrowLevel::At(const PointMm& place) const { return LevelAround(samples_, fit_, place); }

Volume RelativeTo(const MarrowLevel& level, const Volume& volume) {
  const Grid lattice = Lattice(volume.grid);
  Volume coarse(lattice);
  ParallelFor(coarse.values.size(), [&](size_t v) {
    coarse.values[v] = float(level.At(lattice.ToMm(PointVox{lattice.Ijk(v).cast<double>()})));
  });
  Volume out(volume.grid);
  const Eigen::Vector3d scale = volume.grid.spacing_mm / kLatticeMm;
  const size_t row = size_t(volume.grid.size.x());
  ParallelFor(out.values.size() / row, [&](size_t line) {
    for (size_t v = line * row; v < (line + 1) * row; ++v) {
      const PointVox p{volume.grid.Ijk(v).cast<double>().cwiseProduct(scale)};
      const float here = SampleTrilinear(coarse, p);
      out.values[v] = here > 0 ? std::clamp(volume.values[v] / here, 0.0f, 2.0f) : 0.0f;
    }
  });
  return out;
}

}  // namespace kvx
