// One rule for names, wherever they come in.
#include "core/name.h"

#include <gtest/gtest.h>

#include <string>

namespace kvx {
namespace {

TEST(Name, HasOneTo64LettersDigitsDotsUnderscoresOrHyphens) {
  for (const std::string& name : {std::string("a.b_C-9"), std::string("_"), std::string("..."),
                                  std::string(".p0"), std::string(kLongestName, 'a')})
    EXPECT_TRUE(IsName(name)) << name;
  for (const std::string& name :
       {std::string(), std::string("."), std::string(".."), std::string("a/b"), std::string("a b"),
        std::string("a\0", 2), std::string("f\xC3\xBC"), std::string(kLongestName + 1, 'a')})
    EXPECT_FALSE(IsName(name)) << name;
}

}  // namespace
}  // namespace kvx
