// SPDX-License-Identifier: Apache-2.0
#include "sim/gummy.hpp"

#include "sim/gaussian_blur.hpp"
#include "sim/hash.hpp"
#include "sim/texture.hpp"

#include <algorithm>
#include <array>

namespace symrig::sim {

namespace {

struct Scatter {
  double width;  // of the Gaussian, as a share of the longer side
  float weight;
};
constexpr std::array<Scatter, 4> kScatter{{{0.007, 0.45F}, {0.025, 0.3F}, {0.08, 0.17F}, {0.25, 0.08F}}};

struct Blob {
  float row, col, half_height, half_width;  // as shares of the picture
};
constexpr std::array<Blob, 3> kBlobs{
    {{0.31F, 0.29F, 0.22F, 0.19F}, {0.43F, 0.74F, 0.27F, 0.17F}, {0.78F, 0.39F, 0.16F, 0.26F}}};
constexpr float kGround = 0.12F;  // share of the texture for the ground's surface; no light enters the ground
constexpr float kSurfaceShare = 0.25F;  // of the albedo reflects without entering

/// 1 inside a blob, `ground` outside, with a soft rim between. q = 1 is the ellipse.
float coverage(float v, float u, float ground) {
  float inside = 0;
  for (const Blob& blob : kBlobs) {
    const float dv = (v - blob.row) / blob.half_height;
    const float du = (u - blob.col) / blob.half_width;
    inside = std::max(inside, std::clamp(4 * (1 - dv * dv - du * du), 0.F, 1.F));
  }
  return ground + (1 - ground) * inside;
}

std::vector<float> blob_albedo(Grid grid, std::uint64_t key, float ground) {
  std::vector<float> albedo = texture(grid, key);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      albedo[static_cast<std::size_t>(row) * grid.cols + col] *=
          coverage((static_cast<float>(row) + 0.5F) / static_cast<float>(grid.rows),
                   (static_cast<float>(col) + 0.5F) / static_cast<float>(grid.cols), ground);
  return albedo;
}

class Gummy final : public Transport {
 public:
  Gummy(Grid grid, std::uint64_t key, double indirect)
      : albedo_(blob_albedo(grid, combine(key, 1), 0.F)),
        surface_(blob_albedo(grid, combine(key, 2), kGround)),
        indirect_(static_cast<float>(indirect)) {
    for (const Scatter& scatter : kScatter)
      blurs_.emplace_back(grid, scatter.width * std::max(grid.rows, grid.cols));
  }

  void apply(std::span<const float> x, std::span<float> y) const override {
    std::vector<float> inside(albedo_.size());
    std::vector<float> spread(albedo_.size(), 0.F);
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = albedo_[i] * x[i];
    for (std::size_t g = 0; g < blurs_.size() && indirect_ > 0; ++g)
      blurs_[g].add(kScatter[g].weight, inside, spread);
    for (std::size_t i = 0; i < inside.size(); ++i)
      y[i] = kSurfaceShare * surface_[i] * x[i] + indirect_ * albedo_[i] * spread[i];
  }

 private:
  std::vector<float> albedo_, surface_;
  float indirect_;
  std::vector<GaussianBlur> blurs_;
};

}  // namespace

std::unique_ptr<Transport> gummy(Grid grid, std::uint64_t key, double indirect) {
  return std::make_unique<Gummy>(grid, key, indirect);
}

}  // namespace symrig::sim
