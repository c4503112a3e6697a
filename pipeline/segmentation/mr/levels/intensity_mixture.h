// A colour model: how often a tissue shows a relative intensity, as a mixture of normal distributions.
#pragma once
#include <cstddef>
#include <vector>

namespace kvx {

// Counts of relative intensities (1: the marrow nearby) in 0..kMostRelative; what lies beyond is counted at
// the ends.
class IntensityCounts {
 public:
  static constexpr int kBins = 128;
  static constexpr double kMostRelative = 2.0;

  IntensityCounts() : count_(kBins, 0.0) {}
  static int BinOf(double relative);
  static double CentreOf(int bin) { return (bin + 0.5) * kMostRelative / kBins; }

  void Add(double relative, double weight = 1.0) { count_[BinOf(relative)] += weight; }
  void Add(const IntensityCounts& other, double weight = 1.0);
  double Total() const;
  // The intensity below which the fraction lies.
  double Quantile(double fraction) const;
  const std::vector<double>& count() const { return count_; }

 private:
  std::vector<double> count_;
};

// Fitted by expectation and maximisation from quantiles, so it is the same in every run. A small uniform part
// keeps every intensity possible.
class IntensityMixture {
 public:
  // `least_deviation` in relative intensity: no narrower than noise and bins allow.
  IntensityMixture(const IntensityCounts& counts, int components, double least_deviation);
  double LogDensity(double relative) const { return log_density_[IntensityCounts::BinOf(relative)]; }

 private:
  std::vector<double> log_density_;
};

}  // namespace kvx
