// A caller may close any of the three standard streams; nothing that is told gets into a file.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>

#include "tests/support/listening_server.h"
#include "tests/support/program_test.h"

namespace kvx {
namespace {

using testing_support::Content;

class StandardStreams : public testing_support::ProgramTest {
 protected:
  StandardStreams() {
    server_.http.Get(".*", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(bytes_, "application/octet-stream");
    });
    server_.Listen();
  }
  // Its exit code. Paths of ours without blanks: a shell is safe.
  int FetchWith(const std::string& streams) const {
    const std::string line = KVX_PROGRAM " fetch mdl_a --joint a.b=1 --json --server " + server_.url() +
                             " --out " + At("a.nii") + " " + streams;
    return WEXITSTATUS(std::system(line.c_str()));
  }

  const std::string bytes_ = std::string(3 << 20, 'V');

 private:
  testing_support::ListeningServer server_;
};

TEST_F(StandardStreams, WhatIsToldWhereOneIsClosedGetsIntoNoFile) {
  for (const char* closed : {"<&- 2>/dev/null", "2>&-", "<&- 2>&-"}) {
    EXPECT_EQ(FetchWith(closed + (" >" + At("out"))), 0) << closed;
    EXPECT_TRUE(Content(At("a.nii")) == bytes_) << closed;
  }
}

TEST_F(StandardStreams, WhatCannotBePrintedWhereOneIsClosedIsAFailure) {
  EXPECT_EQ(FetchWith(">&- 2>" + At("err")), 4);
  EXPECT_THAT(Content(At("err")), testing::HasSubstr("cannot be written to stdout"));
  EXPECT_TRUE(Content(At("a.nii")) == bytes_);
}

}  // namespace
}  // namespace kvx
