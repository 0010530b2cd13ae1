// SPDX-License-Identifier: Apache-2.0
// The table of scenes. A new scene is a function that makes its channels, and a line of the table.

#include "sim/scenes.hpp"

#include "sim/drawn/drawn_scene.hpp"
#include "sim/light/exchange.hpp"
#include "sim/light/optics.hpp"
#include "sim/light/random.hpp"
#include "sim/light/transport.hpp"
#include "symrig/base/text.hpp"
#include "symrig/image/grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include <fmt/format.h>

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

/// Three translucent blobs on a dim opaque ground:
///   T = diag(surface) + indirect · A (Σ_g w_g G_g) A,  A = diag(albedo),  four Gaussians G_g.
/// Light enters through a surface of varying albedo (A), spreads inside, and leaves through the surface (A).
/// The blobs are bright and textured. The ground is dim and textured, and no light enters it (A = 0). The
/// widths of the Gaussians are 0.7, 2.5, 8 and 25 % of the longer side, so T is dense between all points of
/// the blobs. G_g is separable. A Gaussian wider than kFineWidth pixels uses a coarser lattice, G = W G' Wᵀ
/// with linear interpolation W. It is symmetric and non-negative in both cases. units: share of the light
/// that returns; row sums ≤ 0.25 + 0.8 indirect.
/// source: the multiple-scattering half of [Jensen01], with its diffusion kernel as a sum of Gaussians.
std::unique_ptr<Transport> gummy(Grid grid, std::uint64_t key, double indirect) {
  return std::make_unique<Gummy>(grid, key, indirect);
}

struct Octave {
  float cells;  // lattice cells along the longer side
  float share;  // of the whole amplitude
};
constexpr std::array<Octave, 3> kOctaves{{{4.3F, 0.30F}, {10.7F, 0.22F}, {31.3F, 0.18F}}};
constexpr float kGrainShare = 0.30F;

float lattice(std::uint64_t key, std::int64_t row, std::int64_t col) {
  return unit_float(combine(combine(key, static_cast<std::uint64_t>(row)), static_cast<std::uint64_t>(col)));
}

/// Bilinear interpolation of random values on the integer lattice.
float value_noise(std::uint64_t key, float v, float u) {
  const float v0 = std::floor(v);
  const float u0 = std::floor(u);
  const auto row = static_cast<std::int64_t>(v0);
  const auto col = static_cast<std::int64_t>(u0);
  const float fv = v - v0;
  const float fu = u - u0;
  const float top = (1 - fu) * lattice(key, row, col) + fu * lattice(key, row, col + 1);
  const float low = (1 - fu) * lattice(key, row + 1, col) + fu * lattice(key, row + 1, col + 1);
  return (1 - fv) * top + fv * low;
}

float albedo_at(Grid grid, std::uint64_t key, int row, int col) {
  const auto longer = static_cast<float>(std::max(grid.rows, grid.cols));
  const float v = (static_cast<float>(row) + 0.5F) / longer;
  const float u = (static_cast<float>(col) + 0.5F) / longer;
  float sum = kGrainShare * lattice(combine(key, 100), row, col);
  for (std::size_t k = 0; k < kOctaves.size(); ++k)
    sum += kOctaves[k].share * value_noise(combine(key, k), v * kOctaves[k].cells, u * kOctaves[k].cells);
  const float contrast = std::clamp(1.8F * sum - 0.4F, 0.F, 1.F);  // sums of noise are mostly near one half
  return kDarkest + (kBrightest - kDarkest) * contrast;
}

}  // namespace

std::vector<float> texture(Grid grid, std::uint64_t key) {
  std::vector<float> albedo;
  albedo.reserve(grid.size());
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) albedo.push_back(albedo_at(grid, key, row, col));
  return albedo;
}

