// SPDX-License-Identifier: Apache-2.0
#include "acquisition/algorithms.hpp"
#include "acquisition/light/light_check.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/tree_photograph.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace symrig::acquisition {
namespace {

/// The light of one photograph, and its brightest sample over its noise.
struct Brightness {
  double light = 0, variance = 0, brightest = 0;

  static Brightness of(const TreePhotograph& photograph) {
    Brightness found;
    for (std::size_t at = 0; at < photograph.mean.size(); ++at) {
      if (photograph.valid[at] == 0) continue;
      const double light = photograph.mean[at], variance = photograph.variance[at];
      found.light += light, found.variance += variance;
      if (light > found.brightest * std::sqrt(variance))
        found.brightest = variance > 0 ? light / std::sqrt(variance) : HUGE_VAL;
    }
    return found;
  }
};

/// Neither a sum nor a sample is above the noise.
std::optional<LightFault> find_dark(const std::vector<Brightness>& photographs) {
  constexpr double kOfAllSamples = 8;  // 10^9 samples have one in 10^6 captures
  double light = 0, variance = 0;
  for (const Brightness& one : photographs) {
    if (one.brightest > kOfAllSamples) return std::nullopt;
    light += one.light, variance += one.variance;
  }
  const double least = kLightSigmas * std::sqrt(variance);
  if (light > least && light > 0) return std::nullopt;
  return no_light(photographs.size(), light < -least);
}

}  // namespace

Result<CaptureResult> capture_brute(Probe& probe, const CaptureSettings& options) {
  const Stopwatch watch;
  const BlockTree tree(probe.grid());
  const std::int64_t pixels = tree.grid().size();
  const std::int64_t bytes =
      pixels * pixels *
      static_cast<std::int64_t>(sizeof(std::int32_t) +
                                sizeof(float) * static_cast<std::size_t>(probe.channels()));
  if (bytes > options.memory_limit)
    return Error{
        ErrorCode::limit,
        "brute force on " + to_string(tree.grid()) + " may hold " + std::to_string(bytes >> 20) + " MiB",
        "use algorithm symrig, or a smaller grid"};
  Photographer photographer(probe, nullptr, tree, options.work);
  photographer.expect_later(kNoneToCome);
  std::vector<LitBlocks> patterns;
  patterns.reserve(pixels);
  for (std::int32_t i = 0; i < pixels; ++i) patterns.push_back({{i, i + 1}});
  std::vector<BlockColumn> columns(patterns.size());
  std::vector<Brightness> brightness(patterns.size());
  const PixelSet everything = PixelSet::all(tree.grid());
  SYMRIG_CHECK(
      photographer.take_each("brute force", patterns, [&](std::size_t k, TreePhotograph& photograph) {
        columns[k] = significant_column(photograph, everything, probe.channels());
        brightness[k] = Brightness::of(photograph);
      }));
  if (!options.unchecked)
    if (const auto dark = find_dark(brightness)) return dark->error();
  TensorBuilder builder(tree, tree, probe.channels());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto begin = static_cast<std::int32_t>(k);
    builder.add_column(begin, begin + 1, columns[k].pixels, columns[k].values);
    columns[k] = {};
  }
  const double total = watch.seconds();
  return CaptureResult{std::move(builder).finish(),
                       photographer.taken(),
                       {photographer.taken()},
                       total - photographer.measure_seconds()};
}

// Dual photography's adaptive scan. Blocks whose light does not overlap in the camera are lit together and
// refined. A pixel's light below the threshold is not refined any further: it stays constant over the block.
// [Garg06 §6.1] calls this "a low-frequency approximation for indirect bounce light transport".

namespace {

/// mean −= T_known · pattern: what is left is the light of unknown transport.  Leaves pattern negated.
void subtract_known(TreePhotograph& photograph, const TransportTensor& known, int channels) {
  const std::size_t pixels = photograph.pattern.size();
  for (float& lit : photograph.pattern) lit = -lit;  // mean += T_known (−pattern)
  for (int channel = 0; channel < channels; ++channel)
    known.apply_tree(photograph.pattern,
                     std::span(photograph.mean).subspan(static_cast<std::size_t>(channel) * pixels, pixels),
                     channel, false);
}

/// A lit block whose light on some camera pixels is not yet divided among its pixels.
struct Active {
  std::int32_t block;
  PixelSet footprint;  ///< camera pixels with light above the threshold
};

class Dual {
 public:
  Dual(Probe& probe, const CaptureSettings& options)
      : options_(options),
        tree_(probe.grid()),
        channels_(probe.channels()),
        photographer_(probe, nullptr, tree_, options.work),
        builder_(tree_, tree_, channels_) {}

  Result<CaptureResult> run() {
    const Stopwatch watch;
    SYMRIG_TRY(std::vector<Active> active, photograph_flood());
    for (int level = 0; !active.empty(); ++level) {
      SYMRIG_TRY(active, refine(level, active));
    }
    const double total = watch.seconds();
    return CaptureResult{std::move(builder_).finish(), photographer_.taken(), std::move(patterns_per_level_),
                         total - photographer_.measure_seconds()};
  }

