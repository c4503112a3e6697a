// The contract's own example, and one broken field at a time: the message must name it.
#include "pipeline/model/files/study_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using nlohmann::json;
using testing::HasSubstr;

class StudyFile : public testing::Test {
 protected:
  StudyFile() {
    for (const char* name : {"pose00.nii.gz", "bones.nii.gz"}) std::ofstream(folder_.path() / name) << "x";
    std::filesystem::create_directories(folder_.path() / "dicom/pose01");
  }
  Study Parse(const json& document) const { return ParseStudy(document.dump(), folder_.path()); }
  std::string Complaint(const json& document) const {
    try {
      Parse(document);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no complaint";
  }
  static json Good() {
    return json::parse(R"({
      "name": "knee-a", "region": "knee", "template": "pose00",
      "scans": [{"name": "pose00", "volume": "pose00.nii.gz"}, {"name": "pose01", "volume": "dicom/pose01/"}],
      "bones": {"labels": "bones.nii.gz",
                "list": [{"label": 1, "name": "femur", "parent": null}, {"label": 2, "name": "tibia", "parent": "femur"}]},
      "joints": [{"child": "tibia", "dofs": ["flexion"]}],
      "initial_poses": {"pose01": {"tibia": [0,-1,0,5, 1,0,0,6, 0,0,1,7, 0,0,0,1]}}})");
  }

  ScratchFolder folder_;
};

TEST_F(StudyFile, TheContractsExampleIsUnderstood) {
  const Study study = Parse(Good());
  EXPECT_EQ(study.name, "knee-a");
  EXPECT_EQ(study.region, Region::kKnee);
  EXPECT_EQ(study.template_scan, "pose00");
  ASSERT_EQ(study.scans.size(), 2u);
  EXPECT_EQ(study.scans[0].volume, folder_.path() / "pose00.nii.gz");
  EXPECT_TRUE(std::filesystem::is_directory(study.scans[1].volume));
  EXPECT_EQ(study.bone_labels, folder_.path() / "bones.nii.gz");
  ASSERT_EQ(study.bones.size(), 2u);
  EXPECT_EQ(study.bones[0].parent, "");
  EXPECT_EQ(study.bones[1].parent, "femur");
  EXPECT_EQ(study.joints.at(0).dofs.at(0), "flexion");
  const PointMm moved = study.initial_poses.at("pose01").at("tibia") * PointMm{{1, 2, 3}};
  EXPECT_LT((moved.lps - Eigen::Vector3d(3, 7, 10)).norm(), 1e-12);
}

TEST_F(StudyFile, FieldsThatNobodyReadsAreNoted) {
  EXPECT_TRUE(Parse(Good()).unread_fields.empty());
  json study = Good();
  study["initial_pose"] = json::object(), study["bones"]["label"] = 1, study["a b"] = 1;
  EXPECT_THAT(Parse(study).unread_fields, testing::UnorderedElementsAre("initial_pose", "bones.label"));
}

TEST_F(StudyFile, FieldsThatNobodyReadsAreNotedInEveryItemOfAList) {
  json study = Good();
  study["scans"][1]["patient"] = "secret", study["scans"][0]["not a name"] = "secret";
  study["bones"]["list"][1]["parnet"] = "femur";
  study["joints"][0]["dof"] = 1;
  EXPECT_THAT(Parse(study).unread_fields,
              testing::ElementsAre("scans[1].patient", "bones.list[1].parnet", "joints[0].dof"));
}

TEST_F(StudyFile, AListOfBonesMayBeACopyOfWhatTheProgramSaysOfThem) {
  json study = Good();
  study["bones"]["list"][0].update(
      json::parse(R"({"confidence": 0.9, "looks_like": "tibia", "voxels": 7, "cm3": 0.2, "centre": [1,2,3],)"
                  R"("expected_dice": 0.8})"));
  study["bones"]["list"][1].update(json::parse(R"({"voxels": 7, "centroid": [1,2,3], "obb": {}})"));
  EXPECT_THAT(Parse(study).unread_fields, testing::IsEmpty());
}

TEST_F(StudyFile, DegreesOfFreedomMayBeCounted) {
  json study = Good();
  for (const size_t count : {0, 1, 3, 6}) {
    study["joints"][0]["dofs"] = count;
    const std::vector<std::string> dofs = Parse(study).joints.at(0).dofs;
    ASSERT_EQ(dofs.size(), count);
    if (count > 0) {
      EXPECT_EQ(dofs[0], "flexion");
    }
    if (count == 6) {
      EXPECT_EQ(dofs[5], "rotation_shift");
    }
  }
}

