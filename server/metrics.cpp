// https://prometheus.io/docs/instrumenting/exposition_formats, version 0.0.4.
#include "server/metrics.h"

#include <iomanip>
#include <limits>
#include <sstream>

#include "api/services.h"
#include "core/version.h"

namespace kvx {
namespace {

// A rate is the difference of two sums: six digits of a large one would hide what was added.
std::string Exact(double value) {
  std::ostringstream text;
  text << std::setprecision(std::numeric_limits<double>::max_digits10) << value;
  return text.str();
}

}  // namespace

std::string Figure(const std::string& name, const char* type, const char* help, int64_t value) {
  return "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n" + name + " " +
         std::to_string(value) + "\n";
}

void Histograms::Observe(const std::string& labels, double seconds) {
  const std::lock_guard lock(mutex_);
  One& one = by_labels_[labels];
  ++one.count;
  one.sum += seconds;
  const auto bucket = std::ranges::lower_bound(kBounds, seconds);
  if (bucket != kBounds.end()) ++one.counts[size_t(bucket - kBounds.begin())];
}

std::string Histograms::Text(const std::string& name, const std::string& help) const {
  const std::lock_guard lock(mutex_);
  std::ostringstream text;
  text << "# HELP " << name << " " << help << "\n# TYPE " << name << " histogram\n";
  for (const auto& [labels, one] : by_labels_) {
    int64_t so_far = 0;
    for (size_t i = 0; i < kBounds.size(); ++i) {
      so_far += one.counts[i];
      text << name << "_bucket{" << labels << ",le=\"" << kBounds[i] << "\"} " << so_far << "\n";
    }
    text << name << "_bucket{" << labels << ",le=\"+Inf\"} " << one.count << "\n";
    text << name << "_sum{" << labels << "} " << Exact(one.sum) << "\n"
         << name << "_count{" << labels << "} " << one.count << "\n";
  }
  return text.str();
}

std::string PrometheusText(const Metrics& metrics, Services& services) {
  std::string text = "# HELP kinevox_build_info The program.\n# TYPE kinevox_build_info gauge\n";
  text += "kinevox_build_info{version=\"" + std::string(ProgramVersion()) + "\"} 1\n";
  text += "# HELP kinevox_responses_total HTTP answers by class.\n# TYPE kinevox_responses_total counter\n";
  for (size_t i = 1; i < metrics.responses_by_class.size(); ++i) {
    text += "kinevox_responses_total{class=\"" + std::to_string(i) + "xx\"} " +
            std::to_string(metrics.responses_by_class[i]) + "\n";
  }
  const CacheFigures cache = services.results.Figures();
  text += Figure("kinevox_jobs_queued", "gauge", "Jobs that wait.", services.jobs.Count("queued"));
  text += Figure("kinevox_jobs_running", "gauge", "Jobs that run.", services.jobs.Count("running"));
  text +=
      Figure("kinevox_jobs_succeeded_total", "counter", "Jobs done since the start.", metrics.jobs_succeeded);
  text += Figure("kinevox_jobs_failed_total", "counter", "Jobs failed since the start.", metrics.jobs_failed);
  text += Figure("kinevox_jobs_cancelled_total", "counter", "Jobs cancelled since the start.",
                 metrics.jobs_cancelled);
  text += Figure("kinevox_upload_bytes_total", "counter", "Bytes received in uploads.", metrics.upload_bytes);
  text += Figure("kinevox_event_streams", "gauge", "Open event streams.", metrics.event_streams);
  text += Figure("kinevox_result_cache_hits_total", "counter", "Results found.", cache.hits);
  text += Figure("kinevox_result_cache_misses_total", "counter", "Results computed.", cache.misses);
  text += Figure("kinevox_result_cache_bytes", "gauge", "Bytes of kept results.", cache.bytes);
  text += metrics.requests.Text("kinevox_request_seconds", "HTTP requests, until the answer is written.");
  text += metrics.stages.Text("kinevox_stage_seconds", "Stages of jobs.");
  if (metrics.more) text += metrics.more();
  return text;
}

}  // namespace kvx
