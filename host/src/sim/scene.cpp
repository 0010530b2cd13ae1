// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/scene.hpp"

#include "sim/scenes.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

/// A scene with one operator per channel.
class ComposedScene final : public Scene {
 public:
  ComposedScene(Grid grid, Channels channels) : grid_(grid), channels_(std::move(channels)) {}

  Grid grid() const override { return grid_; }
  int channels() const override { return static_cast<int>(channels_.size()); }
  void apply(std::span<const float> p, std::span<float> y, int channel) const override {
    channels_[channel]->apply(p, y);
  }

 private:
  Grid grid_;
  Channels channels_;
};

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
  const sim::SceneRow* row = sim::find_scene(uri.name);
  return row == nullptr ? ViewLayout() : row->views;
}

Result<std::unique_ptr<Scene>> make_scene(const SceneUri& uri) {
  if (!uri.size.valid())
    return Error{ErrorCode::bad_argument, fmt::format("size={} is empty or too large", to_string(uri.size)),
                 "give at least 1x1"};
  if (uri.size.size() > sim::kLargestScene)
    return Error{ErrorCode::limit,
                 fmt::format("size={} has more than {} pixels", to_string(uri.size), sim::kLargestScene),
                 "give a smaller grid, such as 4096x4096"};
  const sim::SceneRow* row = sim::find_scene(uri.name);
  if (row == nullptr) return sim::unknown_scene(uri.name);
  sim::Channels channels = row->make(uri);
  if (uri.psf > 0)
    for (auto& channel : channels) channel = sim::blurred(uri.size, uri.psf, std::move(channel));
  return std::unique_ptr<Scene>(std::make_unique<sim::ComposedScene>(uri.size, std::move(channels)));
}

}  // namespace symrig