TEST_F(StudyFile, BonesMayBeAFolderOfMasksNamedAfterThem) {
  for (const char* mask : {"femur.nii.gz", "fibula.nrrd", "tibia.mha", "liver.nii.gz"})
    std::ofstream(folder_.path() / "dicom/pose01" / mask) << "a mask";
  json document = Good();
  document["bones"] = {{"labels", "dicom/pose01"}};
  const Study preset = Parse(document);
  ASSERT_EQ(preset.bones.size(), 3u);  // no patella
  EXPECT_EQ(preset.bones[2].name, "fibula");
  EXPECT_EQ(preset.bones[2].label, 3);
  EXPECT_EQ(preset.bones[2].parent, "tibia");

  document["bones"]["list"] = json::parse(R"([{"name": "tibia"}, {"name": "fibula", "parent": "tibia"}])");
  document["joints"][0]["child"] = "fibula";
  document["initial_poses"] = json::object();
  const Study listed = Parse(document);
  ASSERT_EQ(listed.bones.size(), 2u);
  EXPECT_EQ(listed.bones[0].label, 1);
  EXPECT_EQ(listed.bones[1].label, 2);

  document["bones"]["list"][0]["label"] = 2;
  EXPECT_THAT(Complaint(document), HasSubstr("bones.list[1].label is used twice"));

  std::filesystem::remove(folder_.path() / "dicom/pose01/femur.nii.gz");
  std::filesystem::remove(folder_.path() / "dicom/pose01/tibia.mha");
  std::filesystem::remove(folder_.path() / "dicom/pose01/fibula.nrrd");
  document["bones"].erase("list");
  EXPECT_THAT(Complaint(document), HasSubstr("without a mask of the region's root, femur"));
}

TEST_F(StudyFile, BonesMayBeAFolderWithADicomSegmentation) {
  WriteSegmentation(folder_.path() / "dicom/pose01/1.2.3.dcm", 1);
  json document = Good();
  document["bones"]["labels"] = "dicom/pose01";
  EXPECT_EQ(Parse(document).bones.size(), 2u);
  document["bones"]["list"][0].erase("label");
  EXPECT_THAT(Complaint(document), HasSubstr("bones.list[0].label is missing")) << "it holds numbers";
  document["bones"].erase("list");
  EXPECT_TRUE(Parse(document).bones.empty()) << "the preset's, as of every label map";

  for (const char* mask : {"femur.dcm", "tibia.dcm"})
    WriteSegmentation(folder_.path() / "dicom/pose01" / mask, 1);
  EXPECT_EQ(Parse(document).bones.size(), 2u) << "masks of the preset's bones";
}

TEST_F(StudyFile, WithoutAListThePresetsBonesAreMeant) {
  json study = Good();
  study["bones"].erase("list");
  EXPECT_TRUE(Parse(study).bones.empty());
  study["initial_poses"]["pose01"]["tib"] = study["initial_poses"]["pose01"]["tibia"];
  EXPECT_THAT(Complaint(study), HasSubstr("initial_poses.pose01.tib names a bone that is not in the region's "
                                          "preset (femur, tibia, fibula, patella)"));
  study["initial_poses"] = json::object();
  study["joints"][0]["child"] = "Tibia";
  EXPECT_THAT(Complaint(study), HasSubstr("joints[0].child names a bone that is not in the region's preset"));
  study["joints"][0]["child"] = "femur";
  EXPECT_THAT(Complaint(study), HasSubstr("joints[0].child names the root bone"));
  study["region"] = "custom";
  EXPECT_THAT(Complaint(study), HasSubstr("bones.list is missing"));
}

TEST_F(StudyFile, IsNamedInAnyScript) {
  json study = Good();
  study["name"] = "Kolano Ż. 3, прямо";
  EXPECT_EQ(Parse(study).name, "Kolano Ż. 3, прямо");
}

