// SPDX-License-Identifier: Apache-2.0
#include "acquisition/photographer.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

constexpr std::size_t kBatchBytes =
    std::size_t{64} << 20;  // photographs in flight; the rig and the host overlap well before that
constexpr std::size_t kLargestBatch = 32;

std::vector<float> lit(const LitBlocks& blocks, std::size_t pixels) {
  std::vector<float> pattern(pixels);
  for (const LitRange& r : blocks) std::fill(pattern.begin() + r.begin, pattern.begin() + r.end, 1.0F);
  return pattern;
}

/// Copies into tree order. False if a value that claims to be valid is not finite.
bool to_tree(const BlockTree& tree, const Radiance& from, TreePhotograph& to) {
  const std::size_t pixels = tree.order().size();
  const auto channels = static_cast<std::size_t>(from.mean.channels());
  to.mean.resize(channels * pixels);
  to.variance.resize(channels * pixels);
  to.valid.resize(channels * pixels);
  bool finite = true;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const auto mean = from.mean.plane(static_cast<int>(channel));
    const auto variance = from.variance.plane(static_cast<int>(channel));
    const auto valid = from.valid.plane(static_cast<int>(channel));
    for (std::size_t t = 0; t < pixels; ++t) {
      const auto raster = static_cast<std::size_t>(tree.order()[t]);
      const std::size_t at = channel * pixels + t;
      const bool ok = valid[raster] != 0;
      finite =
          finite &&
          (!ok || (std::isfinite(mean[raster]) && std::isfinite(variance[raster]) && variance[raster] >= 0));
      to.mean[at] = ok ? mean[raster] : 0;
      to.variance[at] = ok ? variance[raster] : 0;
      to.valid[at] = ok ? 1 : 0;
    }
  }
  return finite;
}

}  // namespace

void subtract_known(TreePhotograph& photograph, const TransportTensor& known, int channels) {
  const std::size_t pixels = photograph.pattern.size();
  for (float& lit : photograph.pattern) lit = -lit;  // mean += T_known (−pattern)
  for (int channel = 0; channel < channels; ++channel)
    known.apply_tree(photograph.pattern,
                     std::span(photograph.mean).subspan(static_cast<std::size_t>(channel) * pixels, pixels),
                     channel, false);
}

std::size_t Photographer::batch_size() const {
  const std::size_t bytes =
      tree_.order().size() * (2 * sizeof(float) + 1) * static_cast<std::size_t>(channels_);
  return std::clamp(kBatchBytes / std::max<std::size_t>(bytes, 1), std::size_t{2}, kLargestBatch);
}

Result<void> Photographer::take(std::string_view stage, std::span<const LitBlocks> patterns,
                                const Take& use) {
  const std::int64_t expected = taken_ + std::ssize(patterns);
  for (std::size_t first = 0; first < patterns.size(); first += batch_size()) {
    if (progress_ && !progress_({stage, taken_, expected}))
      return Error{ErrorCode::interrupted, "capture stopped after " + std::to_string(taken_) + " photographs",
                   "run it again"};
    SYMRIG_CHECK(
        take_batch(patterns.subspan(first, std::min(batch_size(), patterns.size() - first)), first, use));
  }
  if (progress_) progress_({stage, taken_, expected});
  return {};
}

Result<void> Photographer::take_batch(std::span<const LitBlocks> patterns, std::size_t first,
                                      const Take& use) {
  const std::size_t pixels = tree_.order().size();
  std::vector<TreePhotograph> photographs(patterns.size());
  std::vector<Pattern> pictures(patterns.size());
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t k) {
    photographs[k].pattern = lit(patterns[k], pixels);
    pictures[k] = Pattern(tree_.grid());
    tree_.to_raster(photographs[k].pattern, pictures[k].plane(0));
  });
  const auto start = std::chrono::steady_clock::now();
  SYMRIG_TRY(const std::vector<Radiance> answers, probe_.measure(pictures));
  measure_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (answers.size() != patterns.size())
    return Error{ErrorCode::frame_missing,
                 "the rig answered " + std::to_string(patterns.size()) + " patterns with " +
                     std::to_string(answers.size()) + " photographs",
                 "check the camera trigger"};
  for (const Radiance& answer : answers)
    if (answer.mean.grid() != tree_.grid() || answer.mean.channels() != channels_)
      return Error{
          ErrorCode::size_mismatch,
          "a photograph is " + to_string(answer.mean.grid()) + ", the grid is " + to_string(tree_.grid()),
          "calibrate the rig"};
  std::atomic<bool> finite = true;
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t k) {
    if (!to_tree(tree_, answers[k], photographs[k])) finite = false;
    if (finite) use(first + k, photographs[k]);
    photographs[k] = {};
  });
  taken_ += std::ssize(patterns);
  if (!finite)
    return Error{ErrorCode::bad_value, "a photograph holds NaN or infinity in a pixel marked valid",
                 "check the camera and the merge"};
  return {};
}

}  // namespace symrig::acquisition
