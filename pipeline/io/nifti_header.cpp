// Field offsets are those of nifti1.h and nifti2.h.
#include "pipeline/io/nifti_header.h"

#include <cmath>
#include <cstring>
#include <optional>

#include "core/errors.h"

namespace kvx {
namespace {

const char kNotNifti[] =
    "the file is not a readable NIfTI volume; check that it was copied whole and has the right extension";
const char kBadHeader[] = "the volume's header is damaged; convert the original images to NIfTI again";

class HeaderBytes {
 public:
  HeaderBytes(std::string_view bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}
  template <class T>
  T Get(size_t offset) const {
    char raw[sizeof(T)];
    if (offset + sizeof(T) > bytes_.size()) throw InputError(kNotNifti);
    std::memcpy(raw, bytes_.data() + offset, sizeof(T));
    if (swapped_) SwapBytes(raw, sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }

 private:
  std::string_view bytes_;
  bool swapped_;
};

// The two versions in one shape.
struct Fields {
  int64_t dim[8];
  double pixdim[8], vox_offset, slope, inter, quatern[3], qoffset[3], srow[12];
  int datatype, qform_code, sform_code, units;
};

Fields ReadVersion1(const HeaderBytes& in) {
  Fields f;
  for (int d = 0; d < 8; ++d) f.dim[d] = in.Get<int16_t>(40 + 2 * d), f.pixdim[d] = in.Get<float>(76 + 4 * d);
  f.datatype = in.Get<int16_t>(70);
  f.vox_offset = in.Get<float>(108), f.slope = in.Get<float>(112), f.inter = in.Get<float>(116);
  f.units = in.Get<uint8_t>(123);
  f.qform_code = in.Get<int16_t>(252), f.sform_code = in.Get<int16_t>(254);
  for (int a = 0; a < 3; ++a)
    f.quatern[a] = in.Get<float>(256 + 4 * a), f.qoffset[a] = in.Get<float>(268 + 4 * a);
  for (int a = 0; a < 12; ++a) f.srow[a] = in.Get<float>(280 + 4 * a);
  return f;
}

Fields ReadVersion2(const HeaderBytes& in) {
  Fields f;
  for (int d = 0; d < 8; ++d)
    f.dim[d] = in.Get<int64_t>(16 + 8 * d), f.pixdim[d] = in.Get<double>(104 + 8 * d);
  f.datatype = in.Get<int16_t>(12);
  f.vox_offset = double(in.Get<int64_t>(168)), f.slope = in.Get<double>(176), f.inter = in.Get<double>(184);
  f.units = in.Get<int32_t>(500);
  f.qform_code = in.Get<int32_t>(344), f.sform_code = in.Get<int32_t>(348);
  for (int a = 0; a < 3; ++a)
    f.quatern[a] = in.Get<double>(352 + 8 * a), f.qoffset[a] = in.Get<double>(376 + 8 * a);
  for (int a = 0; a < 12; ++a) f.srow[a] = in.Get<double>(400 + 8 * a);
  return f;
}

void RequireMagic(std::string_view bytes, bool version2) {
  const std::string_view magic = bytes.substr(std::min(bytes.size(), size_t(version2 ? 4 : 344)), 4);
  if (magic == std::string_view(version2 ? "n+2\0" : "n+1\0", 4)) return;
  if (magic.starts_with("ni"))
    throw InputError("the file is one half of a NIfTI pair; save it as a single .nii or .nii.gz file");
  throw InputError(
      "the file is an Analyze image or not NIfTI at all; save it as a single .nii or .nii.gz file");
}

VoxelType TypeOf(int datatype) {
  switch (datatype) {
    case 2:
      return VoxelType::kUint8;
    case 4:
      return VoxelType::kInt16;
    case 8:
      return VoxelType::kInt32;
    case 16:
      return VoxelType::kFloat32;
    case 64:
      return VoxelType::kFloat64;
    case 256:
      return VoxelType::kInt8;
    case 512:
      return VoxelType::kUint16;
    case 768:
      return VoxelType::kUint32;
    case 1024:
      return VoxelType::kInt64;
    case 1280:
      return VoxelType::kUint64;
    case 32:
    case 1792:
    case 2048:
      throw InputError("the volume holds complex numbers; save its magnitude instead");
    case 128:
    case 2304:
      throw InputError("the volume holds colours; save it with one grey value per voxel");
    default:
      throw InputError("the volume's voxel type is not supported; save it as integers or as 32-bit floats");
  }
}

Eigen::Vector3i SizeOf(const Fields& f) {
  if (f.dim[0] < 1 || f.dim[0] > 7) throw InputError(kBadHeader);
  for (int d = 1; d <= f.dim[0]; ++d) {
    if (f.dim[d] < (d <= 3 ? 1 : 0))
      throw InputError("the volume's header gives a size that is not positive");
    if (f.dim[d] > 2147483647)
      throw InputError("the volume's header gives a size beyond all measure; it is damaged");
  }
  if (f.dim[0] < 3) throw InputError("the file holds a 2-D image; give a 3-D volume");
  for (int d = 5; d <= f.dim[0]; ++d) {
    if (f.dim[d] > 1)
      throw InputError("the file holds several values per voxel; save it with one grey value per voxel");
  }
  if (f.dim[0] >= 4 && f.dim[4] > 1) {
    throw InputError("the file holds " + std::to_string(f.dim[4]) +
                     " frames; save the one you mean as a 3-D volume");
  }
  return {int(f.dim[1]), int(f.dim[2]), int(f.dim[3])};
}

using Affine = Eigen::Matrix<double, 3, 4>;  // RAS mm from voxels

Affine SForm(const Fields& f) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(f.srow);
}

Eigen::Vector3d PixelSpacing(const Fields& f) {
  const Eigen::Vector3d spacing(f.pixdim[1], f.pixdim[2], f.pixdim[3]);
  if (!spacing.allFinite() || !(spacing.array() > 0).all()) {
    throw InputError(
        "the volume's header gives a voxel spacing that is not a positive number; correct the header");
  }
  return spacing;
}

Affine QForm(const Fields& f) {
  const Eigen::Vector3d q(f.quatern[0], f.quatern[1], f.quatern[2]);
  if (!q.allFinite() || q.squaredNorm() > 1.001) throw InputError(kBadHeader);
  const double w = std::sqrt(std::max(0.0, 1.0 - q.squaredNorm()));
  Affine affine;
  affine.leftCols<3>() = Eigen::Quaterniond(w, q.x(), q.y(), q.z()).normalized().toRotationMatrix() *
                         PixelSpacing(f).asDiagonal();
  if (f.pixdim[0] < 0) affine.col(2) *= -1;  // qfac
  affine.col(3) << f.qoffset[0], f.qoffset[1], f.qoffset[2];
  return affine;
}

bool IsRectangular(const Affine& affine) {
  Eigen::Matrix3d axes = affine.leftCols<3>();
  for (int a = 0; a < 3; ++a) {
    const double length = axes.col(a).norm();
    if (!(length > 0) || !std::isfinite(length)) {
      throw InputError(
          "the volume's header gives a voxel spacing that is not a positive number; correct the header");
    }
    axes.col(a) /= length;
  }
  return (axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3;
}

// Both place the corners of the grid within a tenth of a voxel of each other.
bool PlacesAlike(const Affine& a, const Affine& b, const Eigen::Vector3i& size) {
  const double tolerance_mm = 0.1 * b.leftCols<3>().colwise().norm().minCoeff();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d at((corner & 1) * (size.x() - 1), (corner >> 1 & 1) * (size.y() - 1),
                             (corner >> 2) * (size.z() - 1));
    const Affine difference = a - b;
    if ((difference.leftCols<3>() * at + difference.col(3)).norm() > tolerance_mm) return false;
  }
  return true;
}

// The sform where there is one, then the qform, then the bare spacing (NIfTI's method 1).
Affine RasFromVox(const Fields& f, const Eigen::Vector3i& size) {
  if (f.sform_code > 0) {
    const Affine sform = SForm(f);
    if (!sform.allFinite()) throw InputError(kBadHeader);
    if (IsRectangular(sform)) return sform;
    if (f.qform_code > 0) {
      const Affine qform = QForm(f);
      if (PlacesAlike(sform, qform, size)) return qform;
    }
    throw InputError(
        "the volume's axes are sheared (its sform is not rectangular); resample it onto a rectangular grid");
  }
  if (f.qform_code > 0) return QForm(f);
  Affine affine = Affine::Zero();
  affine.leftCols<3>() = PixelSpacing(f).asDiagonal();
  return affine;
}

double MmPerUnit(int units) {
  switch (units & 7) {
    case 1:
      return 1000;  // metres
    case 3:
      return 0.001;  // micrometres
    default:
      return 1;
  }
}

Grid GridOf(const Fields& f) {
  Grid grid;
  grid.size = SizeOf(f);
  Affine affine = RasFromVox(f, grid.size) * MmPerUnit(f.units);
  if (!affine.allFinite()) throw InputError(kBadHeader);
  affine.topRows<2>() *= -1;  // RAS to LPS
  grid.spacing_mm = affine.leftCols<3>().colwise().norm();
  const Eigen::Matrix3d axes = affine.leftCols<3>() * grid.spacing_mm.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  grid.direction = svd.matrixU() * svd.matrixV().transpose();  // the nearest orthonormal axes
  grid.origin.lps = affine.col(3);
  return grid;
}

Rescale RescaleOf(const Fields& f) {
  if (!std::isfinite(f.slope) || f.slope == 0) return {};  // "do not scale", by the standard
  return {f.slope, std::isfinite(f.inter) ? f.inter : 0.0};
}

// Swapped or not and which version, by the header's own size field.
std::optional<std::pair<bool, bool>> SwappedAndVersion2(std::string_view bytes) {
  if (bytes.size() < 4) return std::nullopt;
  for (const bool swapped : {false, true}) {
    const int32_t size = HeaderBytes(bytes, swapped).Get<int32_t>(0);
    if (size == 348 || size == 540) return std::pair(swapped, size == 540);
  }
  return std::nullopt;
}

}  // namespace

NiftiHeader ParseNiftiHeader(std::string_view bytes) {
  const auto kind = SwappedAndVersion2(bytes);
  if (!kind) throw InputError(kNotNifti);
  const auto [swapped, version2] = *kind;
  RequireMagic(bytes, version2);
  const HeaderBytes in(bytes, swapped);
  const Fields f = version2 ? ReadVersion2(in) : ReadVersion1(in);
  NiftiHeader header;
  header.swapped = swapped;
  header.type = TypeOf(f.datatype);
  header.grid = GridOf(f);
  header.rescale = RescaleOf(f);
  const double least = version2 ? 544 : 352;
  const double offset = f.vox_offset == 0 ? least : f.vox_offset;
  if (!(offset >= least && offset < 1e9)) throw InputError(kBadHeader);
  header.voxel_offset = size_t(offset);
  return header;
}

}  // namespace kvx
