// SPDX-License-Identifier: Apache-2.0
// The table of scenes. A new scene is a function that makes its channels, and a line of the table.
#include "sim/scenes.hpp"

#include "sim/drawn/drawn_scene.hpp"
#include "sim/exchange.hpp"
#include "sim/groove_transport.hpp"
#include "sim/gummy.hpp"
#include "sim/hash.hpp"
#include "sim/optics.hpp"
#include "sim/texture.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
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

std::span<const SceneRow> scene_table() {
  return kScenes;
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
