// The only file of the benchmarks that includes ITK.
#include "tests/bench/itk_warp.h"

#include <itkImage.h>
#include <itkWarpImageFilter.h>

#include <algorithm>

namespace kvx {
namespace {

using Image3 = itk::Image<float, 3>;
using Field3 = itk::Image<itk::Vector<float, 3>, 3>;

template <class Target>
typename Target::Pointer ImageOn(const Grid& grid) {
  const auto image = Target::New();
  typename Target::SizeType size;
  typename Target::PointType origin;
  typename Target::SpacingType spacing;
  typename Target::DirectionType direction;
  for (unsigned a = 0; a < 3; ++a) {
    size[a] = itk::SizeValueType(grid.size[int(a)]);
    origin[a] = grid.origin.lps[int(a)], spacing[a] = grid.spacing_mm[int(a)];
    for (unsigned b = 0; b < 3; ++b) direction[a][b] = grid.direction(int(a), int(b));
  }
  image->SetRegions(size), image->SetOrigin(origin), image->SetSpacing(spacing);
  image->SetDirection(direction);
  image->Allocate();
  return image;
}

}  // namespace

struct ItkWarp::State {
  itk::WarpImageFilter<Image3, Image3, Field3>::Pointer filter =
      itk::WarpImageFilter<Image3, Image3, Field3>::New();
};

ItkWarp::ItkWarp(const Volume& volume, const DisplacementField& template_from_posed, int threads)
    : state_(std::make_unique<State>()) {
  const auto image = ImageOn<Image3>(volume.grid);
  std::copy(volume.values.begin(), volume.values.end(), image->GetBufferPointer());
  const auto field = ImageOn<Field3>(template_from_posed.grid);
  for (size_t v = 0; v < template_from_posed.values.size(); ++v) {
    const Eigen::Vector3f& d = template_from_posed.values[v];
    for (unsigned a = 0; a < 3; ++a) field->GetBufferPointer()[v][a] = d[int(a)];
  }
  auto& filter = *state_->filter;
  filter.SetInput(image), filter.SetDisplacementField(field);
  filter.SetOutputParametersFromImage(field);
  filter.SetNumberOfWorkUnits(itk::ThreadIdType(threads));
}

ItkWarp::~ItkWarp() = default;

float ItkWarp::Run() {
  state_->filter->Modified();
  state_->filter->Update();
  return state_->filter->GetOutput()->GetBufferPointer()[0];
}

}  // namespace kvx
