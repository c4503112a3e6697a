// Doubtful bones have a line each, uncertain ones share one, good ones none.
#include "pipeline/model/bone_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

BoneFit Fit(bool doubtful, const std::string& note) {
  BoneFit fit;
  fit.doubtful = doubtful;
  fit.note = note;
  return fit;
}

TEST(BoneWarnings, SayWhatIsDoubtfulAndWhatIsUncertain) {
  const BoneFits fits{Fit(false, ""), Fit(false, "turn"), Fit(true, "not found; give a hint"),
                      Fit(false, "turn")};
  EXPECT_THAT(BoneWarnings("pose01", {"femur", "tibia", "patella", "fibula"}, fits),
              ElementsAre(AllOf(HasSubstr("'pose01', bone 'patella' is doubtful: not found"),
                                Not(HasSubstr("tibia"))),
                          AllOf(HasSubstr("'pose01'"), HasSubstr("tibia, fibula"), Not(HasSubstr("femur")))));
}

TEST(BoneWarnings, NothingInDoubtIsNothingSaid) {
  EXPECT_TRUE(BoneWarnings("pose01", {"femur"}, {Fit(false, "")}).empty());
}

}  // namespace
}  // namespace kvx
