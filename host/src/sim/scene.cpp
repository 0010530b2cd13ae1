// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/scene.hpp"

#include "sim/exchange.hpp"
#include "sim/groove_transport.hpp"
#include "sim/gummy.hpp"
#include "sim/hash.hpp"
#include "sim/optics.hpp"
#include "sim/texture.hpp"
#include "sim/transport.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

/// A scene is one operator a channel.
class ComposedScene final : public Scene {
 public:
  ComposedScene(Grid grid, std::vector<std::unique_ptr<Transport>> channels)
      : grid_(grid), channels_(std::move(channels)) {}

  Grid grid() const override { return grid_; }
  int channels() const override { return static_cast<int>(channels_.size()); }
  void apply(std::span<const float> p, std::span<float> y, int channel) const override {
    channels_[channel]->apply(p, y);
  }

 private:
  Grid grid_;
  std::vector<std::unique_ptr<Transport>> channels_;
};

/// Paints one plane of the groove white.
void whiten(const Groove& groove, int begin, int end, std::vector<float>& albedo) {
  for (int row = 0; row < groove.grid.rows; ++row)
    for (int col = begin; col < end; ++col)
      albedo[static_cast<std::size_t>(row) * groove.grid.cols + col] = kBrightest;
}

std::vector<float> groove_albedo(const Groove& groove, std::string_view name, std::uint64_t key) {
  std::vector<float> albedo = texture(groove.grid, key);
  if (name == "vgroove-white" || name == "vgroove-mixed") whiten(groove, 0, groove.left_cols, albedo);
  if (name == "vgroove-white") whiten(groove, groove.left_cols, groove.grid.cols, albedo);
  return albedo;
}

using Channels = std::vector<std::unique_ptr<Transport>>;

std::uint64_t channel_key(const SceneUri& uri, int channel) {
  return combine(combine(0x5ce4e, static_cast<std::uint64_t>(uri.seed)), static_cast<std::uint64_t>(channel));
}

Channels plane_channels(const SceneUri& uri) {
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(std::make_unique<Diagonal>(texture(uri.size, channel_key(uri, c))));
  return channels;
}

Channels groove_channels(const SceneUri& uri) {
  const Groove groove(uri.size);
  const std::shared_ptr<const Exchange> exchange = open_exchange(groove);
  Channels channels;
  for (int c = 0; c < uri.channels; ++c)
    channels.push_back(std::make_unique<GrooveTransport>(
        exchange, groove_albedo(groove, uri.name, channel_key(uri, c)), uri.indirect));
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

template <int Views>
Channels views_channels(const SceneUri& uri) {
  TiledViews tiled = tiled_views(uri.size, {Views, Views});
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

struct Maker {
  std::string_view name;
  Channels (*make)(const SceneUri&);
};
constexpr Maker kMakers[] = {
    {"plane", plane_channels},          {"vgroove-white", groove_channels},
    {"vgroove-mixed", groove_channels}, {"vgroove-textured", groove_channels},
    {"gummy", gummy_channels},          {"occluder", occluder_channels},
    {"mirror", mirror_channels},        {"views2", views_channels<2>},
    {"views3", views_channels<3>},
};

constexpr std::int64_t kLargestScene = std::int64_t{1} << 24;  // pixels: 16 Mi, 64 MiB a picture

}  // namespace
}  // namespace symrig::sim

namespace symrig {

Image<float> Scene::apply(const Image<float>& pattern) const {
  assert(pattern.grid() == grid() && pattern.channels() == 1);
  Image<float> photograph(grid(), channels());
  for (int c = 0; c < channels(); ++c) apply(pattern.plane(0), photograph.plane(c), c);
  return photograph;
}

ViewLayout views_of(const SceneUri& uri) {
  if (uri.name == "views2") return {2, 2};
  if (uri.name == "views3") return {3, 3};
  return {};
}

Result<std::unique_ptr<Scene>> make_scene(const SceneUri& uri) {
  if (!uri.size.valid())
    return Error{ErrorCode::bad_argument, fmt::format("size={} is empty or too large", to_string(uri.size)),
                 "give at least 1x1"};
  if (uri.size.size() > sim::kLargestScene)
    return Error{ErrorCode::limit,
                 fmt::format("size={} has more than {} pixels", to_string(uri.size), sim::kLargestScene),
                 "give a smaller grid, such as 4096x4096"};
  for (const sim::Maker& maker : sim::kMakers) {
    if (maker.name != uri.name) continue;
    sim::Channels channels = maker.make(uri);
    if (uri.psf > 0)
      for (auto& channel : channels) channel = sim::blurred(uri.size, uri.psf, std::move(channel));
    return std::unique_ptr<Scene>(std::make_unique<sim::ComposedScene>(uri.size, std::move(channels)));
  }
  return Error{ErrorCode::unknown_name, fmt::format("no scene is called '{}'", uri.name),
               "`sim:NAME`: see scene_names()"};
}

}  // namespace symrig
