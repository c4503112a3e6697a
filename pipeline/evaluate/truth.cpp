// Reading a phantom's manifest and points: RAS comes in, LPS goes out.
#include "pipeline/evaluate/truth.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "pipeline/io/npz_file.h"

namespace kvx {
namespace {

using Json = nlohmann::json;

constexpr double kStill = 1e-6;  // rad and mm, together

PointMm FromRas(double x, double y, double z) { return {Eigen::Vector3d(-x, -y, z)}; }

// F T F with F = diag(-1, -1, 1, 1): the same motion seen in LPS.
RigidTransform FromRas(const Json& rows) {
  constexpr std::array<double, 4> kFlip{-1, -1, 1, 1};
  std::array<double, 16> matrix{};
  for (size_t row = 0; row < 4; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      matrix[4 * row + column] = kFlip[row] * kFlip[column] * rows.at(row).at(column).get<double>();
    }
  }
  return RigidFromRowMajor(matrix);
}

std::string ScanName(const std::string& file) {
  const std::string name = std::filesystem::path(file).filename().string();
  return name.substr(0, name.find('.'));
}

Truth FromManifest(const Json& manifest, const std::filesystem::path& folder) {
  Truth truth;
  if (manifest.contains("tissues")) truth.tissues = manifest.at("tissues").get<std::vector<std::string>>();
  std::vector<std::string> bones;
  for (const Json& bone : manifest.at("bones")) {
    bones.push_back(bone.at("name"));
    const Json& c = bone.at("centroid");
    truth.bone_centroids[bones.back()] = FromRas(c.at(0), c.at(1), c.at(2));
  }
  const auto add = [&](const Json& pose, bool bent_for_a_pair) {
    TruthPose out{
        ScanName(pose.at("file")), {}, folder / pose.at("points").get<std::string>(), bent_for_a_pair};
    for (size_t j = 0; j < bones.size(); ++j) out.scan_from_template[bones[j]] = FromRas(pose.at("T").at(j));
    truth.poses.push_back(std::move(out));
  };
  for (const Json& pose : manifest.at("poses")) add(pose, false);
  const Json bent = manifest.value("bend10", Json::object());
  for (const Json& pose : bent) add(pose, true);
  return truth;
}

std::vector<PointMm> PointsNamed(const NpyArrays& arrays, const std::string& name) {
  const std::vector<double> values = AsDoubles(ArrayNamed(arrays, name));
  std::vector<PointMm> points(values.size() / 3);
  for (size_t i = 0; i < points.size(); ++i)
    points[i] = FromRas(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
  return points;
}

template <class T>
std::vector<T> ValuesNamed(const NpyArrays& arrays, const std::string& name, size_t count) {
  const std::vector<double> values = AsDoubles(ArrayNamed(arrays, name));
  if (values.size() != count) throw InputError("the truth's arrays do not have the same number of points");
  return std::vector<T>(values.begin(), values.end());
}

const TruthPose* PoseNamed(const Truth& truth, const std::string& name) {
  const auto found = std::ranges::find(truth.poses, name, &TruthPose::name);
  return found == truth.poses.end() ? nullptr : &*found;
}

// No bone has moved.
bool IsTemplate(const TruthPose& pose) {
  return std::ranges::all_of(pose.scan_from_template,
                             [](const auto& bone) { return Log(bone.second).norm() < kStill; });
}

}  // namespace

MatchedNames MatchNames(const Truth& truth, const std::string& template_scan,
                        const std::vector<std::string>& scans) {
  const TruthPose* const pose = PoseNamed(truth, template_scan);
  if (pose && !IsTemplate(*pose)) {
    throw InputError("the truth tells where the bones of another template moved to than '" + template_scan +
                     "'; build the model with the phantom's own template");
  }
  MatchedNames out;
  std::vector<std::string> seen = scans;
  seen.push_back(template_scan);
  for (const std::string& scan : seen)
    if (!PoseNamed(truth, scan)) out.without_truth.push_back(scan);
  for (size_t p = 0; p < truth.poses.size() && out.without_truth.empty(); ++p) {
    const TruthPose& of_truth = truth.poses[p];
    if (!of_truth.bent_for_a_pair && std::ranges::find(seen, of_truth.name) == seen.end())
      out.unseen.push_back(p);
  }
  return out;
}

Truth ReadTruth(const std::filesystem::path& folder) {
  std::ifstream file(folder / "manifest.json", std::ios::binary);
  if (!file)
    throw NotFound("the truth folder holds no manifest.json; give a folder made by 'kinevox phantom'");
  try {
    return FromManifest(Json::parse(file), folder);
  } catch (const Json::exception&) {
    throw InputError("the manifest.json of the truth folder is not one of a phantom");
  }
}

TruthPoints ReadTruthPoints(const TruthPose& pose) {
  const NpyArrays arrays = ReadNpz(pose.points);
  TruthPoints out;
  out.in_template = PointsNamed(arrays, "template");
  out.in_scan = PointsNamed(arrays, "position");
  const size_t count = out.in_template.size();
  if (out.in_scan.size() != count)
    throw InputError("the truth's arrays do not have the same number of points");
  out.tissue = ValuesNamed<uint8_t>(arrays, "tissue", count);
  out.bone = ValuesNamed<uint8_t>(arrays, "bone", count);
  out.joint_distance_mm = ValuesNamed<float>(arrays, "dist_joint", count);
  out.counts = ValuesNamed<uint8_t>(arrays, "in_fov", count);
  const auto hidden = ValuesNamed<uint8_t>(arrays, "hidden", count);
  for (size_t i = 0; i < count; ++i) out.counts[i] = out.counts[i] && !hidden[i];
  return out;
}

}  // namespace kvx
