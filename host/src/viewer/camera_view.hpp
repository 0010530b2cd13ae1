// SPDX-License-Identifier: Apache-2.0
// What the page of a scene with T on the camera's own pixels asks for.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/camera_transport.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace symrig::viewer {

/// Where the projector's cells lie on the camera's picture. Places are shares of width and height.
struct CellPlaces {
  /// x = a[0] u + a[1] v + a[2], y = a[3] u + a[4] v + a[5], for a place (u, v) on the cells.
  std::array<float, 6> affine{1, 0, 0, 0, 1, 0};
  std::vector<float> x, y;  ///< of the middle of each cell; a cell that no pixel looks at takes after others
};

/// A cell's place is the mean of the pixels that look at it: the median of this over a few cells around, less
/// the affine map. So a few cells that are taken for others do not count.
CellPlaces cell_places(const CameraTransport& camera);

/// Pictures of the camera under a light, in full and quick ones of every n-th pixel.
class CameraView {
 public:
  /// A picture with more pixels has a quick one with at most about as many.
  static constexpr std::int64_t kMostQuick = 300'000;

  /// Nothing if a page cannot show it: neither 1 nor 3 channels, or an unknown mosaic.
  static std::optional<CameraView> make(std::shared_ptr<const CameraTransport> camera,
                                        std::int64_t most_quick = kMostQuick);

  const CameraTransport& camera() const { return *whole_.rows; }
  /// 3 with a mosaic.
  int channels() const { return whole_.colours.empty() ? camera().channels() : 3; }
  /// Of quick pictures; nothing if the whole one is quick enough.
  std::optional<Grid> quick_grid() const;

  /// As Relighter of symrig/job/relight.hpp, whose colours of a mosaic may differ in the last bit.
  Result<Image<float>> relit(const Image<float>& light) const { return whole_.relit(light); }
  /// The same pixels of a grid of quick_grid().
  Result<Image<float>> relit_quickly(const Image<float>& light) const { return quick_.relit(light); }
  /// Where the light of one pixel comes from: on the cells, of each channel; with a mosaic of its filter's.
  Result<Image<float>> seen_by(std::int32_t pixel) const;

 private:
  struct Pixels {
    std::shared_ptr<const CameraTransport> rows;
    Image<float> colours;  ///< of a mosaic: three factors for the light of each pixel

    Result<Image<float>> relit(const Image<float>& light) const;
  };

  void make_quick(Grid grid);

  Pixels whole_, quick_;
};

}  // namespace symrig::viewer
