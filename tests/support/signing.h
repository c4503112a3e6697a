// Signs as an identity provider does, and makes certificates, with OpenSSL;
// nothing is kept beyond a scratch folder.
#pragma once
#include <cjose/cjose.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace kvx::testing_support {

inline std::string Base64Url(std::string_view bytes) {
  char* text = nullptr;
  size_t size = 0;
  cjose_err error{};
  if (!cjose_base64url_encode(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), &text, &size,
                              &error)) {
    throw std::runtime_error("base64url");
  }
  const std::string out(text, size);
  free(text);
  return out;
}

// An RSA key of its own, published as a JWKS file.
class TokenSigner {
 public:
  TokenSigner(const std::filesystem::path& folder, std::string kid) : kid_(std::move(kid)) {
    std::filesystem::create_directories(folder);
    cjose_err error{};
    const uint8_t exponent[] = {1, 0, 1};
    key_.reset(cjose_jwk_create_RSA_random(2048, exponent, sizeof exponent, &error));
    if (!key_ || !cjose_jwk_set_kid(key_.get(), kid_.data(), kid_.size(), &error))
      throw std::runtime_error("RSA");
    char* text = cjose_jwk_to_json(key_.get(), false, &error);
    public_ = text;
    free(text);
    jwks_ = (folder / "jwks.json").string();
    std::ofstream(jwks_) << "{\"keys\":[" << public_ << "]}";
  }
  const std::string& jwks_file() const { return jwks_; }
  const std::string& public_key() const { return public_; }

  template <class Json>
  std::string Sign(const Json& claims, const char* critical = nullptr) const {  // JSON of a "crit" header
    cjose_err error{};
    const std::unique_ptr<cjose_header_t, void (*)(cjose_header_t*)> header(cjose_header_new(&error),
                                                                            cjose_header_release);
    cjose_header_set(header.get(), "alg", "RS256", &error);
    cjose_header_set(header.get(), "kid", kid_.c_str(), &error);
    if (critical) cjose_header_set_raw(header.get(), "crit", critical, &error);
    const std::string text = claims.dump();
    const std::unique_ptr<cjose_jws_t, void (*)(cjose_jws_t*)> token(
        cjose_jws_sign(key_.get(), header.get(), reinterpret_cast<const uint8_t*>(text.data()), text.size(),
                       &error),
        Release);
    const char* compact = nullptr;
    if (!token || !cjose_jws_export(token.get(), &compact, &error)) throw std::runtime_error("signing");
    return compact;
  }
  template <class Json>
  static std::string Unsigned(const Json& claims) {
    return Base64Url(R"({"alg":"none","kid":"k1"})") + "." + Base64Url(claims.dump()) + ".";
  }
  template <class Json>
  std::string SignedWithPublicKeyAsSecret(const Json& claims) const {
    const std::string head =
        Base64Url(R"({"alg":"HS256","kid":")" + kid_ + "\"}") + "." + Base64Url(claims.dump());
    unsigned char mac[EVP_MAX_MD_SIZE];
    unsigned size = 0;
    HMAC(EVP_sha256(), public_.data(), int(public_.size()),
         reinterpret_cast<const unsigned char*>(head.data()), head.size(), mac, &size);
    return head + "." + Base64Url({reinterpret_cast<const char*>(mac), size});
  }

 private:
  static void Release(cjose_jws_t* token) { cjose_jws_release(token); }
  struct Releaser {
    void operator()(cjose_jwk_t* key) const { cjose_jwk_release(key); }
  };
  std::string kid_, public_, jwks_;
  std::unique_ptr<cjose_jwk_t, Releaser> key_;
};

// For "localhost" and 127.0.0.1, good for an hour.
class SelfSigned {
 public:
  explicit SelfSigned(const std::filesystem::path& folder) : folder_(folder) {
    const std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
    const std::unique_ptr<X509, void (*)(X509*)> cert(X509_new(), X509_free);
    X509_set_version(cert.get(), 2);
    ASN1_INTEGER_set(X509_get_serialNumber(cert.get()), 1);
    X509_gmtime_adj(X509_getm_notBefore(cert.get()), -60);
    X509_gmtime_adj(X509_getm_notAfter(cert.get()), 3600);
    X509_set_pubkey(cert.get(), key.get());
    X509_NAME* name = X509_get_subject_name(cert.get());
    X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("localhost"),
                               -1, -1, 0);
    X509_set_issuer_name(cert.get(), name);
    Extend(cert.get(), NID_subject_alt_name, "DNS:localhost,IP:127.0.0.1");
    Extend(cert.get(), NID_basic_constraints, "critical,CA:TRUE");
    X509_sign(cert.get(), key.get(), EVP_sha256());
    Write(certificate_file(), [&](FILE* file) { PEM_write_X509(file, cert.get()); });
    Write(key_file(),
          [&](FILE* file) { PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr); });
  }
  std::string certificate_file() const { return (folder_ / "cert.pem").string(); }
  std::string key_file() const { return (folder_ / "key.pem").string(); }

 private:
  static void Extend(X509* cert, int nid, const char* value) {
    X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, nullptr, nid, value);
    X509_add_ext(cert, extension, -1);
    X509_EXTENSION_free(extension);
  }
  template <class Writer>
  static void Write(const std::string& path, const Writer& writer) {
    FILE* file = std::fopen(path.c_str(), "w");
    if (!file) throw std::runtime_error("no scratch file");
    writer(file);
    std::fclose(file);
  }
  std::filesystem::path folder_;
};

}  // namespace kvx::testing_support
