// Which kind of failure an error is.
#include "core/errors.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(IsOneOf, HoldsForAKindAndWhatIsDerivedOfIt) {
  class Deeper : public NotFound {
    using NotFound::NotFound;
  };
  EXPECT_TRUE((IsOneOf<InputError, NotFound>(InputError("wrong"))));
  EXPECT_TRUE((IsOneOf<InputError, NotFound>(Deeper("nowhere"))));
  EXPECT_FALSE((IsOneOf<InputError, NotFound>(Unavailable("busy"))));
  EXPECT_FALSE(IsOneOf<NotFound>(Error("any")));
}

}  // namespace
}  // namespace kvx
