// What studies are called where several are told of.
#include "cli/service/submission.h"

#include <gmock/gmock.h>

namespace kvx {
namespace {

using testing::ElementsAre;

std::vector<std::string> TitlesOf(const std::vector<std::filesystem::path>& studies) {
  std::vector<std::string> titles;
  for (const Submission& one : SubmissionsOf(studies)) titles.push_back(one.title);
  return titles;
}

TEST(Submission, IsCalledAfterItsFolderOrItsFile) {
  EXPECT_THAT(TitlesOf({"/lab/a/study.json", "/lab/a/left.json", "/study.json", "/lab/b/./study.json"}),
              ElementsAre("a", "left.json", "study.json", "b"));
}

TEST(Submission, IsToldFromOthersByThePathBeforeIt) {
  EXPECT_THAT(TitlesOf({"/x/north/01/study.json", "/x/south/01/study.json", "/x/south/02/study.json"}),
              ElementsAre("north/01", "south/01", "02"));
  EXPECT_THAT(TitlesOf({"/x/1/mr/knee.json", "/x/2/mr/knee.json", "/x/2/ct/knee.json"}),
              ElementsAre("1/mr/knee.json", "2/mr/knee.json", "ct/knee.json"));
  EXPECT_THAT(TitlesOf({"/a/study.json", "/x/a/study.json"}), ElementsAre("a", "x/a"));
}

TEST(Submission, GivenTwiceKeepsItsShortTitle) {
  EXPECT_THAT(TitlesOf({"/x/a/study.json", "/x/b/../a/study.json"}), ElementsAre("a", "a"));
}

}  // namespace
}  // namespace kvx
