// A key that is revoked counts no more for what it began.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::FilesUnder;

TEST(RevokedKey, AnUploadUnderWayIsRefusedAndLeavesNothing) {
  testing_support::RunningServer s(testing_support::WithKeys(), false);
  const NewApiKey for_lab{"test", "lab", AccessScope::kWrite, {}, std::nullopt};
  const ApiKeys::Made key = s.world.keys.Add(for_lab);
  const httplib::Headers others{{"Authorization", "Bearer " + s.world.keys.Add(for_lab).text}};
  const auto made = s.http.Post("/v1/subjects", others, R"({"region":"knee"})", "application/json");
  const std::string scans = made->get_header_value("Location") + "/scans";
  testing_support::RawConnection upload(s.server.port());
  upload.Send("POST " + scans +
              "?name=a&filename=a.nii.gz HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 8\r\n" +
              "Authorization: Bearer " + key.text + "\r\n\r\nhalf");
  const auto incoming = s.world.scratch.path() / "incoming";
  for (int i = 0; i < 500 && FilesUnder(incoming) == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  s.world.keys.Revoke(key.record.id);
  upload.Send("rest");
  EXPECT_THAT(upload.Answer(), testing::StartsWith("HTTP/1.1 401"));
  EXPECT_EQ(FilesUnder(incoming), 0u);
  EXPECT_THAT(s.http.Get(scans, others)->body, testing::HasSubstr(R"("items":[])"));
}

}  // namespace
}  // namespace kvx
