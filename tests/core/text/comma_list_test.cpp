// Lists as users type them.
#include "core/text/comma_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> NamesOf(std::initializer_list<std::string_view> texts) {
  std::vector<std::string> names;
  for (const std::string_view text : texts) AddNamesOf(text, names);
  return names;
}

TEST(CommaList, HoldsEachNameOnce) {
  EXPECT_THAT(NamesOf({"tibia"}), ElementsAre("tibia"));
  EXPECT_THAT(NamesOf({"tibia,femur,tibia"}), ElementsAre("tibia", "femur"));
  EXPECT_THAT(NamesOf({"tibia,femur", "patella", "femur"}), ElementsAre("tibia", "femur", "patella"));
  EXPECT_THAT(NamesOf({",tibia,,femur,"}), ElementsAre("tibia", "femur"));
  EXPECT_THAT(NamesOf({"", ",", ",,"}), IsEmpty());
}

}  // namespace
}  // namespace kvx
