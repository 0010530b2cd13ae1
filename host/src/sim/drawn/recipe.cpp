// SPDX-License-Identifier: Apache-2.0

#include "sim/drawn/recipe.hpp"

#include "sim/light/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::sim::drawn {

namespace {

/// Random numbers from a key: a counter that is hashed. Only integers and exact float operations, so the
/// numbers are the same on all computers.
class Draws {
 public:
  explicit Draws(std::uint64_t key) : key_(key) {}

  std::uint64_t key() { return combine(key_, next_++); }
  double unit() { return unit_double(key()); }
  double between(double low, double high) { return low + (high - low) * unit(); }
  bool chance(double probability) { return unit() < probability; }
  /// 0 … count − 1.
  int below(int count) { return static_cast<int>(unit() * count); }
  /// Between `low` and low · 2^octaves, each octave equally probable.
  double octaves(double low, int octaves) {
    const int octave = below(octaves);
    return low * static_cast<double>(1 << octave) * (1 + unit());
  }

 private:
  std::uint64_t key_;
  std::uint64_t next_ = 0;
};

float random_at(std::uint64_t key, std::int64_t row, std::int64_t col) {
  return unit_float(combine(combine(key, static_cast<std::uint64_t>(row)), static_cast<std::uint64_t>(col)));
}

/// Random numbers at whole v and u, and bilinear between them.
float bumps(std::uint64_t key, float v, float u) {
  const float v0 = std::floor(v), u0 = std::floor(u), fv = v - v0, fu = u - u0;
  const auto row = static_cast<std::int64_t>(v0), col = static_cast<std::int64_t>(u0);
  const float top = (1 - fu) * random_at(key, row, col) + fu * random_at(key, row, col + 1);
  const float low = (1 - fu) * random_at(key, row + 1, col) + fu * random_at(key, row + 1, col + 1);
  return (1 - fv) * top + fv * low;
}

/// Sums of random numbers are mostly near one half: more contrast.
float stretched(float value, float contrast) {
  return std::clamp(0.5F + contrast * (value - 0.5F), 0.F, 1.F);
}

/// Octaves of bumps, from two along the longer side to bumps of two points.
float fractal(std::uint64_t key, float v, float u, float longer) {
  float sum = 0;
  int octaves = 0;
  for (float cells = 2.3F; cells < longer || octaves == 0; cells *= 2, ++octaves)
    sum += bumps(combine(key, static_cast<std::uint64_t>(octaves)), v * cells, u * cells);
  const auto count = static_cast<float>(octaves);
  return stretched(sum / count, 1.3F * std::sqrt(count));
}

/// The number of the nearest of the seeds, one in each cell of a lattice.
float patches(std::uint64_t key, float v, float u) {
  const auto row = static_cast<std::int64_t>(std::floor(v)), col = static_cast<std::int64_t>(std::floor(u));
  float nearest = 1e9F, value = 0;
  for (std::int64_t r = row - 1; r <= row + 1; ++r)
    for (std::int64_t c = col - 1; c <= col + 1; ++c) {
      const float dv = static_cast<float>(r) + random_at(combine(key, 1), r, c) - v;
      const float du = static_cast<float>(c) + random_at(combine(key, 2), r, c) - u;
      const float distance = dv * dv + du * du;
      if (distance >= nearest) continue;
      nearest = distance;
      value = random_at(combine(key, 3), r, c);
    }
  return value;
}

}  // namespace

float Texture::at(Grid grid, int row, int col) const {
  const auto longer = static_cast<float>(std::max(grid.rows, grid.cols));
  const float v = (static_cast<float>(row) + 0.5F) / longer, u = (static_cast<float>(col) + 0.5F) / longer;
  const auto scale = static_cast<float>(cells);
  switch (spectrum) {
    case Spectrum::coarse:
      return stretched(bumps(key, v * scale, u * scale), 1.3F);
    case Spectrum::fractal:
      return fractal(key, v, u, longer);
    case Spectrum::patches:
      return patches(key, v * scale, u * scale);
    case Spectrum::grain:
      return random_at(key, row, col);
    case Spectrum::white:
      break;
  }
  return 1;
}

