// Runs the real program as a user would, without a shell.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace kvx::testing_support {

struct Ended {
  int code = 0;          // exit status; 128 + signal when killed
  std::string out, err;  // stdout, stderr
};

// KVX_PROGRAM, its output kept in files of `folder`.
class Program {
 public:
  Program(const std::filesystem::path& folder, const std::vector<std::string>& arguments);  // starts it
  Ended Wait();
  void Signal(int number);
  bool Running();  // does not wait

 private:
  pid_t pid_ = -1;
  bool ended_ = false;
  int status_ = 0;
  std::filesystem::path out_, err_;
};

Ended RunProgram(const std::filesystem::path& folder, const std::vector<std::string>& arguments);

}  // namespace kvx::testing_support
