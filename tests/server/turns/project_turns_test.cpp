// However much one project asks for, the others' turn comes.
#include "server/turns/project_turns.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <thread>

#include "core/errors.h"
#include "tests/support/failing_new.h"

namespace kvx {
namespace {

const std::string kLongName = "a project whose name needs memory of its own";

// Waits for a turn on a thread of its own, notes its name in `order` when it has it, and ends.
std::thread Wait(ProjectTurns& turns, const std::string& project, std::vector<std::string>& order) {
  const int before = turns.Waiting(project);
  std::thread thread([&turns, project, &order] {
    const ProjectTurns::Turn turn(turns, project);
    order.push_back(project);  // one place, so one at a time
  });
  while (turns.Waiting(project) == before) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return thread;
}

TEST(ProjectTurns, AProjectHasOnePlaceAndLeavesTheOthersToOthers) {
  ProjectTurns turns(2, 1);
  auto first = std::make_unique<ProjectTurns::Turn>(turns, "greedy");
  auto second = std::async(std::launch::async, [&] { const ProjectTurns::Turn turn(turns, "greedy"); });
  while (turns.Waiting("greedy") == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  { const ProjectTurns::Turn turn(turns, "other"); }  // does not wait
  EXPECT_EQ(turns.Waiting("greedy"), 1);
  EXPECT_THROW(ProjectTurns::Turn(turns, "greedy"), Unavailable) << "its line is full";
  first.reset();
  second.get();
}

TEST(ProjectTurns, WhoWasServedLongestAgoIsNext) {
  ProjectTurns turns(1, 8);
  std::vector<std::string> order;
  std::vector<std::thread> threads;
  {
    const ProjectTurns::Turn turn(turns, "greedy");
    for (const char* project : {"greedy", "greedy", "greedy", "other"})
      threads.push_back(Wait(turns, project, order));
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order, (std::vector<std::string>{"other", "greedy", "greedy", "greedy"}));
}

TEST(ProjectTurns, NoPlaceIsLostForWantOfMemory) {
  const auto turns = std::make_shared<ProjectTurns>(1, 8);
  EXPECT_GT(testing_support::TimesWithoutMemory([&] { ProjectTurns::Turn(*turns, kLongName); }), 2);
  EXPECT_EQ(turns->Waiting(kLongName), 0);
  const auto served = std::make_shared<std::promise<void>>();
  std::thread([turns, served] {
    ProjectTurns::Turn(*turns, "other");
    served->set_value();
  }).detach();  // without a place it waits for ever
  EXPECT_EQ(served->get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
}

}  // namespace
}  // namespace kvx
