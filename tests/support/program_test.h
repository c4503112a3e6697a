// Fixture of tests that run the real program in a folder of their own.
#pragma once
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/fixtures.h"
#include "tests/support/program.h"

namespace kvx::testing_support {

class ProgramTest : public testing::Test {
 protected:
  std::string At(const std::string& name) const { return (scratch.path() / name).string(); }
  Ended Run(const std::vector<std::string>& arguments) const { return RunProgram(scratch.path(), arguments); }
  // With --json; what it printed.
  nlohmann::json RunJson(std::vector<std::string> arguments) const {
    arguments.push_back("--json");
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return nlohmann::json::parse(ended.out, nullptr, false);
  }
  ScratchFolder scratch;
};

}  // namespace kvx::testing_support
