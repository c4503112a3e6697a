// Results made once, kept in memory and on disk.
#include "storage/files/result_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/errors.h"
#include "tests/support/failing_new.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::FilesUnder;
using testing_support::ScratchFolder;

std::string Content(const CachedFile& file) {
  std::string bytes(file.size(), '\0');
  EXPECT_EQ(file.ReadAt(0, bytes.data(), bytes.size()), bytes.size());
  return bytes;
}

TEST(ResultCache, ManyRequestsComputeOnce) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  std::atomic<int> made{0}, right{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 60; ++t) {
    threads.emplace_back([&] {
      const auto file = cache.GetBytes("one", [&] {
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        return std::string("bytes");
      });
      right += Content(*file) == "bytes";
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made, 1);
  EXPECT_EQ(right, 60);
}

TEST(ResultCache, WhatWasMadeInMemoryIsOnDiskForTheNextStart) {
  const ScratchFolder scratch;
  {
    ResultCache cache(scratch.path() / "r", 1 << 20);
    cache.GetBytes("one", [] { return std::string(5000, 'x'); });
    EXPECT_EQ(cache.Figures().memory_bytes, 5000);
  }
  ResultCache next(scratch.path() / "r", 1 << 20);
  EXPECT_EQ(Content(*next.GetBytes("one", []() -> std::string { throw InputError("made again"); })),
            std::string(5000, 'x'));
  EXPECT_EQ(next.Find("other"), nullptr);
}

TEST(ResultCache, WhatALossOfPowerEmptiedIsMadeAgain) {
  const ScratchFolder scratch;
  std::filesystem::create_directories(scratch.path() / "r");
  std::ofstream(scratch.path() / "r/one");
  ResultCache cache(scratch.path() / "r", 1 << 20);
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "r/one"));
  EXPECT_EQ(Content(*cache.GetBytes("one", [] { return std::string("made again"); })), "made again");
}

// Files of ten bytes, used at these minutes.
void MakeFiles(const std::filesystem::path& folder, const std::vector<std::pair<std::string, int>>& files) {
  std::filesystem::create_directories(folder);
  const auto now = std::filesystem::file_time_type::clock::now();
  for (const auto& [name, minute] : files) {
    std::ofstream(folder / name) << "ten bytes.";
    std::filesystem::last_write_time(folder / name, now - std::chrono::minutes(60 - minute));
  }
}

std::vector<std::string> NamesIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

TEST(ResultCache, TheLeastRecentlyUsedGoFirstAfterAStartToo) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "r";
  MakeFiles(folder, {{"a", 30}, {"b", 10}, {"c", 50}, {"d", 20}, {"e", 40}});
  ResultCache cache(folder, 39);
  EXPECT_EQ(NamesIn(folder), (std::vector<std::string>{"a", "c", "e"}));
  EXPECT_EQ(cache.Figures().bytes, 30);
  EXPECT_TRUE(cache.Find("a"));
  cache.Get("f", [](const auto& path) { std::ofstream(path) << "ten bytes."; });
  EXPECT_EQ(NamesIn(folder), (std::vector<std::string>{"a", "c", "f"})) << "e has not been used for longest";
}

// A link that leads nowhere answers as a file that another process removes just then.
TEST(ResultCache, AFileThatVanishesAtTheStartIsNoHindrance) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "r";
  MakeFiles(folder, {{"a", 10}, {"b", 20}});
  std::filesystem::create_symlink("nowhere", folder / "vanished");
  ResultCache cache(folder, 1 << 20);
  EXPECT_EQ(cache.Figures().files, 2);
  EXPECT_EQ(cache.Find("vanished"), nullptr);
}

// Slices are small: a cache of some GiB holds that many. Comparing each with all others took minutes.
TEST(ResultCache, TensOfThousandsOfFilesAreTakenOverInSeconds) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "r";
  std::vector<std::pair<std::string, int>> files;
  for (int i = 0; i < 30'000; ++i) files.emplace_back("mdl_a." + std::to_string(i) + ".png", i * 7919 % 60);
  MakeFiles(folder, files);
  const auto before = std::chrono::steady_clock::now();
  ResultCache cache(folder, 1000);
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(15));
  EXPECT_EQ(cache.Figures().files, 100);
}

TEST(ResultCache, WhatAnotherProcessPutIntoTheFolderCountsWithoutBeingAskedFor) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "r";
  ResultCache cache(folder, 25);
  cache.Get("first", [](const auto& path) { std::ofstream(path) << "ten bytes."; });
  MakeFiles(folder, {{"a", 10}, {".part-7-b", 20}, {"new_c-d", 30}});
  cache.CountOthers();
  EXPECT_EQ(cache.Figures().files, 2);
  EXPECT_EQ(cache.Figures().bytes, 20);
  MakeFiles(folder, {{"b", 40}});
  cache.CountOthers();
  EXPECT_EQ(NamesIn(folder), (std::vector<std::string>{".part-7-b", "a", "b", "new_c-d"}))
      << "the limit holds";
}

