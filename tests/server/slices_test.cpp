// Slices over real sockets: where they lie, and how a browser takes them.
#include <gmock/gmock.h>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RunningServer;

// A picture has no place for its geometry, and a page has no other way to know it. The second picture comes
// from what is kept.
TEST(Slices, SayWhereTheyLieWhateverTheirFormat) {
  RunningServer s;
  const std::string slice = "/v1/models/" + s.BuiltModel() + "/slice?mm=7";
  for (const std::string format : {"png", "nrrd", "nii.gz", "png"}) {
    const auto answer = s.http.Get(slice + "&format=" + format);
    const bool picture = format == "png";
    EXPECT_EQ(answer->body, "slice axial 7 0") << format;
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Size"), "4,3,1") << format;
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Spacing"), "0.5,0.5,0.5") << format;
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Origin"), "1.0,2.0,7.0") << format;
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Direction"), "1.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0");
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Type"), picture ? "uint8" : "int16");
    EXPECT_EQ(answer->get_header_value("X-Kinevox-Window"), picture ? "10.0,200.0" : "");
    EXPECT_THAT(answer->get_header_value("Content-Disposition"),
                testing::StartsWith(picture ? "inline" : "attachment"));
  }
  EXPECT_EQ(s.http.Head(slice)->get_header_value("X-Kinevox-Size"), "4,3,1");
  EXPECT_EQ(s.http.Get(slice, httplib::Headers{{"Range", "bytes=6-10"}})->body, "axial");
}

TEST(Slices, APageOfAnotherOriginMaySeeWhereTheyLie) {
  HttpOptions options;
  options.cors_origins = {"https://viewer.example"};
  RunningServer s(options);
  const auto answer = s.http.Get("/v1/models/" + s.BuiltModel() + "/slice",
                                 httplib::Headers{{"Origin", "https://viewer.example"}});
  const std::string exposed = answer->get_header_value("Access-Control-Expose-Headers");
  for (const char* name : {"Size", "Spacing", "Origin", "Direction", "Type", "Window"})
    EXPECT_THAT(exposed, testing::HasSubstr(std::string("X-Kinevox-") + name));
}

}  // namespace
}  // namespace kvx