namespace {

/// Each aspect of a scene has draws of its own.
enum Aspect : std::uint64_t { kGround, kObjects, kFins, kLight, kFinish, kRest };

/// A direction with a random angle, in the picture's plane. The half-angle formulas avoid sine and cosine,
/// which are not the same on all computers.
Vec heading(Draws& draws) {
  const double t = draws.between(-1, 1), sign = draws.chance(0.5) ? 1 : -1;
  return {sign * (1 - t * t) / (1 + t * t), sign * 2 * t / (1 + t * t), 0};
}

/// Three unit vectors at right angles: the columns of the rotation of a random quaternion.
std::array<Vec, 3> attitude(Draws& draws) {
  std::array<double, 4> q{};
  for (double& part : q) part = draws.between(-1, 1);
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) + 1e-9;
  for (double& part : q) part /= length;
  const auto [w, x, y, z] = q;
  return {unit({1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)}),
          unit({2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)}),
          unit({2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)})};
}

/// Chances that hold for a whole scene, so that some scenes have none of an ingredient and others much.
struct Chances {
  double gloss = 0, translucent = 0, speckled = 0;
  double brightest = 0.8;
  double lowest_contrast = 0.03, highest_contrast = 0.4;  ///< the darkest albedo as a share of the brightest
};

Chances draw_chances(Draws draws) {
  Chances chances;
  chances.gloss = draws.chance(0.35) ? 0.6 : 0;
  chances.translucent = draws.chance(0.5) ? 0.7 : 0;
  chances.speckled = draws.chance(0.6) ? 1 : 0;
  chances.brightest = draws.chance(0.75) ? 0.85 : draws.between(0.1, 0.5);
  if (draws.chance(0.3)) {
    chances.lowest_contrast = 0.5;
    chances.highest_contrast = 0.9;
  }
  return chances;
}

Translucency draw_translucency(Draws& draws, double longer, bool speckled) {
  Translucency inside;
  inside.share = draws.between(0.3, 0.9);
  inside.near = longer * draws.between(0.008, 0.03);
  inside.far = longer * draws.between(0.05, 0.2);
  inside.far_share = draws.between(0.1, 0.5);
  const std::uint64_t key = draws.key();
  inside.speckle = speckled ? key | 1U : 0;
  return inside;
}

Finish draw_finish(Draws& draws, const Chances& chances, double longer, bool solid) {
  Finish finish;
  finish.texture = {static_cast<Spectrum>(draws.below(kSpectra)), draws.key(), draws.between(3, 14)};
  finish.bright = chances.brightest * draws.between(0.6, 1);
  if (draws.chance(0.2)) finish.bright *= draws.octaves(1.0 / 32, 4);
  finish.dark = finish.bright * draws.between(chances.lowest_contrast, chances.highest_contrast);
  for (double& tint : finish.tint) tint = draws.between(0.6, 1);
  const bool glossy = draws.chance(chances.gloss), translucent = draws.chance(chances.translucent);
  finish.gloss = glossy ? draws.between(1, 6) : 0;
  finish.sharpness = draws.below(4) + 2;
  Translucency inside = draw_translucency(draws, longer, draws.chance(chances.speckled));
  if (translucent && (solid || draws.chance(0.3))) finish.translucency = inside;
  return finish;
}

/// Places on the picture, in points of the grid.
struct Picture {
  explicit Picture(Grid grid) : rows(grid.rows), cols(grid.cols), longer(std::max(grid.rows, grid.cols)) {}
  double rows, cols, longer;

  Vec at(double row, double col) const { return {col * cols, row * rows, 0}; }
};

/// A plane through `at` that rises towards the rig by `slope` along the unit vector `along`.
HalfSpace rising(const Vec& at, const Vec& along, double slope) {
  return {at, unit(Vec{-slope * along.x, -slope * along.y, 1})};
}

