// Counters of the running service, as Prometheus text.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace kvx {

struct Metrics {
  std::array<std::atomic<int64_t>, 6> responses_by_class{};  // [2] counts 2xx
  std::atomic<int64_t> event_streams{0};
  std::atomic<int64_t> jobs_succeeded{0}, jobs_failed{0}, jobs_cancelled{0};
  std::atomic<int64_t> upload_bytes{0};

  void CountResponse(int status) {
    const int index = status / 100;
    if (index >= 0 && index < 6) ++responses_by_class[size_t(index)];
  }
};

struct Services;
std::string PrometheusText(const Metrics& metrics, Services& services);

}  // namespace kvx
