// Surfaces as files that viewers and printers read: binary glTF and STL.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/triangle_mesh.h"

namespace kvx {

// One node per surface, named, under a root that turns LPS millimetres into glTF's metres with y up: a bone's
// node carries its motion (scan_from_mesh), so a viewer can move bones without new vertices.
// The skin is translucent.
std::string GlbBytes(const std::vector<NamedSurface>& surfaces);
// All surfaces in one binary STL, moved to where they stand, LPS mm. The skin and bones are separate shells.
std::string StlBytes(const std::vector<NamedSurface>& surfaces);

// By extension, .glb or .stl; throws InputError for another, Unavailable when it cannot be written.
void WriteSurfaces(const std::filesystem::path& path, const std::vector<NamedSurface>& surfaces);

}  // namespace kvx
