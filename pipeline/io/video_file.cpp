// By the program ffmpeg, started without a shell and fed grey frames through a pipe.
#include "pipeline/io/video_file.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "core/errors.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"

extern char** environ;

namespace kvx {
namespace {

namespace fs = std::filesystem;
const char* const kNoProgram =
    "video needs the program ffmpeg, which is not installed here; write a .nii.gz or a folder instead";

std::vector<std::string> Arguments(const fs::path& out, int width, int height, double fps) {
  std::vector<std::string> words{"ffmpeg",
                                 "-nostdin",
                                 "-loglevel",
                                 "error",
                                 "-y",
                                 "-f",
                                 "rawvideo",
                                 "-pixel_format",
                                 "gray",
                                 "-video_size",
                                 std::to_string(width) + "x" + std::to_string(height),
                                 "-framerate",
                                 std::to_string(fps),
                                 "-i",
                                 "pipe:0",
                                 "-threads",
                                 "1"};
  if (!HasExtension(out, ".gif")) {  // players want even sizes and this pixel format
    for (const char* word : {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"})
      words.emplace_back(word);
  }
  if (HasExtension(out, ".mp4")) {  // the index first: players begin before they have it all
    for (const char* word : {"-movflags", "+faststart"}) words.emplace_back(word);
  }
  words.push_back(out.string());
  return words;
}

class VideoSink final : public FrameSink<GreyPicture> {
 public:
  VideoSink(const fs::path& path, double fps) : file_(path), fps_(fps) {
    if (!HasVideoProgram()) throw Unavailable(kNoProgram);
  }
  ~VideoSink() override {
    if (pipe_ >= 0) ::close(pipe_);
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
  }
  void Add(const GreyPicture& frame) override {
    if (child_ < 0) Start(frame);
    for (size_t at = 0; at < frame.grey.size();) {
      const ssize_t wrote = ::write(pipe_, frame.grey.data() + at, frame.grey.size() - at);
      if (wrote < 0 && errno == EINTR) continue;
      if (wrote <= 0) throw Unavailable("ffmpeg stopped before the end of the animation");
      at += size_t(wrote);
    }
  }
  void Finish() override {
    if (child_ < 0) throw Unavailable("the animation has no frames");
    ::close(pipe_);
    pipe_ = -1;
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      throw Unavailable("ffmpeg cannot write this kind of video");
    file_.Commit();
  }

 private:
  void Start(const GreyPicture& first) {
    ::signal(SIGPIPE, SIG_IGN);  // a program that ends early is an error of write(), not the end of this one
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw Unavailable("no pipe can be opened");
    pipe_ = ends[1];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
    std::vector<std::string> words = Arguments(file_.temporary(), first.width, first.height, fps_);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const int error = ::posix_spawnp(&child_, "ffmpeg", &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[0]);
    if (error != 0) {
      child_ = -1;
      throw Unavailable(kNoProgram);
    }
  }

  AtomicFile file_;
  const double fps_;
  int pipe_ = -1;
  pid_t child_ = -1;
};

}  // namespace

bool IsVideoName(const fs::path& path) {
  constexpr const char* kVideos[] = {".mp4", ".mkv", ".webm", ".gif"};
  return std::ranges::any_of(kVideos, [&](const char* video) { return HasExtension(path, video); });
}

bool HasVideoProgram() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (::access((fs::path(folder) / "ffmpeg").c_str(), X_OK) == 0) return true;
  }
  return false;
}

std::unique_ptr<FrameSink<GreyPicture>> VideoFile(const fs::path& path, double fps) {
  return std::make_unique<VideoSink>(path, fps);
}

}  // namespace kvx