namespace {

/// Paints one plane of the groove white.
void whiten(const Groove& groove, int begin, int end, std::vector<float>& albedo) {
  for (int row = 0; row < groove.grid.rows; ++row)
    for (int col = begin; col < end; ++col)
      albedo[static_cast<std::size_t>(row) * groove.grid.cols + col] = kBrightest;
}

enum class White { neither, left, both };  // planes of the groove; the others are textured

std::vector<float> groove_albedo(const Groove& groove, White white, std::uint64_t key) {
  std::vector<float> albedo = texture(groove.grid, key);
  if (white != White::neither) whiten(groove, 0, groove.left_cols, albedo);
  if (white == White::both) whiten(groove, groove.left_cols, groove.grid.cols, albedo);
  return albedo;
}

std::uint64_t channel_key(const SceneUri& uri, int channel) {
  return combine(combine(0x5ce4e, static_cast<std::uint64_t>(uri.seed)), static_cast<std::uint64_t>(channel));
}

Channels plane_channels(const SceneUri& uri) {
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(std::make_unique<Diagonal>(texture(uri.size, channel_key(uri, c))));
  return channels;
}

template <White white>
Channels groove_channels(const SceneUri& uri) {
  const Groove groove(uri.size);
  const std::shared_ptr<const Exchange> exchange = open_exchange(groove);
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(std::make_unique<GrooveTransport>(
        exchange, groove_albedo(groove, white, channel_key(uri, c)), uri.indirect));
  return channels;
}

Channels occluder_channels(const SceneUri& uri) {
  const Groove groove(uri.size);
  const std::shared_ptr<const Exchange> exchange = occluded_exchange(groove);
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(
        std::make_unique<GrooveTransport>(exchange, texture(uri.size, channel_key(uri, c)), uri.indirect));
  return channels;
}

/// A mirror scatters nothing: there the groove is black.
std::vector<float> albedo_around_mirror(const Groove& groove, std::uint64_t key) {
  std::vector<float> albedo = texture(groove.grid, key);
  for (int row = 0; row < groove.grid.rows; ++row)
    for (int col = 0; col < groove.grid.cols; ++col)
      if (on_mirror(groove, row, col)) albedo[static_cast<std::size_t>(row) * groove.grid.cols + col] = 0;
  return albedo;
}

Channels mirror_channels(const SceneUri& uri) {
  const Groove groove(uri.size);
  const std::shared_ptr<const Exchange> exchange = open_exchange(groove);
  const auto optics = std::make_shared<const Optics>(mirror_patch(groove));
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(
        seen_through(optics, std::make_unique<GrooveTransport>(
                                 exchange, albedo_around_mirror(groove, channel_key(uri, c)), uri.indirect)));
  return channels;
}

Channels views_channels(const SceneUri& uri) {
  TiledViews tiled = tiled_views(uri.size, views_of(uri), uri.fine);
  const std::shared_ptr<const Exchange> exchange = open_exchange(Groove(tiled.scene));
  const auto optics = std::make_shared<const Optics>(std::move(tiled.optics));
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(
        seen_through(optics, std::make_unique<GrooveTransport>(
                                 exchange, texture(tiled.scene, channel_key(uri, c)), uri.indirect)));
  return channels;
}

Channels gummy_channels(const SceneUri& uri) {
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(gummy(uri.size, channel_key(uri, c), uri.indirect));
  return channels;
}

double flat(Grid /*cells*/, Point /*at*/) {
  return 0;
}

/// Of a groove whose crease is nearest: the distance from the crease.
double groove_depth(Grid cells, Point at) {
  const double crease = 0.47 * cells.cols;
  return std::abs(at.col - crease) / (cells.cols - crease) - 0.5;
}

/// A dome.
double dome_depth(Grid cells, Point at) {
  const double y = 2 * at.row / cells.rows - 1, x = 2 * at.col / cells.cols - 1;
  return 0.5 * (y * y + x * x) - 0.5;
}

/// Of a groove in each of `views` × `views` tiles.
template <int views>
double tiled_depth(Grid cells, Point at) {
  const double width = static_cast<double>(cells.cols) / views;
  const double col = at.col - width * std::clamp(std::floor(at.col / width), 0.0, views - 1.0);
  return std::abs(col / width - 0.47) / 0.53 - 0.5;
}

constexpr std::array kScenes{
    SceneRow{"plane", "one textured plane: direct light only", plane_channels, flat},
    SceneRow{"vgroove-white", "two white planes that form a V-groove", groove_channels<White::both>,
             groove_depth},
    SceneRow{"vgroove-mixed", "a V-groove of a white plane and a textured one", groove_channels<White::left>,
             groove_depth},
    SceneRow{"vgroove-textured", "a V-groove of two textured planes", groove_channels<White::neither>,
             groove_depth},
    SceneRow{"gummy", "three translucent blobs on a dim ground", gummy_channels, dome_depth},
    SceneRow{"occluder", "a textured V-groove with two fins that block light", occluder_channels,
             groove_depth},
    SceneRow{"mirror", "a textured V-groove with a curved mirror: caustics", mirror_channels, groove_depth},
    SceneRow{
        "views2", "a textured V-groove, seen from 2x2 coaxial views", views_channels, tiled_depth<2>, {2, 2}},
    SceneRow{
        "views3", "a textured V-groove, seen from 3x3 coaxial views", views_channels, tiled_depth<3>, {3, 3}},
    SceneRow{"random", "planes, balls and boxes with random surfaces; the seed draws what is in it",
             drawn::drawn_scene, dome_depth},
};

constexpr auto kInfos = [] {
  std::array<SceneInfo, kScenes.size()> list;
  std::transform(kScenes.begin(), kScenes.end(), list.begin(), [](const SceneRow& row) {
    return SceneInfo{row.name, row.about};
  });
  return list;
}();

constexpr auto kNames = [] {
  std::array<std::string_view, kScenes.size()> list;
  std::transform(kScenes.begin(), kScenes.end(), list.begin(), [](const SceneRow& row) { return row.name; });
  return list;
}();

}  // namespace

Depth depth_of(const SceneUri& uri) {
  return uri.given ? flat : find_scene(uri.name)->depth;
}

const SceneRow* find_scene(std::string_view name) {
  const auto* row =
      std::find_if(kScenes.begin(), kScenes.end(), [name](const SceneRow& one) { return one.name == name; });
  return row == kScenes.end() ? nullptr : row;
}

Error unknown_scene(std::string_view name) {
  return {ErrorCode::unknown_name, fmt::format("no scene is called '{}'", name), nearest_hint(name, kNames)};
}

}  // namespace symrig::sim

namespace symrig {

std::span<const SceneInfo> scenes() {
  return sim::kInfos;
}

std::span<const std::string_view> scene_names() {
  return sim::kNames;
}

}  // namespace symrig