// A worker of another process writes animations into the folder, and nobody has asked for them yet.
TEST(ResultCache, WhatNobodyHasAskedForGoesWithItsModel) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  for (const char* name : {"mdl_a.1.nii.gz", ".part-7-0-mdl_a.2.nii.gz", "mdl_b.1.nii.gz"})
    std::ofstream(scratch.path() / "r" / name) << "frames";
  cache.DropOf("mdl_a.");
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "r/mdl_a.1.nii.gz"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "r/.part-7-0-mdl_a.2.nii.gz"));
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "r/mdl_b.1.nii.gz"));
}

TEST(ResultCache, WhatIsKeptInMemoryGoesWithItsModel) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  for (const char* name : {"mdl_a.1", "mdl_a.2", "mdl_b.1"})
    cache.GetBytes(name, [] { return std::string(5000, 'x'); });
  cache.DropOf("mdl_a.");
  EXPECT_EQ(cache.Figures().memory_bytes, 5000);
  EXPECT_EQ(cache.Find("mdl_a.1"), nullptr);
  EXPECT_EQ(Content(*cache.Find("mdl_b.1")), std::string(5000, 'x'));
}

// A large one is being written to disk while the model goes, so that the model's still waits for the disk.
TEST(ResultCache, WhatStillWaitsForTheDiskGoesWithItsModel) {
  const ScratchFolder scratch;
  {
    ResultCache cache(scratch.path() / "r", 1 << 30);
    cache.GetBytes("mdl_b.1", [] { return std::string(100 << 20, 'x'); });
    cache.GetBytes("mdl_a.1", [] { return std::string(5000, 'x'); });
    cache.DropOf("mdl_a.");
  }
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "r/mdl_a.1"));
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "r/mdl_b.1"));
}

TEST(ResultCache, MemoryIsBounded) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20, 10'000);
  for (int i = 0; i < 50; ++i)
    cache.GetBytes(std::to_string(i), [&] { return std::string(3000, char('a' + i % 26)); });
  EXPECT_LE(cache.Figures().memory_bytes, 10'000);
  EXPECT_EQ(Content(*cache.GetBytes("49", []() -> std::string { throw InputError("made again"); }))[0],
            char('a' + 49 % 26));
}

// The same object is from memory, another one from disk.
TEST(ResultCache, MemoryKeepsWhatWasUsedLast) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20, 10'000);
  const auto get = [&](const char* name) {
    return cache.GetBytes(name, [] { return std::string(3000, 'x'); });
  };
  const auto a = get("a"), b = get("b"), c = get("c");
  EXPECT_EQ(cache.Find("a"), a);
  const auto d = get("d");  // one has to go
  EXPECT_EQ(cache.Find("a"), a) << "it was used a moment ago";
  EXPECT_EQ(cache.Find("c"), c);
  EXPECT_EQ(cache.Find("d"), d);
  EXPECT_NE(cache.Find("b"), b);
}

TEST(ResultCache, WantOfMemoryDoesNotEndTheThreadThatStores) {
  const ScratchFolder scratch;
  const std::string name = "a name that needs memory of its own";
  {
    ResultCache cache(scratch.path() / "r", 1 << 20);
    {
      const testing_support::FailingNewElsewhere failing;
      cache.GetBytes(name, [] { return std::string(5000, 'x'); });
      std::this_thread::sleep_for(std::chrono::milliseconds(100));  // it tries meanwhile
    }
    cache.GetBytes("next", [] { return std::string(5000, 'y'); });
  }
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "r" / "next"));
}

// 128 MiB may wait for the disk; what has come there waits no longer.
TEST(ResultCache, WhatIsOnDiskMakesRoomForMore) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 60 << 20, 1000);
  for (int i = 0; i < 4; ++i) {
    const std::string name = std::to_string(i);
    cache.GetBytes(name, [] { return std::string(48 << 20, 'x'); });
    for (int tries = 0; !cache.Find(name) && tries < 2000; ++tries)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_TRUE(cache.Find(name)) << name;
  }
}

TEST(ResultCache, AMakerThatGivesUpIsReplacedByOneWhoWaits) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  std::atomic<bool> started{false}, give_up{false};
  std::thread first([&] {
    EXPECT_THROW(cache.GetBytes("one",
                                [&]() -> std::string {
                                  started = true;
                                  while (!give_up) std::this_thread::yield();
                                  throw Cancelled();
                                }),
                 Cancelled);
  });
  while (!started) std::this_thread::yield();
  std::thread second(
      [&] { EXPECT_EQ(Content(*cache.GetBytes("one", [] { return std::string("mine"); })), "mine"); });
  while (cache.Figures().hits == 0) std::this_thread::yield();
  give_up = true;
  first.join();
  second.join();
}

