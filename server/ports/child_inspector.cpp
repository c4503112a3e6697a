// posix_spawn, one pipe, and a clock. The child answers in one line;
// silence or a signal means that the file broke it.
#include "server/ports/child_inspector.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "server/log.h"
#include "server/ports/pipeline_ports.h"

extern char** environ;

namespace kvx {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr size_t kLongestAnswer = size_t(4) << 20;  // a label map may hold 65535 labels
constexpr int kLookEveryMs = 200;
constexpr int kLongestWait = 4;  // times the limit, of a reader that computes
constexpr int kLeastShare = 50;  // that has at least a fiftieth of a processor
constexpr char kBroken[] =
    "the file is so damaged that it cannot be read; export or convert the original images again";
constexpr char kTooHard[] =
    "the file takes more memory or time to read than the service grants; send it smaller or uncompressed";

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // shadow memory is address space too
#else
constexpr bool kSanitized = false;
#endif

void Limit(__rlimit_resource what, rlim_t value) {
  const rlimit limit{value, value};
  ::setrlimit(what, &limit);
}

// What a reader may write: nothing but a header of our own, in memory (pipeline/io/standard_header.h).
constexpr rlim_t kMostWritten = 64 << 10;

void TakeLimits(const InspectionLimits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_FSIZE, kMostWritten);
  Limit(RLIMIT_CPU, rlim_t(limits.seconds));
  if (!kSanitized) Limit(RLIMIT_AS, rlim_t(limits.memory_bytes));
}

struct Child {
  pid_t pid = -1;
  int from = -1;  // its stdout

  Child(const std::filesystem::path& program, const std::vector<std::string>& words);
  ~Child();
  std::string Answer(std::chrono::seconds limit, const std::function<void()>& require_going_on);
  bool Computes(SteadyClock::duration took) const;  // or hangs
  int Wait();
};

Child::Child(const std::filesystem::path& program, const std::vector<std::string>& words) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw Unavailable("the upload cannot be inspected now; try again");
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  ::posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, 3);
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int failed = ::posix_spawn(&pid, program.c_str(), &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  from = ends[0];
  if (failed == 0) return;
  ::close(from);
  throw Unavailable("the upload cannot be inspected now; try again");
}

Child::~Child() {
  if (pid > 0) {
    ::kill(pid, SIGKILL);
    Wait();
  }
  ::close(from);
}

// Where builds have the processors, a file that is in order takes several times as long; its own limit of
// processor time goes on.
bool Child::Computes(SteadyClock::duration took) const {
  clockid_t clock;
  timespec spent{};
  if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &spent) != 0) return false;
  const auto computed = std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
  return kLeastShare * computed > took;
}

std::string Child::Answer(std::chrono::seconds limit, const std::function<void()>& require_going_on) {
  const auto began = SteadyClock::now();
  std::string answer;
  char chunk[4096];
  while (answer.size() < kLongestAnswer) {
    require_going_on();
    const auto took = SteadyClock::now() - began;
    if (took >= kLongestWait * limit || (took >= limit && !Computes(took))) throw InputError(kTooHard);
    pollfd ready{from, POLLIN, 0};
    const int count = ::poll(&ready, 1, kLookEveryMs);
    if (count == 0 || (count < 0 && errno == EINTR)) continue;
    if (count < 0) throw Unavailable("the upload cannot be inspected now; try again");
    const ssize_t got = ::read(from, chunk, sizeof chunk);
    if (got <= 0) break;
    answer.append(chunk, size_t(got));
  }
  return answer;
}

int Child::Wait() {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  pid = -1;
  return status;
}

ProposedBone BoneOf(const Json& json) {
  const auto text = [&](const char* field) {
    return json.at(field).is_null() ? "" : json.at(field).get<std::string>();
  };
  ProposedBone bone{json.at("label").get<int>(),
                    json.at("voxels").get<size_t>(),
                    json.at("cm3").get<double>(),
                    {},
                    text("name"),
                    text("parent"),
                    json.at("confidence").get<double>(),
                    json.value("looks_like", "")};
  for (size_t axis = 0; axis < 3; ++axis)
    bone.centre.lps[Eigen::Index(axis)] = json.at("centre").at(axis).get<double>();
  return bone;
}

ScalarType TypeOf(const std::string& name) {
  for (const ScalarType type :
       {ScalarType::kUint8, ScalarType::kInt8, ScalarType::kUint16, ScalarType::kInt16, ScalarType::kUint32,
        ScalarType::kInt32, ScalarType::kFloat32}) {
    if (NameOf(type) == name) return type;
  }
  return ScalarType::kFloat64;
}

}  // namespace

std::string ChildInspector::Ask(const std::vector<std::string>& words, const std::string& project) {
  const ProjectTurns::Turn turn(turns_, project);
  Child child(program_, words);
  const std::string answer =
      child.Answer(std::chrono::seconds(limits_.seconds), [this] { RequireNotDrained(); });
  const int status = child.Wait();
  const Json json = Json::parse(answer, nullptr, false);
  if (json.is_object() && json.contains("refusal")) throw InputError(json["refusal"].get<std::string>());
  if (json.is_object() && json.contains("facts") && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return json["facts"].dump();
  }
  LogError("inspection broke",
           {{"kind", words[2]}, {"signal", int64_t(WIFSIGNALED(status) ? WTERMSIG(status) : 0)}});
  const bool limits = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
  throw InputError(limits ? kTooHard : kBroken);
}

ScanFacts ChildInspector::InspectScan(const std::filesystem::path& path, const std::string& project) {
  const Json facts = Json::parse(Ask({"kinevox", "inspect-upload", "scan", path.string()}, project));
  return {GridOf(facts), TypeOf(facts.at("type").get<std::string>()),
          facts.at("modality").get<std::string>()};
}

LabelFacts ChildInspector::InspectLabels(const std::filesystem::path& path, const std::string& region,
                                         const std::string& project) {
  const Json facts =
      Json::parse(Ask({"kinevox", "inspect-upload", "labels", path.string(), region}, project));
  LabelFacts labels{GridOf(facts), facts.at("labels").get<std::vector<int>>(), {}};
  for (const Json& bone : facts.at("list")) labels.bones.push_back(BoneOf(bone));
  return labels;
}

ScanFacts ChildInspector::InspectSeries(const std::filesystem::path& archive,
                                        const std::filesystem::path& folder, const std::string& project,
                                        const std::function<void(size_t)>& unpacked) {
  const ProjectTurns::Turn turn(archive_turns_, project);
  return ScanInspector::InspectSeries(archive, folder, project, [&](size_t bytes) {
    RequireNotDrained();
    unpacked(bytes);
  });
}

void ChildInspector::RequireNotDrained() const {
  if (drained_()) throw Unavailable("the service is stopping; send the upload again");
}

std::string InspectInThisProcess(const std::string& kind, const std::filesystem::path& path,
                                 const std::string& region, const InspectionLimits& limits) {
  TakeLimits(limits);
  PipelineInspector inspector;
  try {
    Json answer;
    if (kind == "labels")
      answer["facts"] = FactsJson(inspector.InspectLabels(path, region, ""));
    else
      answer["facts"] = FactsJson(inspector.InspectScan(path, ""));
    return Dump(answer);
  } catch (const Error& refusal) {
    return Dump(Json{{"refusal", refusal.what()}});
  } catch (const std::bad_alloc&) {
    return Dump(Json{{"refusal", kTooHard}});
  } catch (const std::exception&) {  // a reader's own words can hold paths and header text
    return Dump(Json{{"refusal", kBroken}});
  }
}

}  // namespace kvx
