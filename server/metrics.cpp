// https://prometheus.io/docs/instrumenting/exposition_formats, version 0.0.4.
#include "server/metrics.h"

#include "api/services.h"

namespace kvx {
namespace {

std::string Figure(const std::string& name, const char* type, const char* help, int64_t value) {
  return "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n" + name + " " + std::to_string(value) +
         "\n";
}

}  // namespace

std::string PrometheusText(const Metrics& metrics, Services& services) {
  std::string text = "# HELP kinevox_responses_total HTTP answers by class.\n# TYPE kinevox_responses_total counter\n";
  for (size_t i = 1; i < metrics.responses_by_class.size(); ++i) {
    text += "kinevox_responses_total{class=\"" + std::to_string(i) + "xx\"} " +
            std::to_string(metrics.responses_by_class[i]) + "\n";
  }
  const CacheFigures cache = services.results.Figures();
  text += Figure("kinevox_jobs_queued", "gauge", "Jobs that wait.", services.jobs.Count("queued"));
  text += Figure("kinevox_jobs_running", "gauge", "Jobs that run.", services.jobs.Count("running"));
  text += Figure("kinevox_jobs_succeeded_total", "counter", "Jobs done since the start.", metrics.jobs_succeeded);
  text += Figure("kinevox_jobs_failed_total", "counter", "Jobs failed since the start.", metrics.jobs_failed);
  text += Figure("kinevox_jobs_cancelled_total", "counter", "Jobs cancelled while running.", metrics.jobs_cancelled);
  text += Figure("kinevox_upload_bytes_total", "counter", "Bytes received in uploads.", metrics.upload_bytes);
  text += Figure("kinevox_event_streams", "gauge", "Open event streams.", metrics.event_streams);
  text += Figure("kinevox_result_cache_hits_total", "counter", "Results found.", cache.hits);
  text += Figure("kinevox_result_cache_misses_total", "counter", "Results computed.", cache.misses);
  text += Figure("kinevox_result_cache_bytes", "gauge", "Bytes of kept results.", cache.bytes);
  return text;
}

}  // namespace kvx