// Made by a client that stays, until it is let go.
struct SlowResult {
  const ScratchFolder scratch;
  ResultCache cache{scratch.path() / "r", 1 << 20};
  std::atomic<bool> made{false};
  std::vector<std::thread> threads;

  SlowResult() {
    std::atomic<bool> begun{false};
    threads.emplace_back([this, &begun] {
      cache.GetBytes("one", [this, &begun] {
        begun = true;
        while (!made) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return std::string("bytes");
      });
    });
    while (!begun) std::this_thread::yield();
  }
  ~SlowResult() {
    made = true;
    for (std::thread& thread : threads) thread.join();
  }
  std::shared_ptr<const CachedFile> Ask(const Asker& asker) {
    return cache.GetBytes(
        "one", []() -> std::string { throw InputError("made again"); }, asker);
  }
  void WaitFor(int64_t waiting) const {
    while (cache.Figures().hits != waiting) std::this_thread::yield();
  }
};

TEST(ResultCache, WhoHasGoneDoesNotWaitForWhatIsBeingMade) {
  SlowResult r;
  std::atomic<bool> gone{false};
  std::atomic<int> left{0};
  for (int i = 0; i < 64; ++i) {
    r.threads.emplace_back([&] {
      EXPECT_THROW(r.Ask({"a", [&] { return gone.load(); }}), Cancelled);
      ++left;
    });
  }
  r.WaitFor(64);
  EXPECT_EQ(left, 0);
  gone = true;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (left < 64 && std::chrono::steady_clock::now() < until) std::this_thread::yield();
  EXPECT_EQ(left, 64) << "the result is not made yet";
}

TEST(ResultCache, WaitersOfOneProjectLeavePlacesToOthers) {
  SlowResult r;
  std::atomic<int> right{0};
  const auto wait = [&](const char* project) {
    r.threads.emplace_back([&r, &right, project] { right += Content(*r.Ask({project, {}})) == "bytes"; });
  };
  for (int i = 0; i < 64; ++i) wait("a");
  r.WaitFor(64);
  EXPECT_THROW(r.Ask({"a", {}}), Unavailable);
  wait("b");
  r.WaitFor(65);
  r.made = true;
  while (right < 65) std::this_thread::yield();
  EXPECT_EQ(Content(*r.Ask({"a", {}})), "bytes") << "what is made is not waited for";
}

void WriteText(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

TEST(ResultCache, MakesEachResultOnceHoweverManyAsk) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  std::atomic<int> made = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      const auto file = cache.Get("a.txt", [&](const std::filesystem::path& path) {
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        WriteText(path, "result");
      });
      EXPECT_EQ(Content(*file), "result");
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(made, 1);
}

TEST(ResultCache, DropsTheLeastRecentlyUsedAndKeepsOpenFilesReadable) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 25);
  const auto ten = [](const std::filesystem::path& path) { WriteText(path, "0123456789"); };
  const auto never = [](const std::filesystem::path&) { FAIL() << "it was kept"; };
  cache.Get("a", ten);
  const auto b = cache.Get("b", ten);
  cache.Get("a", never);  // a is newer than b now
  cache.Get("c", ten);    // b goes
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "r/b"));
  EXPECT_EQ(Content(*b), "0123456789");
  cache.Get("a", never);
  EXPECT_EQ(cache.Figures().bytes, 20);
}

TEST(ResultCache, AFailureIsNotKept) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 100);
  EXPECT_THROW(cache.Get("a",
                         [](const std::filesystem::path& path) {
                           WriteText(path, "half");
                           throw Unavailable("no");
                         }),
               Unavailable);
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
  EXPECT_EQ(Content(*cache.Get("a", [](const std::filesystem::path& path) { WriteText(path, "whole"); })),
            "whole");
}

TEST(ResultCache, IsTakenOverAtTheNextStart) {
  const ScratchFolder scratch;
  {
    ResultCache(scratch.path() / "r", 100).Get("a", [](const std::filesystem::path& path) {
      WriteText(path, "kept");
    });
  }
  ResultCache again(scratch.path() / "r", 100);
  EXPECT_EQ(Content(*again.Get("a", [](const std::filesystem::path&) { FAIL() << "it was there"; })), "kept");
  { ResultCache smaller(scratch.path() / "r", 1); }
  EXPECT_EQ(FilesUnder(scratch.path()), 1u)
      << "the last result is served even when it is larger than the cache";
}

}  // namespace
}  // namespace kvx
