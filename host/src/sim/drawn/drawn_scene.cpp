// SPDX-License-Identifier: Apache-2.0

#include "sim/drawn/drawn_scene.hpp"

#include "sim/drawn/survey.hpp"
#include "sim/drawn/translucent.hpp"
#include "sim/light/optics.hpp"
#include "sim/light/random.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace symrig::sim::drawn {

namespace {

constexpr int kRays = 2;  // per point and axis

/// The points around a place that show the same surface, with bilinear weights. Weights of other surfaces are
/// lost.
void add_landing(std::span<const SeenPoint> seen, Grid grid, const Vec& at, int body, double weight,
                 Optics& optics) {
  const double top = std::floor(at.y - 0.5), left = std::floor(at.x - 0.5);
  for (int k = 0; k < 4; ++k) {
    const int down = k / 2, right = k % 2;
    const double row = top + down, col = left + right;
    if (row < 0 || col < 0 || row >= grid.rows || col >= grid.cols) continue;
    const auto point = static_cast<std::int64_t>(row) * grid.cols + static_cast<std::int64_t>(col);
    const double share = (1 - std::abs(at.y - 0.5 - row)) * (1 - std::abs(at.x - 0.5 - col));
    if (share > 0 && seen[static_cast<std::size_t>(point)].body == body)
      optics.add(point, static_cast<float>(weight * share));
  }
}

/// Follows one ray of the rig that passes over (row, col). Adds where it lands after the mirror.
void add_ray(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid, const Vec& from, double weight,
             Optics& optics) {
  const auto mirror = look(recipe, from, -1 * kToRig, -1);
  if (!mirror || recipe.bodies[static_cast<std::size_t>(mirror->body)].finish.mirror == 0) return;
  const Vec direction = 2 * mirror->normal.z * mirror->normal - kToRig;
  const auto landing = look(recipe, mirror->at, direction, mirror->body);
  if (!landing || recipe.bodies[static_cast<std::size_t>(landing->body)].finish.mirror > 0) return;
  if (!sees(recipe, mirror->at, mirror->body, landing->at, landing->body)) return;  // a fin is between
  const auto above = look(recipe, {landing->at.x, landing->at.y, kRigDistance}, -1 * kToRig, -1);
  if (!above || above->body != landing->body || above->face != landing->face) return;
  add_landing(seen, grid, landing->at, landing->body, weight, optics);
}

/// The rays of a point that shows a mirror.
void add_rays(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid, std::size_t point,
              Optics& optics) {
  const auto cols = static_cast<std::size_t>(grid.cols);
  const auto row = static_cast<int>(point / cols), col = static_cast<int>(point % cols);
  const double weight =
      recipe.bodies[static_cast<std::size_t>(seen[point].body)].finish.mirror / (kRays * kRays);
  for (int down = 0; down < kRays; ++down)
    for (int right = 0; right < kRays; ++right)
      add_ray(recipe, seen, grid, {col + (right + 0.5) / kRays, row + (down + 0.5) / kRays, kRigDistance},
              weight, optics);
}

/// The mirrors of a scene: a point on a mirror sees, and lights, the points of the picture where its four
/// reflected rays land. A ray is lost if it lands on a mirror, on nothing, or where the rig cannot see it.
/// Other points see themselves. nullptr: the scene has no mirror in sight.
std::shared_ptr<const Optics> reflections(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid) {
  const auto reflects = [&recipe](const SeenPoint& point) {
    return point.body >= 0 && recipe.bodies[static_cast<std::size_t>(point.body)].finish.mirror > 0;
  };
  if (std::none_of(seen.begin(), seen.end(), reflects)) return nullptr;
  auto optics = std::make_shared<Optics>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (reflects(seen[i]))
      add_rays(recipe, seen, grid, i, *optics);
    else
      optics->add(static_cast<std::int64_t>(i), 1);
    optics->end_pixel();
  }
  return optics;
}

/// What the channels of a scene share.
struct Stage {
  Stage(int seed, Grid grid_)
      : grid(grid_),
        recipe(draw_recipe(seed, grid_)),
        seen(survey(recipe, grid_)),
        light(recipe, seen, grid_),
        mirrors(reflections(recipe, seen, grid_)) {}

  const Finish& finish(std::size_t point) const {
    return recipe.bodies[static_cast<std::size_t>(seen[point].body)].finish;
  }

  Grid grid;
  Recipe recipe;
  std::vector<SeenPoint> seen;
  Interreflection light;
  std::shared_ptr<const Optics> mirrors;
};

/// 0 where the rig sees nothing or a mirror.
std::vector<float> albedo_of(const Stage& stage, int channel) {
  std::vector<float> albedo(stage.seen.size(), 0.F);
  for (std::size_t i = 0; i < albedo.size(); ++i) {
    if (stage.seen[i].body < 0 || stage.finish(i).mirror > 0) continue;
    const Finish& finish = stage.finish(i);
    const int row = static_cast<int>(i) / stage.grid.cols, col = static_cast<int>(i) % stage.grid.cols;
    const double value =
        finish.dark + (finish.bright - finish.dark) * finish.texture.at(stage.grid, row, col);
    albedo[i] = static_cast<float>(value * finish.tint[static_cast<std::size_t>(channel)]);
  }
  return albedo;
}

/// The lobe of light that comes from the rig and goes back to it: (n · h)^(2^sharpness) with h = the axis.
double highlight(const Finish& finish, double cosine) {
  double value = cosine;
  for (int k = 0; k < finish.sharpness; ++k) value *= value;
  return 1 + 0.5 * finish.gloss * value;
}

