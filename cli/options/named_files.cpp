// The child that tries a DICOM series says nothing: whether it lives to its end is the answer.
#include "cli/options/named_files.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <new>

#include "cli/commands.h"
#include "cli/terminal/interrupt.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/io/volume_file.h"

namespace kvx {
namespace {

// Leaves without destructors: all but the outcome belongs to the parent.
template <class Read>
[[noreturn]] void TryAndLeave(const Read& read) {
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  try {
    read();
  } catch (...) {  // the parent comes to the same refusal by itself
  }
  ::_exit(0);
}

int WaitFor(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

template <class Read>
void TryInChild(const std::string& name, const Read& read) {
  const pid_t child = ::fork();
  if (child == 0) TryAndLeave(read);
  if (child < 0) throw Unavailable("no process can be started to read the DICOM images; try again");
  const int status = WaitFor(child);
  ThrowIfInterrupted();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) throw std::bad_alloc();
  throw InputError(name + ": the DICOM images are so damaged that they cannot be read; export them again");
}

}  // namespace

void RequireThere(const std::filesystem::path& named) {
  std::error_code ignored;
  if (!std::filesystem::exists(named, ignored))
    throw NotFound(named.string() + " does not exist; check its path");
}

void RequireMayWrite(const std::filesystem::path& named) { const AtomicFile tried(named); }

void RequireOther(const std::filesystem::path& out, const std::filesystem::path& other,
                  std::string_view what) {
  std::error_code error;
  const std::filesystem::path place = weakly_canonical(out, error);
  if (!error && place == weakly_canonical(other, error) && !error)
    throw UsageError("the output would take the place of " + std::string(what) + "; give another name");
}

void RequireMayFill(const std::filesystem::path& folder) {
  const std::string name = folder.string();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (IsDenial(error)) throw Denied(name + " may not be made; choose a folder where you may write");
  if (error)
    throw InputError(name + " cannot be made a folder (" + error.message() + "); choose another place");
  FromFile(folder, [](const std::filesystem::path& named) { RequireMayWrite(named / "tried.png"); });
}

void RequireVolumeOr(std::string_view other, std::string_view is_for, const std::filesystem::path& out) {
  if (HasExtension(out, other)) return;
  try {
    RequireWritableExtension(out);
  } catch (const InputError& error) {
    throw InputError("--out takes " + std::string(other) + " for " + std::string(is_for) + ", " +
                     error.what());
  }
}

std::string ContentOf(const std::filesystem::path& named) {
  std::ifstream in(named, std::ios::binary);
  if (!in && IsDenial(errno)) throw Denied("it may not be read; ask its owner for the right to read it");
  if (std::filesystem::is_directory(named)) throw InputError("it is a folder; give a file");
  std::string content((std::istreambuf_iterator<char>(in)), {});
  if (!in) throw InputError("it cannot be read; is it a file that you may open?");
  return content;
}

void RequireReadableDicom(const std::filesystem::path& scan, const std::string& name) {
  if (HoldsDicom(scan)) TryInChild(name, [&] { ReadScan(scan); });
}

void RequireReadableSegments(const std::filesystem::path& labels, const std::string& name,
                             const std::vector<StudyBone>& bones) {
  if (HoldsDicom(labels)) TryInChild(name, [&] { ReadLabelsOrMasks(labels, bones); });
}

}  // namespace kvx
