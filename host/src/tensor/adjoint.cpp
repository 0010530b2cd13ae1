// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/adjoint.hpp"

#include <string>
#include <vector>

namespace symrig {

Result<Image<float>> apply_adjoint(const TransportTensor& tensor, const Image<float>& picture) {
  if (picture.grid() != tensor.camera_grid() || picture.channels() != tensor.channels())
    return Error{ErrorCode::size_mismatch,
                 "the picture is " + to_string(picture.grid()) + " with " +
                     std::to_string(picture.channels()) + " channels, the camera " +
                     to_string(tensor.camera_grid()) + " with " + std::to_string(tensor.channels()),
                 "give a picture of the size of the scene's photographs"};
  std::vector<float> y(picture.plane(0).size()), p(tensor.projector_grid().size());
  for (int channel = 0; channel < tensor.channels(); ++channel) {
    tensor.camera_tree().to_tree(picture.plane(channel), y);
    SYMRIG_CHECK(tensor.add_tree(y, p, channel, true));
  }
  Image<float> light(tensor.projector_grid());
  tensor.projector_tree().to_raster(p, light.plane(0));
  return light;
}

Result<Image<float>> TransportTensor::adjoint(const Image<float>& picture) const {
  return apply_adjoint(*this, picture);
}

}  // namespace symrig