class DrawnTransport final : public Transport {
 public:
  DrawnTransport(std::shared_ptr<const Stage> stage, int channel, double indirect);
  void apply(std::span<const float> x, std::span<float> y) const override;

 private:
  void add_exchange(std::span<const float> x, std::span<float> y) const;
  void add_translucent();

  std::shared_ptr<const Stage> stage_;
  float indirect_;
  std::vector<float> albedo_, direct_, inverse_cosine_;
  std::vector<Translucent> translucent_;
  std::optional<Haze> haze_;
};

DrawnTransport::DrawnTransport(std::shared_ptr<const Stage> stage, int channel, double indirect)
    : stage_(std::move(stage)),
      indirect_(static_cast<float>(indirect)),
      albedo_(albedo_of(*stage_, channel)) {
  for (std::size_t i = 0; i < albedo_.size(); ++i) {
    const SeenPoint& point = stage_->seen[i];
    inverse_cosine_.push_back(static_cast<float>(1 / point.cosine));
    direct_.push_back(point.body < 0
                          ? 0.F
                          : static_cast<float>((1 - stage_->finish(i).translucency.share) * albedo_[i] *
                                               point.cosine * highlight(stage_->finish(i), point.cosine)));
  }
  add_translucent();
  if (stage_->recipe.haze > 0) haze_.emplace(stage_->recipe.haze, combine(stage_->recipe.key, 11), albedo_);
}

/// The light that enters a tilted surface is spread over more of it. The root keeps the entrance equal to the
/// exit.
void DrawnTransport::add_translucent() {
  for (std::size_t body = 0; body < stage_->recipe.bodies.size(); ++body) {
    const Translucency& inside = stage_->recipe.bodies[body].finish.translucency;
    if (inside.share == 0) continue;
    std::vector<float> entrance(albedo_.size(), 0.F);
    for (std::size_t i = 0; i < entrance.size(); ++i)
      if (stage_->seen[i].body == static_cast<int>(body))
        entrance[i] = static_cast<float>(std::sqrt(albedo_[i] * stage_->seen[i].cosine));
    translucent_.emplace_back(inside, stage_->grid, entrance);
  }
}

/// y += indirect · P x.
void DrawnTransport::add_exchange(std::span<const float> x, std::span<float> y) const {
  constexpr int kBounces = 3;
  const std::size_t n = albedo_.size();
  std::vector<float> leaving(n), arriving(n);
  for (std::size_t i = 0; i < n; ++i) leaving[i] = albedo_[i] * x[i];
  const auto add_arriving = [&] {
    for (std::size_t i = 0; i < n; ++i) y[i] += indirect_ * albedo_[i] * arriving[i];
  };
  const bool glossy = stage_->light.glossy();
  if (glossy) {
    stage_->light.apply(Bounce::first, leaving, arriving);
    add_arriving();
  }
  for (int bounce = 0; bounce < kBounces; ++bounce) {
    stage_->light.apply(Bounce::later, leaving, arriving);
    if (bounce > 0 || !glossy) add_arriving();
    for (std::size_t i = 0; i < n; ++i) leaving[i] = albedo_[i] * inverse_cosine_[i] * arriving[i];
  }
}

void DrawnTransport::apply(std::span<const float> x, std::span<float> y) const {
  for (std::size_t i = 0; i < direct_.size(); ++i) y[i] = direct_[i] * x[i];
  if (indirect_ == 0) return;
  add_exchange(x, y);
  for (const Translucent& inside : translucent_) inside.add(indirect_, x, y);
  if (haze_) haze_->add(indirect_, x, y);
}

/// factor · T.
class Scaled final : public Transport {
 public:
  Scaled(float factor, std::unique_ptr<Transport> light) : factor_(factor), light_(std::move(light)) {}
  void apply(std::span<const float> x, std::span<float> y) const override {
    light_->apply(x, y);
    for (float& value : y) value *= factor_;
  }

 private:
  float factor_;
  std::unique_ptr<Transport> light_;
};

std::unique_ptr<Transport> unscaled(const std::shared_ptr<const Stage>& stage, int channel, double indirect) {
  auto light = std::make_unique<DrawnTransport>(stage, channel, indirect);
  if (stage->mirrors == nullptr) return light;
  return seen_through(stage->mirrors, std::move(light));
}

/// The largest row sum: the brightest point of the flood-lit scene.
double brightest(const Transport& light, std::size_t points) {
  const std::vector<float> flood(points, 1.F);
  std::vector<float> seen(points);
  light.apply(flood, seen);
  return *std::max_element(seen.begin(), seen.end());
}

std::unique_ptr<Transport> channel_of(const std::shared_ptr<const Stage>& stage, int channel,
                                      double indirect) {
  const double most = brightest(*unscaled(stage, channel, 1), stage->seen.size());
  auto light = unscaled(stage, channel, indirect);
  if (most <= kMostLight) return light;
  return std::make_unique<Scaled>(static_cast<float>(kMostLight / most), std::move(light));
}

}  // namespace

std::vector<std::unique_ptr<Transport>> drawn_scene(const SceneUri& uri) {
  const auto stage = std::make_shared<const Stage>(uri.seed, uri.size);
  std::vector<std::unique_ptr<Transport>> channels;
  channels.reserve(static_cast<std::size_t>(uri.channels));
  for (int c = 0; c < uri.channels; ++c) channels.push_back(channel_of(stage, c, uri.indirect));
  return channels;
}

}  // namespace symrig::sim::drawn