/// Planes that enclose the picture: one tilted, two that form a groove, or three that form a corner.
std::vector<HalfSpace> draw_planes(Ground ground, const Picture& picture, Draws& draws) {
  const Vec at = picture.at(draws.between(0.3, 0.7), draws.between(0.3, 0.7));
  const Vec along = heading(draws);
  const auto steep = [&draws] { return draws.between(0.6, 1.8); };
  switch (ground) {
    case Ground::wall:
      return {rising(at, along, draws.between(0, 0.5))};
    case Ground::groove:
      return {rising(at, along, steep()), rising(at, -1 * along, steep())};
    case Ground::corner: {
      constexpr double kCos = -0.5, kSin = 0.8660254037844386;  // of 120 degrees
      const Vec left{kCos * along.x - kSin * along.y, kSin * along.x + kCos * along.y, 0};
      const Vec right{kCos * along.x + kSin * along.y, -kSin * along.x + kCos * along.y, 0};
      return {rising(at, along, steep()), rising(at, left, steep()), rising(at, right, steep())};
    }
    case Ground::none:
      break;
  }
  return {};
}

/// The height of the planes at a place.
double height_at(std::span<const HalfSpace> planes, const Vec& place) {
  double highest = planes.empty() ? 0 : -1e9;
  for (const HalfSpace& plane : planes) {
    const Vec& n = plane.normal;
    highest =
        std::max(highest, plane.at.z - (n.x * (place.x - plane.at.x) + n.y * (place.y - plane.at.y)) / n.z);
  }
  return highest;
}

/// A ball or a box on the ground or a little above. The first one covers the middle of the picture.
Solid draw_object(std::span<const HalfSpace> planes, const Picture& picture, bool first, Draws& draws) {
  Vec middle = first ? picture.at(draws.between(0.45, 0.55), draws.between(0.45, 0.55))
                     : picture.at(draws.between(0.08, 0.92), draws.between(0.08, 0.92));
  const double size = picture.longer * (first ? draws.between(0.15, 0.25) : draws.between(0.06, 0.22));
  middle.z = height_at(planes, middle) + size * draws.between(0, 1.6);
  if (draws.chance(0.5)) return Ball{middle, size};
  Box box{middle, attitude(draws), {}};
  for (double& half : box.half) half = size * draws.between(0.4, 1.1);
  return box;
}

/// A thin wall parallel to the axis of the rig.
Body draw_fin(std::span<const HalfSpace> planes, const Picture& picture, Draws& draws) {
  Vec middle = picture.at(draws.between(0.2, 0.8), draws.between(0.2, 0.8));
  const Vec along = heading(draws), across{-along.y, along.x, 0};
  const double height = picture.longer * draws.between(0.05, 0.25);
  middle.z = height_at(planes, middle) + picture.longer * draws.between(0.02, 0.25);
  const double length = picture.longer * draws.between(0.1, 0.5);
  return {Box{middle, {along, across, kToRig}, {length, 1e-3, height}}, Finish{}, true};
}

void add_objects(std::span<const HalfSpace> planes, const Picture& picture, const Chances& chances,
                 std::uint64_t key, Recipe& recipe) {
  Draws draws(combine(key, kObjects));
  const int least = recipe.ground == Ground::none ? 3 : 0;
  const int count = least + draws.below(7 - least);
  const bool mirrored = draws.chance(0.3);
  for (int k = 0; k < count; ++k) {
    Draws own(combine(combine(key, kFinish), std::uint64_t{100} + static_cast<std::uint64_t>(k)));
    Body body{draw_object(planes, picture, recipe.ground == Ground::none && k == 0, draws),
              draw_finish(own, chances, picture.longer, true), false};
    if (mirrored && k == 1) body.finish.mirror = own.between(0.5, 0.9);
    if (body.finish.mirror > 0) body.finish.translucency = {};
    recipe.bodies.push_back(body);
  }
}

void add_ground(std::span<const HalfSpace> planes, const Picture& picture, const Chances& chances,
                std::uint64_t key, Recipe& recipe) {
  for (std::size_t k = 0; k < planes.size(); ++k) {
    Draws own(combine(combine(key, kFinish), k));
    recipe.bodies.push_back({planes[k], draw_finish(own, chances, picture.longer, false), false});
  }
}

