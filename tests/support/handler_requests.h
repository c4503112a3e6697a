// Requests of handlers as the tests make them, over a service world.
#pragma once
#include <nlohmann/json.hpp>

#include "tests/support/refusal.h"
#include "tests/support/service_world.h"

namespace kvx::testing_support {

// A field of a JSON object that is a text.
inline std::string Field(const std::string& json, const std::string& field) {
  return Json::parse(json)[field];
}

inline Answer SendScan(ServiceWorld& w, const std::string& subject, const std::string& name,
                       const std::string& bytes, const std::string& key = "",
                       const std::string& filename = "a.nii.gz") {
  Upload upload = Upload::OfScan(w.services, subject, {{"name", name}, {"filename", filename}}, key);
  upload.Write(bytes);
  return upload.Finish();
}

inline std::string NewSubjectId(ServiceWorld& w) {
  return Field(CreateSubject(w.services, R"({"region":"knee"})", "").body, "id");
}

// With pose00, pose01 and bones of pose00.
inline std::string SubjectWithScans(ServiceWorld& w) {
  const std::string subject = NewSubjectId(w);
  SendScan(w, subject, "pose00", "VOXELS0");
  SendScan(w, subject, "pose01", "VOXELS1");
  Upload bones = Upload::OfBones(w.services, subject, {{"template", "pose00"}}, "");
  bones.Write(std::string("VOXELSb"));
  bones.Finish();
  return subject;
}

inline std::string BuiltModel(ServiceWorld& w) {
  const std::string subject = SubjectWithScans(w);
  const Answer answer =
      CreateModel(w.services, R"({"subject":")" + subject + R"(","template":"pose00"})", "");
  const std::string model = Field(answer.body, "id");
  w.jobs.Succeed(*w.jobs.Claim("w"), "{}", [&] { w.catalogue.SetModelDigest(model, "d1"); });
  return model;
}

}  // namespace kvx::testing_support