 private:
  Result<std::vector<Active>> photograph_flood() {
    BlockColumn flood;
    Result<void> light;
    const std::vector<LitBlocks> pattern{{{0, static_cast<std::int32_t>(tree_.grid().size())}}};
    SYMRIG_CHECK(photographer_.take_each("flood-lit", pattern, [&](std::size_t, TreePhotograph& p) {
      set_thresholds(p);
      if (!options_.unchecked) light = check_light(LightSeries(tree_, p, nullptr), {});
      flood = significant_column(p, PixelSet::all(tree_.grid()), channels_);
    }));
    if (!light) return light.error();
    patterns_per_level_.push_back(1);
    std::vector<Active> active;
    keep(0, 0, flood, active);
    return active;
  }

  void set_thresholds(const TreePhotograph& flood) {
    const std::size_t pixels = flood.pattern.size();
    for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels_); ++channel) {
      double squares = 0;
      for (std::size_t t = channel * pixels; t < (channel + 1) * pixels; ++t)
        squares += static_cast<double>(flood.mean[t]) * static_cast<double>(flood.mean[t]);
      threshold_.push_back(
          static_cast<float>(options_.dual_threshold * std::sqrt(squares / static_cast<double>(pixels))));
    }
  }

  /// Stores what is not to be refined, and keeps the block active for the rest.
  void keep(int level, std::int32_t index, const BlockColumn& column, std::vector<Active>& active) {
    const Block& block = tree_.level(level)[index];
    const std::size_t channels = channels_;
    Active refined{index, {}};
    std::vector<std::int32_t> rows;
    std::vector<float> values;
    for (std::size_t k = 0; k < column.pixels.size(); ++k) {
      const auto value = std::span(column.values).subspan(k * channels, channels);
      bool large = false;
      for (std::size_t channel = 0; channel < channels; ++channel)
        large = large || std::abs(value[channel]) > threshold_[channel];
      if (large && !block.single_pixel()) {
        refined.footprint.pixels.push_back(column.pixels[k]);
        continue;
      }
      rows.push_back(column.pixels[k]);
      for (const float v : value) values.push_back(v / static_cast<float>(block.size()));
    }
    if (!rows.empty()) builder_.add_column(block.begin, block.end, rows, values);
    if (!refined.footprint.pixels.empty()) active.push_back(std::move(refined));
  }

  /// Blocks with disjoint footprints share a colour; largest footprints first.
  std::vector<std::vector<std::size_t>> colour(const std::vector<Active>& active) const {
    std::vector<std::size_t> order(active.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return active[a].footprint.pixels.size() > active[b].footprint.pixels.size();
    });
    std::vector<std::vector<std::size_t>> classes;
    std::vector<std::vector<bool>> covered;
    for (const std::size_t k : order) {
      const auto& pixels = active[k].footprint.pixels;
      std::size_t c = 0;
      while (c < classes.size() &&
             std::any_of(pixels.begin(), pixels.end(), [&](std::int32_t p) { return covered[c][p]; }))
        ++c;
      if (c == classes.size()) {
        classes.emplace_back();
        covered.emplace_back(tree_.order().size());
      }
      for (const std::int32_t p : pixels) covered[c][p] = true;
      classes[c].push_back(k);
    }
    return classes;
  }

  Result<std::vector<Active>> refine(int level, const std::vector<Active>& active) {
    const auto blocks = tree_.level(level);
    const auto children = tree_.level(level + 1);
    struct Target {
      std::size_t active;
      int slot;
    };
    std::vector<LitBlocks> patterns;
    std::vector<std::vector<Target>> targets;
    for (const auto& colour_class : colour(active)) {
      for (int slot = 0; slot < 4; ++slot) {
        LitBlocks lit;
        std::vector<Target> of;
        for (const std::size_t k : colour_class) {
          const Block& block = blocks[active[k].block];
          if (slot >= block.children) continue;
          const Block& child = children[std::int64_t{block.first_child} + slot];
          lit.push_back({child.begin, child.end});
          of.push_back({k, slot});
        }
        if (lit.empty()) continue;
        patterns.push_back(std::move(lit));
        targets.push_back(std::move(of));
      }
    }
    std::vector<std::array<BlockColumn, 4>> answers(active.size());
    patterns_per_level_.push_back(std::ssize(patterns));
    SYMRIG_CHECK(photographer_.take_each(
        "level " + std::to_string(level), patterns, [&](std::size_t k, TreePhotograph& photograph) {
          // Light below the threshold adds up over the blocks of a colour. [Garg06] found how to take out
          // what is known; the published dual photography does not.
          if (options_.dual_subtracts) subtract_known(photograph, builder_.current(), channels_);
          for (const Target& t : targets[k])
            answers[t.active][t.slot] = significant_column(photograph, active[t.active].footprint, channels_);
        }));
    std::vector<Active> next;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const Block& block = blocks[active[k].block];
      for (int slot = 0; slot < block.children; ++slot)
        keep(level + 1, block.first_child + slot, answers[k][slot], next);
    }
    return next;
  }

  const CaptureSettings& options_;
  BlockTree tree_;
  int channels_;
  Photographer photographer_;
  TensorBuilder builder_;
  std::vector<float> threshold_;  ///< per channel
  std::vector<std::int64_t> patterns_per_level_;
};

}  // namespace

Result<CaptureResult> capture_dual(Probe& probe, const CaptureSettings& options) {
  return Dual(probe, options).run();
}

}  // namespace symrig::acquisition
