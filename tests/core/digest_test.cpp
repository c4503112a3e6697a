// SHA-256 against the vectors that NIST publishes (FIPS 180-4), base64 against those of RFC 4648.
#include "core/digest.h"

#include <gtest/gtest.h>

#include <sstream>

#include "core/errors.h"
#include "core/text/base64.h"

namespace kvx {
namespace {

TEST(Sha256, IsThatOfThePublishedVectors) {
  EXPECT_EQ(Sha256("").Hex(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256("abc").Hex(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256(std::string(1'000'000, 'a')).Hex(),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfAStreamIsThatOfItsBytes) {
  const std::string bytes(3'000'001, 'k');  // several chunks and a bit
  std::istringstream stream(bytes);
  EXPECT_EQ(Sha256(stream), Sha256(bytes));
}

TEST(Digest, HexIsReadBackAndNothingElseIs) {
  const Digest digest = Sha256("abc");
  EXPECT_EQ(Digest::FromHex(digest.Hex()), digest);
  EXPECT_THROW(Digest::FromHex(digest.Hex().substr(1)), InputError);
  EXPECT_THROW(Digest::FromHex(std::string(64, 'g')), InputError);
  EXPECT_THROW(Digest::FromHex(std::string(64, 'A')), InputError);
}

TEST(Hasher, PartsDoNotRunTogether) {
  Hasher one, other;
  EXPECT_NE(one.Add("ab").Add("c").Finish(), other.Add("a").Add("bc").Finish());
}

TEST(Base64, IsThatOfThePublishedVectors) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(Base64(bytes), text);
    EXPECT_EQ(FromBase64(text), bytes);
  }
}

TEST(Base64, CarriesEveryByte) {
  std::string bytes;
  for (int value = 0; value < 256; ++value) bytes += char(value);
  EXPECT_EQ(FromBase64(Base64(bytes)), bytes);
}

TEST(Base64, RefusesWhatIsNot) {
  for (const char* text : {"Zg=", "Zg", "Z!==", "====", "Zm9v*mFy"}) EXPECT_FALSE(FromBase64(text)) << text;
}

}  // namespace
}  // namespace kvx
