// glTF by tinygltf; STL is fifty bytes a triangle after a header.
#include "pipeline/io/surface_file.h"

#include <tiny_gltf.h>

#include <cstring>
#include <sstream>

#include "core/errors.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"

namespace kvx {
namespace {

// x to the left stays, superior becomes up, anterior looks at the viewer.
const std::vector<double> kGltfFromLps{0.001, 0,     0, 0, 0, 0, -0.001, 0,
                                       0,     0.001, 0, 0, 0, 0, 0,      1};  // column-major

template <class T>
int AddView(tinygltf::Model& model, const std::vector<T>& values, int target) {
  std::vector<unsigned char>& bytes = model.buffers[0].data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = bytes.size();
  view.byteLength = values.size() * sizeof(T);
  view.target = target;
  bytes.resize(bytes.size() + view.byteLength);
  std::memcpy(bytes.data() + view.byteOffset, values.data(), view.byteLength);
  model.bufferViews.push_back(view);
  return int(model.bufferViews.size()) - 1;
}

int AddVectors(tinygltf::Model& model, const std::vector<Eigen::Vector3f>& values) {
  tinygltf::Accessor accessor;
  accessor.bufferView = AddView(model, values, TINYGLTF_TARGET_ARRAY_BUFFER);
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.type = TINYGLTF_TYPE_VEC3;
  accessor.count = values.size();
  Eigen::Vector3f lo = values[0], hi = values[0];
  for (const Eigen::Vector3f& v : values) lo = lo.cwiseMin(v), hi = hi.cwiseMax(v);
  accessor.minValues = {lo.x(), lo.y(), lo.z()};
  accessor.maxValues = {hi.x(), hi.y(), hi.z()};
  model.accessors.push_back(accessor);
  return int(model.accessors.size()) - 1;
}

int AddTriangles(tinygltf::Model& model, const TriangleMesh& mesh) {
  tinygltf::Accessor accessor;
  accessor.bufferView = AddView(model, mesh.triangles, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  accessor.type = TINYGLTF_TYPE_SCALAR;
  accessor.count = mesh.triangles.size() * 3;
  model.accessors.push_back(accessor);
  return int(model.accessors.size()) - 1;
}

tinygltf::Material Material(const std::string& name, const std::vector<double>& colour) {
  tinygltf::Material material;
  material.name = name;
  material.pbrMetallicRoughness.baseColorFactor = colour;
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 0.6;
  if (colour[3] < 1) material.alphaMode = "BLEND";
  return material;
}

void AddSurface(tinygltf::Model& model, const NamedSurface& surface) {
  tinygltf::Node node;
  node.name = surface.name;
  const Eigen::Matrix4d& m = surface.scan_from_mesh;
  node.matrix.assign(m.data(), m.data() + 16);  // both are column-major
  if (!surface.mesh.triangles.empty()) {
    tinygltf::Primitive primitive;
    primitive.attributes["POSITION"] = AddVectors(model, surface.mesh.vertices_mm);
    primitive.attributes["NORMAL"] = AddVectors(model, VertexNormals(surface.mesh));
    primitive.indices = AddTriangles(model, surface.mesh);
    primitive.material = surface.is_skin ? 1 : 0;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    tinygltf::Mesh mesh;
    mesh.name = surface.name;
    mesh.primitives.push_back(primitive);
    node.mesh = int(model.meshes.size());
    model.meshes.push_back(mesh);
  }
  model.nodes[0].children.push_back(int(model.nodes.size()));
  model.nodes.push_back(node);
}

void Append(std::string& bytes, const Eigen::Vector3f& v) {
  bytes.append(reinterpret_cast<const char*>(v.data()), 12);
}

}  // namespace

std::string GlbBytes(const std::vector<NamedSurface>& surfaces) {
  tinygltf::Model model;
  model.asset.version = "2.0";
  model.asset.generator = "kinevox";
  model.buffers.emplace_back();
  model.materials = {Material("bone", {0.89, 0.85, 0.76, 1.0}), Material("skin", {0.85, 0.62, 0.52, 0.35})};
  tinygltf::Node root;
  root.name = "lps_mm";
  root.matrix = kGltfFromLps;
  model.nodes.push_back(root);
  for (const NamedSurface& surface : surfaces) AddSurface(model, surface);
  if (model.buffers[0].data.empty())
    throw InputError("there is no surface here: no bone of this name has voxels");
  tinygltf::Scene scene;
  scene.nodes = {0};
  model.scenes.push_back(scene);
  model.defaultScene = 0;
  std::ostringstream out;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, out, false, true))
    throw Unavailable("the surfaces cannot be written as glTF");
  return std::move(out).str();
}

std::string StlBytes(const std::vector<NamedSurface>& surfaces) {
  std::string bytes = "kinevox, LPS mm";
  bytes.resize(80, ' ');
  uint32_t count = 0;
  for (const NamedSurface& surface : surfaces) count += uint32_t(surface.mesh.triangles.size());
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const NamedSurface& surface : surfaces) {
    const Eigen::Matrix4f move = surface.scan_from_mesh.cast<float>();
    for (const auto& triangle : surface.mesh.triangles) {
      Eigen::Vector3f corner[3];
      for (size_t c = 0; c < 3; ++c)
        corner[c] =
            move.topLeftCorner<3, 3>() * surface.mesh.vertices_mm[triangle[c]] + move.topRightCorner<3, 1>();
      Append(bytes, (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized());
      for (const Eigen::Vector3f& place : corner) Append(bytes, place);
      bytes.append(2, '\0');
    }
  }
  return bytes;
}

void WriteSurfaces(const std::filesystem::path& path, const std::vector<NamedSurface>& surfaces) {
  if (HasExtension(path, ".glb")) return WriteFileAtomically(path, GlbBytes(surfaces));
  if (HasExtension(path, ".stl")) return WriteFileAtomically(path, StlBytes(surfaces));
  throw InputError("a surface is written as .glb or .stl: the extension chooses the format");
}

}  // namespace kvx
