// Archives of ours, opened by Python.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace kvx::testing_support {

// The files of the zip, in a folder of its name beside it. Paths of ours without blanks: a shell is safe.
inline std::filesystem::path Unzipped(const std::filesystem::path& zip) {
  const auto folder = std::filesystem::path(zip).replace_extension();
  const std::string command = "/usr/bin/python3 -m zipfile -e " + zip.string() + " " + folder.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
  return folder;
}

}  // namespace kvx::testing_support
