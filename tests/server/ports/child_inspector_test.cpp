// A reader that breaks costs its file, and says what to do. Shell scripts stand in for the program.
#include "server/ports/child_inspector.h"

#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <thread>

#include "core/errors.h"
#include "pipeline/io/dicom/pack_series.h"
#include "server/log.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

struct InspectorWorld {
  testing_support::ScratchFolder scratch;

  std::filesystem::path Script(const std::string& body) const {
    SetLogLevel("off");
    const auto path = scratch.path() / "reader";
    std::ofstream(path) << "#!/bin/sh\n" << body << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
  }
  // Of a series of one image.
  std::filesystem::path Archive() const {
    const auto series = scratch.path() / "series", archive = scratch.path() / "series.tar.gz";
    std::filesystem::create_directories(series);
    std::ofstream(series / "IM1") << "an old image" << '\0';
    PackSeries(series, archive);
    return archive;
  }
  std::filesystem::path Folder(const std::string& name) const {
    std::filesystem::create_directories(scratch.path() / name);
    return scratch.path() / name;
  }
  std::string RefusalOf(const std::string& body, InspectionLimits limits = {}) const {
    ChildInspector inspector(Script(body), limits);
    try {
      inspector.InspectScan("file", "lab");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }
};

TEST(ChildInspector, BelievesWhatTheChildFound) {
  InspectorWorld w;
  ChildInspector inspector(
      w.Script(R"(echo '{"facts":{"size":[4,5,6],"spacing":[0.5,1,2],"origin":[1,2,3],)"
               R"("direction":[0,1,0,1,0,0,0,0,1],"modality":"MR","type":"int16","labels":[1,7],)"
               R"("list":[{"label":7,"name":"tibia","parent":null,"confidence":0.4,"looks_like":"femur",)"
               R"("voxels":3,"cm3":0.5,"centre":[1,2,3]}]}}')"));
  const ScanFacts scan = inspector.InspectScan("file", "lab");
  EXPECT_EQ(scan.grid.size, Eigen::Vector3i(4, 5, 6));
  EXPECT_EQ(scan.grid.spacing_mm, Eigen::Vector3d(0.5, 1, 2));
  EXPECT_EQ(scan.grid.origin.lps, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scan.grid.direction(0, 1), 1);
  EXPECT_EQ(scan.grid.direction(1, 1), 0);
  EXPECT_EQ(scan.stored_as, ScalarType::kInt16);
  EXPECT_EQ(scan.modality, "MR");
  const LabelFacts labels = inspector.InspectLabels("file", "knee", "lab");
  EXPECT_EQ(labels.labels, (std::vector<int>{1, 7}));
  ASSERT_EQ(labels.bones.size(), 1u);
  EXPECT_EQ(labels.bones[0].name, "tibia");
  EXPECT_EQ(labels.bones[0].looks_like, "femur");
  EXPECT_EQ(labels.bones[0].centre.lps, Eigen::Vector3d(1, 2, 3));
}

TEST(ChildInspector, ARefusalIsPassedOn) {
  EXPECT_EQ(InspectorWorld().RefusalOf(R"(echo '{"refusal":"convert it again"}')"), "convert it again");
}

TEST(ChildInspector, ACrashIsTheFilesFault) {
  const InspectorWorld w;
  for (const char* body : {"kill -SEGV $$", "kill -ABRT $$", "exit 1", "echo rubbish",
                           "echo '{\"facts\":{}}'; exit 3", "true"}) {
    EXPECT_NE(w.RefusalOf(body).find("cannot be read"), std::string::npos) << body;
  }
}

TEST(ChildInspector, AReaderThatHangsIsStopped) {
  InspectionLimits limits;
  limits.seconds = 1;
  EXPECT_NE(InspectorWorld().RefusalOf("exec sleep 600", limits).find("time"), std::string::npos);
}

// The processors are others' meanwhile: the file is not at fault.
TEST(ChildInspector, AReaderThatComputesIsWaitedFor) {
  InspectorWorld w;
  InspectionLimits limits;
  limits.seconds = 2;
  const auto reader = w.Script(R"sh(exec /usr/bin/python3 -c '
import time
end = time.monotonic() + 3
while time.monotonic() < end: pass
print("""{"facts":{"size":[4,5,6],"spacing":[1,1,1],"origin":[0,0,0],
          "direction":[1,0,0,0,1,0,0,0,1],"modality":"MR","type":"int16"}}""")')sh");
  EXPECT_EQ(ChildInspector(reader, limits).InspectScan("file", "lab").grid.size, Eigen::Vector3i(4, 5, 6));
}

TEST(ChildInspector, AProgramThatIsNotThereIsNoFaultOfTheFile) {
  ChildInspector inspector("/nowhere/kinevox");
  EXPECT_THROW(inspector.InspectScan("file", "lab"), Unavailable);
}

// Files that take their reader long hold up the project that sent them, not the others.
TEST(ChildInspector, OneProjectsSlowFilesLeaveAPlaceToTheOthers) {
  InspectorWorld w;
  InspectionLimits limits;
  limits.seconds = 60;
  limits.waiting_of_project = 1;
  const auto marks = w.scratch.path() / "slow";
  const auto over = w.scratch.path() / "over";
  ChildInspector inspector(
      w.Script("if [ $3 = slow ]; then echo x >> '" + marks.string() + "'; while [ ! -e '" + over.string() +
               "' ]; do sleep 0.05; done; fi; echo '{\"refusal\":\"no\"}'"),
      limits);
  const auto inspect = [&](const char* file, const char* project) {
    EXPECT_THROW(inspector.InspectScan(file, project), InputError);
  };
  std::thread first([&] { inspect("slow", "greedy"); }), second([&] { inspect("slow", "greedy"); });
  while (!std::filesystem::exists(marks)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  inspect("quick", "other");
  EXPECT_EQ(std::filesystem::file_size(marks), 2u) << "of the greedy one's two, one is being read";
  std::ofstream(over) << "x";
  first.join();
  second.join();
}

// However many a project sends at the same time, one of them is unpacked and lies there.
TEST(ChildInspector, OneProjectsArchivesAreUnpackedOneAfterTheOther) {
  InspectorWorld w;
  ChildInspector inspector(w.Script("echo '{\"refusal\":\"no\"}'"));
  const auto archive = w.Archive();
  std::atomic<int> unpacking{0};
  std::promise<void> go_on;
  const std::shared_future<void> may_go_on = go_on.get_future().share();
  const auto inspect = [&](const char* folder, const char* project, const std::function<void(size_t)>& look) {
    EXPECT_THROW(inspector.InspectSeries(archive, w.Folder(folder), project, look), InputError);
  };
  const auto slow = [&](size_t) { ++unpacking, may_go_on.wait(); };
  std::thread first([&] { inspect("1", "greedy", slow); }), second([&] { inspect("2", "greedy", slow); });
  while (unpacking == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  inspect("3", "other", [](size_t) {});
  EXPECT_EQ(unpacking, 1);
  go_on.set_value();
  first.join();
  second.join();
}

TEST(ChildInspector, AServiceThatHasDrainedWaitsNeitherForAnArchiveNorForAReader) {
  InspectorWorld w;
  std::atomic<bool> drained{false};
  InspectionLimits limits;
  limits.seconds = 60;
  const auto begin = std::chrono::steady_clock::now();
  ChildInspector inspector(w.Script("exec sleep 600"), limits, [&] { return drained.load(); });
  auto reading = std::async(std::launch::async, [&] { inspector.InspectScan("file", "lab"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  drained = true;
  EXPECT_THROW(reading.get(), Unavailable);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(limits.seconds / 2));
  const auto folder = w.Folder("unpacked");
  EXPECT_THROW(inspector.InspectSeries(w.Archive(), folder, "lab", [](size_t) {}), Unavailable);
  EXPECT_TRUE(std::filesystem::is_empty(folder) || std::filesystem::file_size(folder / "incoming") == 0)
      << "before the first byte";
}

}  // namespace
}  // namespace kvx
