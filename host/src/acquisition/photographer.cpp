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
bool to_tree(const BlockTree& tree, const Pattern& pattern, const Radiance& from, TreePhotograph& to) {
  const std::size_t pixels = tree.order().size();
  const auto channels = static_cast<std::size_t>(from.mean.channels());
  to.pattern.resize(pixels);
  tree.to_tree(pattern.plane(0), to.pattern);
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

Error not_finite() {
  return {ErrorCode::bad_value, "a photograph holds NaN or infinity in a pixel marked valid",
          "check the camera and the merge"};
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

Result<std::vector<Radiance>> Photographer::measure(std::span<const Pattern> pictures) {
  const auto start = std::chrono::steady_clock::now();
  SYMRIG_TRY(std::vector<Radiance> answers, probe_.measure(pictures));
  measure_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (answers.size() != pictures.size())
    return Error{ErrorCode::frame_missing,
                 "the rig answered " + std::to_string(pictures.size()) + " patterns with " +
                     std::to_string(answers.size()) + " photographs",
                 "check the camera trigger"};
  for (const Radiance& answer : answers)
    if (answer.mean.grid() != tree_.grid() || answer.mean.channels() != channels_)
      return Error{
          ErrorCode::size_mismatch,
          "a photograph is " + to_string(answer.mean.grid()) + ", the grid is " + to_string(tree_.grid()),
          "calibrate the rig"};
  taken_ += std::ssize(answers);
  return answers;
}

Result<void> Photographer::take_batches(std::string_view stage, std::span<const LitBlocks> patterns,
                                        const Answer& use) {
  const std::int64_t expected = taken_ + std::ssize(patterns);
  for (std::size_t first = 0; first < patterns.size(); first += batch_size()) {
    if (progress_ && !progress_({stage, taken_, expected}))
      return Error{ErrorCode::interrupted, "capture stopped after " + std::to_string(taken_) + " photographs",
                   "run it again"};
    std::vector<Pattern> pictures(std::min(batch_size(), patterns.size() - first), Pattern(tree_.grid()));
    tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t k) {
      tree_.to_raster(lit(patterns[first + k], tree_.order().size()), pictures[k].plane(0));
    });
    SYMRIG_TRY(std::vector<Radiance> answers, measure(pictures));
    SYMRIG_CHECK(use(first, pictures, answers));
  }
  if (progress_) progress_({stage, taken_, expected});
  return {};
}

Result<void> Photographer::take(std::string_view stage, std::span<const LitBlocks> patterns) {
  return take_batches(
      stage, patterns,
      [](std::size_t, std::span<const Pattern>, std::vector<Radiance>&) -> Result<void> { return {}; });
}

Result<void> Photographer::take_each(std::string_view stage, std::span<const LitBlocks> patterns,
                                     const UseOne& use) {
  const auto develop = [&](std::size_t first, std::span<const Pattern> pictures,
                           std::vector<Radiance>& answers) -> Result<void> {
    std::atomic<bool> finite = true;
    tbb::parallel_for(std::size_t{0}, answers.size(), [&](std::size_t k) {
      TreePhotograph photograph;
      if (!to_tree(tree_, pictures[k], answers[k], photograph)) finite = false;
      if (finite) use(first + k, photograph);
    });
    return finite ? Result<void>() : not_finite();
  };
  return take_batches(stage, patterns, develop);
}

Result<void> Photographer::read(std::int64_t first, std::int64_t count, const Use& use) const {
  constexpr std::int64_t kAtOnce = 32;  // two batches of the kernels that subtract what is known
  for (std::int64_t begin = first; begin < first + count; begin += kAtOnce) {
    std::vector<TreePhotograph> photographs(
        static_cast<std::size_t>(std::min(kAtOnce, first + count - begin)));
    std::vector<Result<void>> outcome(photographs.size());
    tbb::parallel_for(std::size_t{0}, photographs.size(), [&](std::size_t k) {
      outcome[k] = [&]() -> Result<void> {
        SYMRIG_TRY(const Pattern pattern, log_->pattern(begin + static_cast<std::int64_t>(k)));
        SYMRIG_TRY(const Radiance photograph, log_->photograph(begin + static_cast<std::int64_t>(k)));
        return to_tree(tree_, pattern, photograph, photographs[k]) ? Result<void>() : not_finite();
      }();
    });
    for (const Result<void>& one : outcome) SYMRIG_CHECK(one);
    use(begin, photographs);
  }
  return {};
}

}  // namespace symrig::acquisition
