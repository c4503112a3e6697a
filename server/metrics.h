// Counters of the running service, as Prometheus text.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace kvx {

// Durations counted in buckets, by labels: `method="GET",route="/v1/jobs"`.
class Histograms {
 public:
  void Observe(const std::string& labels, double seconds);
  std::string Text(const std::string& name, const std::string& help) const;

 private:
  static constexpr std::array kBounds = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,   0.25,  0.5,
                                         1.0,   2.5,    5.0,   10.0, 30.0,  60.0, 300.0, 1800.0};
  struct One {
    std::array<int64_t, kBounds.size()> counts{};  // of this bucket alone
    int64_t count = 0;
    double sum = 0;
  };
  mutable std::mutex mutex_;
  std::map<std::string, One> by_labels_;
};

struct Metrics {
  std::array<std::atomic<int64_t>, 6> responses_by_class{};  // [2] counts 2xx
  std::atomic<int64_t> event_streams{0};
  std::atomic<int64_t> jobs_succeeded{0}, jobs_failed{0}, jobs_cancelled{0};
  std::atomic<int64_t> upload_bytes{0};
  Histograms requests, stages;
  std::function<std::string()> more;  // what only the whole service knows; may be empty

  void CountResponse(int status) {
    const int index = status / 100;
    if (index >= 0 && index < 6) ++responses_by_class[size_t(index)];
  }
};

// One value as Prometheus reads it; `type`: gauge or counter.
std::string Figure(const std::string& name, const char* type, const char* help, int64_t value);

struct Services;
std::string PrometheusText(const Metrics& metrics, Services& services);

}  // namespace kvx