TEST_F(StudyFile, EveryComplaintNamesItsField) {
  struct Case {
    const char* pointer;
    json value;
    const char* complaint;
  };
  const std::vector<Case> cases{
      {"/name", nullptr, "name is missing"},
      {"/name", "", "name must be a text that is not empty"},
      {"/name", "two\nlines", "name must be one line"},
      {"/name", std::string(257, 'a'), "name must be one line of at most 256 bytes"},
      {"/region", "elbow", "region must be hand, knee or custom"},
      {"/region", 3, "region must be a text"},
      {"/template", "pose07", "template names a scan that is not in scans"},
      {"/scans", 5, "scans must be a list"},
      {"/scans", json::array(), "scans is empty"},
      {"/scans/1", "pose01", "scans[1] must be an object"},
      {"/scans/1/volume", nullptr, "scans[1].volume is missing"},
      {"/scans/1/volume", "gone.nii", "scans[1].volume names a file that does not exist"},
      {"/scans/1/name", "../x", "scans[1].name must be 1 to 64"},
      {"/scans/1/name", "pose00", "scans[1].name is used twice"},
      {"/bones", nullptr, "bones is missing"},
      {"/bones", json{{"seeds", "s.nii"}}, "bones.seeds names a file that does not exist"},
      {"/bones", json{{"threshold", "high"}}, "bones.threshold must be a level in HU, or \"auto\""},
      {"/bones", json{{"threshold", 300}, {"labels", "bones.nii.gz"}},
       "bones must hold exactly one of labels"},
      {"/bones/labels", nullptr, "bones.labels is missing"},
      {"/bones/labels", "dicom/pose01", "bones.list[0].name has no mask in the folder of bones.labels"},
      {"/bones/labels", "dicom/pose09", "bones.labels names a file that does not exist"},
      {"/bones/list/1/label", 1, "bones.list[1].label is used twice"},
      {"/bones/list/1/label", 2.5, "bones.list[1].label must be a whole number"},
      {"/bones/list/1/label", 0, "bones.list[1].label must be a whole number from 1"},
      {"/bones/list/1/name", "femur", "bones.list[1].name is used twice"},
      {"/bones/list/1/parent", "hip", "bones.list[1].parent names a bone that is not in the list"},
      {"/bones/list/1/parent", nullptr, "exactly one root"},
      {"/bones/list/0/parent", "tibia", "exactly one root"},
      {"/joints/0/child", "hip", "joints[0].child names a bone"},
      {"/joints/0/child", "femur", "joints[0].child names the root bone"},
      {"/joints/0/dofs", nullptr, "joints[0].dofs is missing"},
      {"/joints/0/dofs", json{"a", "a"}, "joints[0].dofs[1] is used twice"},
      {"/joints/0/dofs", json{"a", "b", "c", "d"}, "joints[0].dofs needs up to 3"},
      {"/joints/0/dofs", 4, "joints[0].dofs needs up to 3"},
      {"/joints/0/dofs", 2.5, "joints[0].dofs is not a number of degrees"},
      {"/initial_poses", json{{"pose09", json::object()}}, "initial_poses.pose09 names a scan"},
      {"/initial_poses/pose01", json{{"hip", json::array()}}, "initial_poses.pose01.hip names a bone"},
      {"/initial_poses/pose01/tibia", json{1, 2, 3}, "initial_poses.pose01.tibia must be 16 numbers"},
      {"/initial_poses/pose01/tibia/0", 2.0, "initial_poses.pose01.tibia must be 16 numbers"},
      {"/initial_poses/pose01/tibia/3", 1e9, "initial_poses.pose01.tibia moves the bone by more than a kilo"},
      {"/initial_poses/pose01/tibia/0", "x", "initial_poses.pose01.tibia must be 16 numbers"},
  };
  for (const Case& c : cases) {
    json study = Good();
    study[json::json_pointer(c.pointer)] = c.value;
    EXPECT_THAT(Complaint(study), HasSubstr(c.complaint)) << c.pointer << " = " << c.value;
  }
}

TEST_F(StudyFile, ParentsInACircleAreRefused) {
  json study = Good();
  study["bones"]["list"] = json::parse(R"([{"label":1,"name":"femur"},{"label":2,"name":"a","parent":"b"},
                                           {"label":3,"name":"b","parent":"a"}])");
  EXPECT_THAT(Complaint(study), HasSubstr("bones.list[1].parent leads in a circle"));
}

TEST_F(StudyFile, WhatIsNotJsonIsRefusedWithoutQuotingIt) {
  for (const char* text : {"", "{", "[1]", "nonsense secret", "{\"name\": \"\xff\"}"}) {
    try {
      ParseStudy(text, folder_.path());
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), Not(HasSubstr("secret")));
    }
  }
  EXPECT_THROW(ReadStudy(folder_.path() / "none.json"), InputError);
}

}  // namespace
}  // namespace kvx
