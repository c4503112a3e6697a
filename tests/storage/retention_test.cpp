// Bytes of removed subjects: what cannot be removed keeps nothing of the others.
#include "storage/retention.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "storage/stores.h"
#include "tests/support/fixtures.h"
#include "tests/support/without_root_powers.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

struct Uploaded {
  std::string subject;
  fs::path blob;
};

Uploaded Upload(Stores& stores, const std::string& bytes) {
  IncomingBlob blob = stores.blobs.Receive(".nii", 1 << 20);
  blob.Write(std::string_view(bytes));
  const std::string content = stores.blobs.Keep(std::move(blob));
  const std::string subject = stores.catalogue.AddSubject({"Jane Roe", "knee", {}}).id;
  stores.catalogue.AddScan(subject, "pose00", {content, content, ".nii", int64_t(bytes.size()), "{}"});
  return {subject, stores.blobs.PathOf(content)};
}

TEST(Retention, BytesThatCannotBeRemovedKeepNothingOfTheOthers) {
  const testing_support::ScratchFolder scratch;
  Stores stores(scratch.path() / "data", {});
  const Uploaded stuck = Upload(stores, "VOXELS"), other = Upload(stores, "VOXELS of another");
  for (const Uploaded& uploaded : {stuck, other})
    stores.retention.DeleteSubject(uploaded.subject, "-", "default");
  const auto remove = [&] { stores.retention.RemoveBytes([](const std::string&) {}); };
  fs::permissions(stuck.blob.parent_path(), fs::perms::owner_read | fs::perms::owner_exec);
  testing_support::WithoutRootPowers([&] { EXPECT_THROW(remove(), Unavailable); });
  EXPECT_TRUE(fs::exists(stuck.blob));
  EXPECT_FALSE(fs::exists(other.blob));
  fs::permissions(stuck.blob.parent_path(), fs::perms::owner_all);
  remove();
  EXPECT_FALSE(fs::exists(stuck.blob)) << "it is tried again";
}

}  // namespace
}  // namespace kvx