void draw_light(Draws draws, Recipe& recipe) {
  recipe.exchange = draws.chance(0.7) ? 1 : draws.octaves(1.0 / 64, 5);
  recipe.speckle = draws.chance(0.35) ? draws.between(0.3, 1) : 0;
  recipe.haze = draws.chance(0.25) ? draws.octaves(0.01, 4) : 0;
}

/// "2 balls", "1 box".
std::string counted(int count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

struct Counts {
  int balls = 0, boxes = 0, fins = 0, translucent = 0, speckled = 0, glossy = 0, mirrors = 0;
  std::set<Spectrum> spectra;
};

Counts count(const Recipe& recipe) {
  Counts counts;
  for (const Body& body : recipe.bodies) {
    const Finish& finish = body.finish;
    counts.fins += body.unseen ? 1 : 0;
    if (body.unseen) continue;
    counts.balls += std::holds_alternative<Ball>(body.solid) ? 1 : 0;
    counts.boxes += std::holds_alternative<Box>(body.solid) ? 1 : 0;
    counts.mirrors += finish.mirror > 0 ? 1 : 0;
    if (finish.mirror > 0) continue;
    counts.spectra.insert(finish.texture.spectrum);
    counts.translucent += finish.translucency.share > 0 ? 1 : 0;
    counts.speckled += finish.translucency.speckle != 0 ? 1 : 0;
    counts.glossy += finish.gloss > 0 ? 1 : 0;
  }
  return counts;
}

constexpr std::array<std::string_view, 4> kGrounds{"void", "wall", "groove", "corner"};

}  // namespace

Recipe draw_recipe(int seed, Grid grid) {
  const std::uint64_t key = combine(0xd4a3, static_cast<std::uint64_t>(seed));
  const Picture picture(grid);
  const Chances chances = draw_chances(Draws(combine(key, kRest)));
  Draws draws(combine(key, kGround));
  constexpr std::array kGroundOf{Ground::none,   Ground::none,   Ground::wall,   Ground::wall,
                                 Ground::groove, Ground::groove, Ground::groove, Ground::corner};
  Recipe recipe;
  recipe.key = key;
  recipe.ground = kGroundOf[static_cast<std::size_t>(draws.below(kGroundOf.size()))];
  const std::vector<HalfSpace> planes = draw_planes(recipe.ground, picture, draws);
  add_ground(planes, picture, chances, key, recipe);
  add_objects(planes, picture, chances, key, recipe);
  Draws fins(combine(key, kFins));
  for (int k = fins.chance(0.4) ? 1 + fins.below(3) : 0; k > 0; --k)
    recipe.bodies.push_back(draw_fin(planes, picture, fins));
  draw_light(Draws(combine(key, kLight)), recipe);
  return recipe;
}

std::string ingredients(const Recipe& recipe) {
  const Counts counts = count(recipe);
  std::vector<std::string> parts{std::string(kGrounds[static_cast<std::size_t>(recipe.ground)])};
  const auto add = [&parts](int n, std::string_view one, std::string_view many) {
    if (n > 0) parts.push_back(counted(n, one, many));
  };
  add(counts.balls, "ball", "balls");
  add(counts.boxes, "box", "boxes");
  std::vector<std::string_view> spectra;
  spectra.reserve(counts.spectra.size());
  for (const Spectrum one : counts.spectra) spectra.push_back(kSpectrumNames[static_cast<std::size_t>(one)]);
  parts.push_back(fmt::format("{}", fmt::join(spectra, " + ")));
  add(counts.fins, "fin", "fins");
  add(counts.glossy, "glossy", "glossy");
  add(counts.mirrors, "mirror", "mirrors");
  add(counts.translucent, "translucent", "translucent");
  add(counts.speckled, "of them speckled", "of them speckled");
  if (recipe.speckle > 0) parts.push_back(fmt::format("speckled exchange {:.1f}", recipe.speckle));
  if (recipe.haze > 0) parts.push_back(fmt::format("haze {:.2f}", recipe.haze));
  if (recipe.exchange < 1) parts.push_back(fmt::format("exchange x {:.2f}", recipe.exchange));
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace symrig::sim::drawn
