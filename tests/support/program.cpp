// fork, exec, wait.
#include "tests/support/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <stdexcept>

#include "tests/support/fixtures.h"

namespace kvx::testing_support {
namespace {

int OpenForWriting(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
}

}  // namespace

Program::Program(const std::filesystem::path& folder, const std::vector<std::string>& arguments) {
  static std::atomic<int> serial = 0;
  const std::string name = "run-" + std::to_string(serial++);
  out_ = folder / (name + ".out"), err_ = folder / (name + ".err");
  const int out = OpenForWriting(out_), err = OpenForWriting(err_);
  std::vector<std::string> words{KVX_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ == 0) {
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    signal(SIGINT, SIG_DFL);  // shells have what they start in the background ignore it
    execv(argv[0], argv.data());
    _exit(127);
  }
  ::close(out);
  ::close(err);
}

bool Program::Running() {
  if (!ended_) ended_ = waitpid(pid_, &status_, WNOHANG) == pid_;
  return !ended_;
}

void Program::Signal(int number) {
  if (Running()) kill(pid_, number);
}

Ended Program::Wait() {
  if (!ended_) ended_ = waitpid(pid_, &status_, 0) == pid_;
  const int code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  return {code, Content(out_), Content(err_)};
}

Ended RunProgram(const std::filesystem::path& folder, const std::vector<std::string>& arguments) {
  return Program(folder, arguments).Wait();
}

}  // namespace kvx::testing_support
