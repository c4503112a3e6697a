// Faults against the real program, driven by Python with nothing but its standard library (tests/faults), and
// foreign upload clients. The numbers here are small; `./do soak` sets KVX_SOAK for the long ones.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>

#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
constexpr int kSkipped = 77;
// Of the service's resident memory; the address sanitizer needs more before anything is uploaded.
#ifdef __SANITIZE_ADDRESS__
constexpr int kMostMib = 600;
#else
constexpr int kMostMib = 300;
#endif

bool Soak() { return std::getenv("KVX_SOAK") != nullptr; }
std::string Times(int usually, int in_soak) { return std::to_string(Soak() ? in_soak : usually); }

class Faults : public testing::Test {
 protected:
  static std::string Study() {
    static const testing_support::ScratchFolder folder;
    static const fs::path study = testing_support::WriteHingeStudy(folder.path());
    return study.string();
  }
  // Paths of ours without blanks: a shell is safe.
  void Script(const std::string& name, const std::string& more = "") {
    const fs::path output = scratch_.path() / "output";
    const std::string command = "/usr/bin/python3 " KVX_SOURCE_DIR "/tests/faults/" + name +
                                " --program " KVX_PROGRAM " --study " + Study() + " " + more + " > " +
                                output.string() + " 2>&1";
    const int status = std::system(command.c_str());
    const std::string text = testing_support::Content(output);
    if (WIFEXITED(status) && WEXITSTATUS(status) == kSkipped) GTEST_SKIP() << text;
    EXPECT_EQ(status, 0) << text;
    std::printf("%s\n", text.c_str());
  }

 private:
  testing_support::ScratchFolder scratch_;
};

TEST_F(Faults, KillMatrix) {
  Script("kill_matrix.py", "--rounds " + Times(3, 200) + " --seed " + Times(7, 11));
}

TEST_F(Faults, AKilledSegmentationEndsAsIfItHadNotBeen) {
  Script("killed_segmentation.py", "--rounds " + Times(2, 30));
}

TEST_F(Faults, ALateWorkerChangesNothing) { Script("late_worker.py"); }

TEST_F(Faults, AJobThatKillsThreeWorkersHasFailed) { Script("killer_job.py"); }

TEST_F(Faults, ADiskThatFillsUp) { Script("disk_full.py", "--rounds " + Times(3, 40)); }

TEST_F(Faults, ADiskThatHoldsNoMoreFiles) { Script("no_files_left.py"); }

TEST_F(Faults, ADiskOfKernelsThatFillsUp) { Script("kernels_disk_full.py"); }

TEST_F(Faults, DamagedUploads) {
  const std::string shared =
      testing_support::HasSharedData() ? " --shared " + testing_support::SharedData().string() : "";
  Script("bad_uploads.py", "--mutations " + Times(25, 10'000) + shared);
}

TEST_F(Faults, ADownloadOverABreakingLine) { Script("broken_download.py"); }

TEST_F(Faults, AnUploadThatIsInterruptedGoesOn) { Script("broken_upload.py"); }

TEST_F(Faults, CancellationsWhoseAnswersAreLost) { Script("lost_answers.py"); }

TEST_F(Faults, TusFromPython) { Script("tus_python.py"); }

TEST_F(Faults, TusFromJavaScript) { Script("tus_javascript.py"); }

TEST_F(Faults, ALargeUploadStaysOutOfMemory) {
  Script("large_upload.py", "--mib " + Times(192, 2048) + " --most " + std::to_string(kMostMib));
}

}  // namespace
}  // namespace kvx
