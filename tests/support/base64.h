// Base64 for tests, by OpenSSL.
#pragma once
#include <openssl/evp.h>

#include <string>

namespace kvx::testing_support {

inline std::string Base64(const std::string& bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                   reinterpret_cast<const unsigned char*>(bytes.data()), int(bytes.size()));
  text.resize(size_t(size));
  return text;
}

}  // namespace kvx::testing_support
