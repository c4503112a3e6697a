// Lists and what is found in them, in real SQLite files.
#include "storage/catalogue.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "storage/job_queue.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

struct CatalogueWorld {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }};
  Catalogue catalogue{database};
  JobQueue jobs{database};
  std::string subject = AddSubject();

  std::string AddSubject() { return catalogue.AddSubject({.region = "knee"}).id; }
  std::string AddScan(const std::string& name) { return catalogue.AddScan(subject, name, kFile).id; }
  std::string AddBones(const std::string& scan) { return catalogue.AddBones(subject, scan, kFile).id; }
  std::string AddModel(const std::string& id, const std::string& scan) {
    catalogue.AddModel({.id = id,
                        .subject = subject,
                        .template_scan = scan,
                        .request = "{}",
                        .job = jobs.Submit({"build_model", id, "{}"}).id});
    return id;
  }

  inline static const StoredFile kFile{"ab", "ab", ".nii", 2, "{}"};
};

// Of list(request), by pages of two.
template <class List>
std::vector<std::string> AllIds(const List& list) {
  std::vector<std::string> ids;
  PageRequest request{.limit = 2};
  while (true) {
    const auto page = list(request);
    EXPECT_LE(page.items.size(), 2u);
    for (const auto& item : page.items) ids.push_back(item.id);
    if (!page.next_before) return ids;
    request.before = *page.next_before;
  }
}

TEST(Catalogue, EveryListIsPagedAndNewestFirst) {
  CatalogueWorld w;
  std::vector<std::string> subjects{w.subject}, scans, bones, batches, models;
  const auto first = [](std::vector<std::string>& list, const std::string& id) {
    list.insert(list.begin(), id);
  };
  for (const std::string number : {"0", "1", "2", "3", "4"}) {
    first(subjects, w.AddSubject());
    first(scans, w.AddScan("pose0" + number));
    first(bones, w.AddBones(scans.front()));
    first(batches, w.catalogue.AddBatch(number).id);
    first(models, w.AddModel("mdl_" + number, scans.front()));
  }
  EXPECT_EQ(AllIds([&](const PageRequest& r) { return w.catalogue.Subjects(r); }), subjects);
  EXPECT_EQ(AllIds([&](const PageRequest& r) { return w.catalogue.Scans(w.subject, r); }), scans);
  EXPECT_EQ(AllIds([&](const PageRequest& r) { return w.catalogue.Bones(w.subject, r); }), bones);
  EXPECT_EQ(AllIds([&](const PageRequest& r) { return w.catalogue.Batches(r); }), batches);
  EXPECT_EQ(AllIds([&](const PageRequest& r) { return w.catalogue.Models(r); }), models);
}

TEST(Catalogue, AllScansComeInTheOrderOfTheirUpload) {
  CatalogueWorld w;
  const std::string one = w.AddScan("b"), two = w.AddScan("a");
  const std::vector<ScanRecord> all = w.catalogue.AllScans(w.subject);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].id, one);
  EXPECT_EQ(all[1].id, two);
  EXPECT_THROW(w.AddScan("a"), Conflict);
}

TEST(Catalogue, TheLatestBonesAreThoseOfTheScanAskedFor) {
  CatalogueWorld w;
  const std::string scan = w.AddScan("pose00"), other = w.AddScan("pose01");
  w.AddBones(scan);
  const std::string latest = w.AddBones(scan);
  w.AddBones(other);
  EXPECT_EQ(w.catalogue.LatestBones(w.subject, scan)->id, latest);
  EXPECT_FALSE(w.catalogue.LatestBones(w.AddSubject(), scan));
}

}  // namespace
}  // namespace kvx
