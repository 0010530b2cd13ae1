// SPDX-License-Identifier: Apache-2.0
#include "acquisition/algorithms.hpp"
#include "acquisition/baseline/sparse_column.hpp"
#include "acquisition/light/light_check.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/base/stopwatch.hpp"

#include <cmath>
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
  std::vector<SparseColumn> columns(patterns.size());
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

}  // namespace symrig::acquisition
