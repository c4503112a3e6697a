// A data folder, and room beside it for its backups.
#pragma once
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <string>

#include "core/errors.h"
#include "storage/stores.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"
#include "tests/support/without_root_powers.h"

namespace kvx::testing_support {

namespace fs = std::filesystem;

inline void Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

// What the denial says.
inline std::string Denial(const std::function<void()>& act) {
  std::string told;
  WithoutRootPowers([&] { told = RefusalOf<Denied>(act, "none"); });
  return told;
}

// A data folder with one uploaded scan, and room beside it.
class Backup : public testing::Test {
 protected:
  Backup() {
    Stores stores(data(), {});
    IncomingBlob blob = stores.blobs.Receive(".nii", 1 << 20);
    blob.Write(std::string_view("VOXELS"));
    const std::string content = stores.blobs.Keep(std::move(blob));
    subject = stores.catalogue.AddSubject({"Jane Roe", "knee", {}}).id;
    scan = stores.catalogue.AddScan(subject, "pose00", {content, content, ".nii", 6, "{}"}).id;
    upload = fs::path("blobs") / content.substr(0, 2) / content;
  }
  fs::path data() const { return scratch.path() / "data"; }
  fs::path copy() const { return scratch.path() / "copy"; }
  void RemoveSubject() const {
    Stores stores(data(), {});
    stores.retention.DeleteSubject(subject, "-", "default");
    stores.retention.RemoveBytes([](const std::string&) {});
  }
  ScratchFolder scratch;
  std::string subject, scan;
  fs::path upload;
};

}  // namespace kvx::testing_support
