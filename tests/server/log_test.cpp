// What the log tells of a failure.
#include "server/log.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/errors.h"

namespace kvx {
namespace {

template <class E>
std::string Described(const E& error) {
  return DescribeForLog(std::make_exception_ptr(error));
}

TEST(Log, SentencesForClientsAreNotRepeated) {
  EXPECT_EQ(Described(InputError("scan 'Mueller_1970': the file is cut off")), "kvx::InputError");
  EXPECT_EQ(Described(NotFound("there is no scan 'Mueller_1970'")), "kvx::NotFound");
  EXPECT_EQ(Described(Conflict("'Mueller_1970' is there already")), "kvx::Conflict");
}

TEST(Log, WhatOperatorsNeedIs) {
  EXPECT_EQ(Described(Unavailable("the device does not answer")),
            "kvx::Unavailable: the device does not answer");
  EXPECT_EQ(Described(std::logic_error("no route")), "std::logic_error: no route");
}

TEST(Log, FileSystemErrorsNameNoPaths) {
  const auto code = std::make_error_code(std::errc::no_such_file_or_directory);
  const std::filesystem::filesystem_error error("open", "/scans/Mueller_1970.nii", code);
  EXPECT_EQ(Described(error).find("Mueller"), std::string::npos);
}

}  // namespace
}  // namespace kvx
