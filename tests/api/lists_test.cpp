// Lists that are searched, page by page, and only in one's own project.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/handlers/jobs.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::Field;
using testing_support::RefusalOf;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

std::string SubjectCalled(Services& services, const std::string& external_id) {
  const Json body{{"region", "knee"}, {"external_id", external_id}};
  return Field(CreateSubject(services, Dump(body), "").body, "id");
}

using List = std::string (*)(Services&, const Query&);

// Ids of all pages of two items each, in their order.
std::vector<std::string> AllIds(List list, Services& services, const Query& filter) {
  std::vector<std::string> ids;
  Query query = filter;
  query.emplace("limit", "2");
  while (true) {
    const Json page = Json::parse(list(services, query));
    EXPECT_LE(page["items"].size(), 2u);
    for (const Json& item : page["items"]) ids.push_back(item["id"]);
    if (page["next"].is_null()) return ids;
    query.erase("cursor");
    query.emplace("cursor", page["next"].get<std::string>());
  }
}

TEST(Lists, ASubjectIsFoundByItsExternalIdInItsProjectAlone) {
  ServiceWorld w;
  ProjectServices ours(w.services, "ours"), theirs(w.services, "theirs");
  SubjectCalled(ours.services, "P-1");
  const std::string wanted = SubjectCalled(ours.services, "P-2");
  const std::string of_others = SubjectCalled(theirs.services, "P-2");
  SubjectCalled(ours.services, "P-3");
  EXPECT_EQ(AllIds(ListSubjects, ours.services, {{"external_id", "P-2"}}), std::vector{wanted});
  EXPECT_EQ(AllIds(ListSubjects, theirs.services, {{"external_id", "P-2"}}), std::vector{of_others});
  EXPECT_EQ(AllIds(ListSubjects, theirs.services, {{"external_id", "P-1"}}), std::vector<std::string>{});
  EXPECT_EQ(AllIds(ListSubjects, ours.services, {}).size(), 3u);
}

TEST(Lists, AKnownExternalIdIsRefusedWithTheSubjectThatHasIt) {
  ServiceWorld w;
  ProjectServices ours(w.services, "ours"), theirs(w.services, "theirs");
  const std::string of_others = SubjectCalled(theirs.services, "P-1");
  const std::string there = SubjectCalled(ours.services, "P-1");
  const std::string refusal = RefusalOf([&] { SubjectCalled(ours.services, "P-1"); });
  EXPECT_THAT(refusal, testing::HasSubstr(there));
  EXPECT_THAT(refusal, testing::Not(testing::HasSubstr(of_others)));
}

TEST(Lists, ModelsOfOneSubjectArePagedAsAllAre) {
  ServiceWorld w;
  const std::string one = SubjectWithScans(w), other = SubjectWithScans(w);
  std::vector<std::string> of_one;
  for (const std::string& subject : {one, other, one, other, one}) {
    const Json body{{"subject", subject}, {"template", "pose00"}};
    const std::string model = Field(CreateModel(w.services, Dump(body), "").body, "id");
    if (subject == one) of_one.insert(of_one.begin(), model);
  }
  EXPECT_EQ(AllIds(ListModels, w.services, {{"subject", one}}), of_one) << "newest first";
  EXPECT_EQ(AllIds(ListModels, w.services, {}).size(), 5u);
  EXPECT_THROW(ListModels(w.services, {{"subject", "sub_none"}}), NotFound);
  ProjectServices theirs(w.services, "theirs");
  EXPECT_THROW(ListModels(theirs.services, {{"subject", one}}), NotFound);
}

TEST(Lists, JobsAreFoundByTheirState) {
  ServiceWorld w;
  std::vector<std::string> queued;
  for (int i = 0; i < 4; ++i) queued.insert(queued.begin(), w.jobs.Submit({"build_model", "mdl", "{}"}).id);
  const std::string running = w.jobs.Claim("w")->id;
  std::erase(queued, running);
  EXPECT_EQ(AllIds(ListJobs, w.services, {{"state", "queued"}}), queued);
  EXPECT_EQ(AllIds(ListJobs, w.services, {{"state", "running"}}), std::vector{running});
  EXPECT_EQ(AllIds(ListJobs, w.services, {{"state", "failed"}}), std::vector<std::string>{});
  EXPECT_THROW(ListJobs(w.services, {{"state", "waiting"}}), InputError);
  EXPECT_THROW(ListJobs(w.services, {{"subject", "sub"}}), InputError);
  EXPECT_THROW(ListJobs(w.services, {{"", "5"}}), InputError);
}

}  // namespace
}  // namespace kvx
