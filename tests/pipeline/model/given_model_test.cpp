// A model that says what no build would is refused, or does without the part that is wrong.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <map>

#include "pipeline/posing/cut_bricks.h"
#include "tests/support/built_hinge.h"

namespace kvx {
namespace {

using testing_support::BuiltHinge;
using testing_support::ScratchFolder;
using testing_support::SharedBackend;

// A model's folder from somebody else: every part is whole by its own digest, and says what no build would.
class GivenModel : public BuiltHinge {
 protected:
  GivenModel() { std::filesystem::copy(ModelPath(), folder_, std::filesystem::copy_options::recursive); }
  // Everything that a model can be asked for.
  void UseAll() const {
    const Model model = Model::Load(folder_);
    model.weights();
    model.LoadExample(0);
    model.LoadRegistered(0);
    model.MakeEngine(SharedBackend());
  }
  template <class T>
  void Change(const Digest& key, const std::function<void(T&)>& change) {
    T value = **FindArtifact<T>(cache_, key);
    change(value);
    cache_.Write(key, BytesOf(value).view());
  }
  void ExpectRefused(const std::string& what) {
    EXPECT_THROW(UseAll(), NotFound) << what;
    std::filesystem::remove_all(folder_);
    std::filesystem::copy(ModelPath(), folder_, std::filesystem::copy_options::recursive);
  }

  ScratchFolder given_;
  std::filesystem::path folder_ = given_.path() / "model";
  StageCache cache_{folder_ / "artifacts"};
};

TEST_F(GivenModel, SizesAreNotBelieved) {
  const ModelManifest& m = model_->manifest();
  const std::map<std::string, Digest> grids{{"template", m.template_key},
                                            {"body", m.body},
                                            {"weights", m.weights},
                                            {"example", m.scans[0].example},
                                            {"registered", m.scans[0].registered}};
  UseAll();
  for (const auto& [name, key] : grids) {
    for (const int size : {-7, 0, 1, 1000, std::numeric_limits<int>::max()}) {
      const auto bytes = cache_.Read(key);
      std::string changed(bytes->view());
      std::memcpy(changed.data() + sizeof size, &size, sizeof size);  // along j
      cache_.Write(key, changed);
      ExpectRefused(name + " of " + std::to_string(size));
    }
  }
}

TEST_F(GivenModel, PartsOfAnotherModelAreRefused) {
  const ModelManifest& m = model_->manifest();
  Change<Mask>(m.body, [](Mask& body) {
    body.grid.size.x() -= 1;
    body.values.resize(body.grid.VoxelCount());
  });
  ExpectRefused("a smaller body");
  Change<BoneSet>(m.bones, [](BoneSet& bones) { bones.bones[1].parent = 7; });
  ExpectRefused("a parent that is not there");
  Change<SkeletonFit>(m.skeleton, [](SkeletonFit& fit) { fit.skeleton.joints[1].parent = 1; });
  ExpectRefused("a joint that is its own parent");
  Change<SkeletonFit>(m.skeleton, [](SkeletonFit& fit) { fit.scan_angles.pop_back(); });
  ExpectRefused("angles of fewer scans");
  Change<BoneFits>(m.scans[0].fits, [](BoneFits& fits) { fits.pop_back(); });
  ExpectRefused("fits of fewer bones");
  Change<WeightMap>(m.weights, [](WeightMap& weights) { weights.values[5].bones[0] = 200; });
  ExpectRefused("weights of a bone that is not there");
}

TEST_F(GivenModel, PosesWithoutBricksThatAreOutOfOrder) {
  const Digest key = *model_->manifest().bricks;
  const std::vector<std::function<void(BrickedBody&)>> changes{
      [](BrickedBody& b) { b.bricks.x() = 5000; },
      [](BrickedBody& b) { b.brick_at[0] = 1 << 30; },
      [](BrickedBody& b) { b.cell_bricks = b.stored(); },
      [](BrickedBody& b) { b.first_nodes[0].s[0] += 4; },
      [](BrickedBody& b) { b.palette_first[1] = 1 << 30; },
      [](BrickedBody& b) { b.palette[0] = 200; },
      [](BrickedBody& b) { b.example_refs.at(0).k = 100; },
      [](BrickedBody& b) { b.weights.pop_back(); },
  };
  const ResolvedPose pose = model_->Resolve(ScanPose{model_->scan_names()[0]}, DeformationMode::kEvd);
  const std::vector<PointMm> points{model_->bones().bones[0].centroid, model_->bones().bones[1].centroid};
  const auto expected = model_->MakeEngine(SharedBackend())->MapPoints(pose, points);
  for (size_t n = 0; n < changes.size(); ++n) {
    Change<BrickedBody>(key, changes[n]);
    const auto posed = Model::Load(folder_).MakeEngine(SharedBackend())->MapPoints(pose, points);
    for (size_t p = 0; p < points.size(); ++p)
      EXPECT_LT((posed[p].lps - expected[p].lps).norm(), 1e-9) << "change " << n;
    cache_.Write(key, StageCache(ModelPath() / "artifacts").Read(key)->view());
  }
}

}  // namespace
}  // namespace kvx
