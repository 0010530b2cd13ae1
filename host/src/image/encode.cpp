// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/encode.hpp"

#include "image/codec.hpp"

namespace symrig {

Result<std::vector<std::byte>> encode_exr(const Image<float>& image) {
  if (image.empty() || (image.channels() != 1 && image.channels() != 3))
    return Error{ErrorCode::bad_argument, "OpenEXR needs a picture of 1 or 3 channels",
                 "encode the channels one by one"};
  return image::encode_exr(image, "picture");
}

}  // namespace symrig
