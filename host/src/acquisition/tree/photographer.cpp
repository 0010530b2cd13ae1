// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/photographer.hpp"

#include "symrig/base/time.hpp"
#include "symrig/tensor/internal/kernels.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <future>
#include <utility>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

/// One partial sum for each of eight places, so that compilers make vectors of it.
float sum_of(const float* values, std::size_t count) {
  std::array<float, 8> parts{};
  std::size_t t = 0;
  for (; t + parts.size() <= count; t += parts.size())
    for (std::size_t k = 0; k < parts.size(); ++k) parts[k] += values[t + k];
  for (; t < count; ++t) parts[0] += values[t];
  return ((parts[0] + parts[4]) + (parts[2] + parts[6])) + ((parts[1] + parts[5]) + (parts[3] + parts[7]));
}

/// Sets bits [begin, end).
void set(std::int32_t begin, std::int32_t end, std::vector<std::uint64_t>& words) {
  for (std::int32_t t = begin; t < end;) {
    const std::int32_t stop = std::min(end, (t | 63) + 1);
    const int count = stop - t;
    words[static_cast<std::size_t>(t) / 64] |= (kAll >> (64 - count)) << (t & 63);
    t = stop;
  }
}

}  // namespace

LitPixels::LitPixels(LitBlocks blocks, std::size_t pixels)
    : blocks_(std::move(blocks)), words_(pixels / 64 + 1), before_word_(words_.size()) {
  std::ranges::sort(blocks_, {}, &LitRange::begin);
  for (const LitRange& r : blocks_) set(r.begin, r.end, words_);
  std::int32_t lit = 0;
  for (std::size_t w = 0; w < words_.size(); ++w) {
    before_word_[w] = lit;
    lit += std::popcount(words_[w]);
  }
}

std::int32_t LitPixels::before(std::int32_t t) const {
  const std::uint64_t lower = (std::uint64_t{1} << (t & 63)) - 1;
  return before_word_[word(t)] + std::popcount(words_[word(t)] & lower);
}

float LitPixels::sum(std::int32_t begin, std::span<const float> values) const {
  const std::int32_t end = begin + static_cast<std::int32_t>(values.size());
  float sum = 0;
  if (!any(begin, end)) return sum;
  auto r = std::ranges::upper_bound(blocks_, begin, {}, &LitRange::end);
  for (; r != blocks_.end() && r->begin < end; ++r) {
    const std::int32_t from = std::max(begin, r->begin), to = std::min(end, r->end);
    sum += sum_of(values.data() + (from - begin), static_cast<std::size_t>(to - from));
  }
  return sum;
}

std::vector<LogRange> remaining(std::vector<LogRange> left_out, std::int64_t taken) {
  std::sort(left_out.begin(), left_out.end(), [](LogRange a, LogRange b) { return a.first < b.first; });
  std::vector<LogRange> ranges;
  std::int64_t next = 0;
  for (const LogRange& out : left_out) {
    if (out.first > next) ranges.push_back({next, out.first});
    next = out.last;
  }
  if (taken > next) ranges.push_back({next, taken});
  return ranges;
}

namespace {

constexpr std::size_t kBatchBytes =
    std::size_t{32} << 20;  // two batches are in flight: one is photographed, the one before is used
constexpr std::size_t kLargestBatch = 32;

// Photographs that are worked on at once: a batch or two of the kernels if they fit, else few.
constexpr std::size_t kPoolBytes = std::size_t{256} << 20;
constexpr std::size_t kFew = 4;

/// Mean, variance and validity.
std::size_t photograph_bytes(Grid grid, int channels) {
  return static_cast<std::size_t>(grid.size()) * (2 * sizeof(float) + 1) * static_cast<std::size_t>(channels);
}

/// Photographs that are taken together.
std::size_t batch_of(std::size_t photograph) {
  return std::clamp(kBatchBytes / std::max<std::size_t>(photograph, 1), std::size_t{2}, kLargestBatch);
}

Pattern picture(const BlockTree& tree, const LitBlocks& blocks) {
  Pattern pattern(tree.grid());
  const auto values = pattern.plane(0);
  for (const LitRange& r : blocks)
    for (std::int32_t t = r.begin; t < r.end; ++t) values[tree.order()[t]] = 1;
  return pattern;
}

/// The same in tree order.
void light(const LitBlocks& blocks, std::size_t pixels, PagedVector<float>& pattern) {
  pattern.assign(pixels, 0);
  for (const LitRange& r : blocks) std::fill(pattern.begin() + r.begin, pattern.begin() + r.end, 1.0F);
}

/// How often the thread that captures looks whether host work is done.
constexpr std::chrono::milliseconds kGlance{50};

/// Sorting a photograph's sample into tree order, with its noise and validity.
constexpr std::int64_t kSampleOperations = 8;

/// A probe may outlive whom it tells.
struct ToldNoMore {
  Probe& probe;
  explicit ToldNoMore(Probe& told) : probe(told) {}
  ToldNoMore(const ToldNoMore&) = delete;
  ToldNoMore& operator=(const ToldNoMore&) = delete;
  ~ToldNoMore() { probe.tell({}); }
};

Error not_finite() {
  return {ErrorCode::bad_value, "a photograph holds NaN or infinity in a pixel marked valid",
          "check the camera and the merge"};
}

}  // namespace

std::int64_t Photographer::samples() const {
  return std::ssize(tree_.order()) * channels_;
}

std::size_t Photographer::batch_size() const {
  return batch_of(photograph_bytes(tree_.grid(), channels_));
}

std::int64_t bytes_in_flight(Grid grid, int channels) {
  const std::size_t photograph = photograph_bytes(grid, channels);
  const std::size_t pattern = static_cast<std::size_t>(grid.size()) * sizeof(float);
  // Photographs of one batch are used while those of the next are taken, and patterns of a third are made.
  return static_cast<std::int64_t>(batch_of(photograph) * (2 * photograph + 3 * pattern));
}

Photographer::Batch Photographer::prepare(std::span<const LitBlocks> patterns, const Plan& plan,
                                          const MakePreviews& preview) const {
  Batch batch{std::vector<Pattern>(patterns.size()), {}, plan.most};
  tbb::parallel_for(std::size_t{0}, patterns.size(),
                    [&](std::size_t k) { batch.pictures[k] = picture(tree_, patterns[k]); });
  if (!plan.exposures) return batch;
  std::span<Preview> previews;
  if (preview) {
    if (previews_.size() < patterns.size()) previews_.resize(patterns.size());
    previews = std::span(previews_).first(patterns.size());
    preview(plan.first, previews);
  }
  batch.expected = forecaster_->expect(patterns, previews, plan.most);
  if (hands_on_few()) previews_ = {};  // their memory is worth more than the time to get it again
  return batch;
}

/// begun: how far the stage was before.
Result<std::vector<Radiance>> Photographer::measure(const ProgressEvent& begun, const Batch& batch) {
  const Stopwatch watch;
  const double before = rig_seconds();
  ProgressEvent now = begun;
  probe_.tell([&](std::size_t some) {
    now.done += static_cast<std::int64_t>(some);
    return work_.tell(now);
  });
  const ToldNoMore no_more{probe_};
  SYMRIG_TRY(std::vector<Radiance> answers, batch.expected.empty()
                                                ? probe_.measure(batch.pictures)
                                                : probe_.measure_expected(batch.pictures, batch.expected));
  measure_seconds_ += watch.seconds();
  seconds_left_.took(rig_seconds() - before, batch.pictures.size(), batch.most.photograph);
  if (answers.size() != batch.pictures.size())
    return Error{ErrorCode::frame_missing,
                 "the rig answered " + std::to_string(batch.pictures.size()) + " patterns with " +
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

bool Photographer::plans_next(std::size_t photographs) const {
  return forecaster_ != nullptr && probe_.plans_exposures(photographs);
}

/// Which of the patterns from number `first` on are photographed together, and how, when the batch before
/// them may take `reserved` seconds.
Photographer::Plan Photographer::plan(std::size_t first, std::size_t patterns, std::size_t before,
                                      double reserved) const {
  const double now = rig_seconds();
  const std::size_t left = patterns - first;
  const std::size_t count = std::min(seconds_left_.together(now, batch_size()), left);
  return {first, count, plans_next(before + count), seconds_left_.each(now, reserved, left)};
}

/// While a batch is photographed, the one before is used and the next one is prepared. The rig is asked by
/// the thread that captures, so that devices and scripts which belong to one thread work.
Result<std::size_t> Photographer::take_batches(std::string_view stage, std::span<const LitBlocks> patterns,
                                               const Answer& use, const How& how) {
  const std::int64_t expected = taken_ + std::ssize(patterns);
  const auto prepared = [&](const Plan& plan) {
    return prepare(patterns.subspan(plan.first, plan.count), plan, how.preview);
  };
  std::vector<Radiance> answers;  // of the batch before
  Batch batch;
  seconds_left_.begin(rig_seconds());
  if (!patterns.empty()) batch = prepared(plan(0, patterns.size(), 0, 0));
  std::size_t end = 0;
  while (end < patterns.size()) {
    const std::size_t first = end;
    const bool whole = how.all || shorten(batch);
    if (batch.pictures.empty()) break;
    const ProgressEvent now{.stage = stage, .done = taken_, .expected = expected, .later = later_};
    if (!work_.tell(now)) return work_.stop_error();
    end = first + batch.pictures.size();
    const bool more = whole && end < patterns.size();
    const double reserved = batch.most.photograph * static_cast<double>(batch.pictures.size());
    const Plan later = more ? plan(end, patterns.size(), batch.pictures.size(), reserved) : Plan{};
    Batch next;
    const auto host_work = [&]() -> Result<void> {
      if (more) next = prepared(later);
      return answers.empty() ? Result<void>() : use(first - answers.size(), answers);
    };
    // A rig that computes its photographs keeps all processors busy by itself.
    const bool beside = !probe_.computes() && (more || !answers.empty());
    std::future<Result<void>> used =
        std::async(beside ? std::launch::async : std::launch::deferred, host_work);
    Result<std::vector<Radiance>> taken = measure(now, batch);
    if (work_.stopped()) return work_.stop_error();
    while (used.wait_for(kGlance) == std::future_status::timeout) work_.look();
    SYMRIG_CHECK(used.get());
    if (!taken) return taken.error();
    answers = *std::move(taken);
    batch = std::move(next);
    if (!whole) break;
  }
  if (!answers.empty()) SYMRIG_CHECK(use(end - answers.size(), answers));
  if (!work_.tell({.stage = stage, .done = taken_, .expected = expected, .later = later_}))
    return work_.stop_error();
  return end;
}

/// Leaves out what the budget of seconds has no room for. True if nothing.
bool Photographer::shorten(Batch& batch) const {
  const std::size_t count = batch.pictures.size();
  const std::size_t room =
      seconds_left_.room(rig_seconds(), count, batch.most.photograph, !batch.expected.empty());
  if (room >= count) return true;
  batch.pictures.resize(room);
  if (!batch.expected.empty()) batch.expected.resize(room);
  return false;
}

namespace {

Result<void> use_none(std::size_t /*first*/, std::vector<Radiance>& /*answers*/) {
  return {};
}

}  // namespace

Result<void> Photographer::take(std::string_view stage, std::span<const LitBlocks> patterns) {
  SYMRIG_CHECK(take_batches(stage, patterns, use_none, {}));
  return {};
}

Result<std::size_t> Photographer::take_in_time(std::string_view stage, std::span<const LitBlocks> patterns) {
  return take_batches(stage, patterns, use_none, {.preview = {}, .all = false});
}

Result<void> Photographer::take(std::string_view stage, std::span<const LitBlocks> patterns, const Use& use,
                                const MakePreviews& preview) {
  SYMRIG_CHECK(take_some(stage, patterns, use, {.preview = preview}));
  return {};
}

Result<std::size_t> Photographer::take_in_time(std::string_view stage, std::span<const LitBlocks> patterns,
                                               const Use& use, const MakePreviews& preview) {
  return take_some(stage, patterns, use, {.preview = preview, .all = false});
}

Result<std::size_t> Photographer::take_some(std::string_view stage, std::span<const LitBlocks> patterns,
                                            const Use& use, const How& how) {
  const std::int64_t number = taken_;
  std::size_t used = 0;
  std::size_t filled = 0;  // of the pool; patterns [used, used + filled)
  const std::span<TreePhotograph> pool = this->pool(std::min(handed_on(), patterns.size()));
  const auto hand_on = [&] {
    use(number + static_cast<std::int64_t>(used), pool.first(filled));
    used += filled;
    filled = 0;
  };
  const auto in_tree_order = [&](std::size_t first, std::vector<Radiance>& answers) -> Result<void> {
    for (std::size_t next = 0; next < answers.size();) {
      const std::size_t count = std::min(answers.size() - next, pool.size() - filled);
      std::atomic<bool> finite = true;
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
        TreePhotograph& into = pool[filled + k];
        light(patterns[first + next + k], tree_.order().size(), into.pattern);
        if (!to_tree(tree_, answers[next + k], into)) finite = false;
        work_.add(kSampleOperations * samples());
      });
      if (!finite) return not_finite();
      next += count;
      filled += count;
      if (filled == pool.size() || used + filled == patterns.size()) hand_on();
    }
    return {};
  };
  SYMRIG_TRY(const std::size_t taken, take_batches(stage, patterns, in_tree_order, how));
  if (filled > 0) hand_on();
  return taken;
}

Result<void> Photographer::take_each(std::string_view stage, std::span<const LitBlocks> patterns,
                                     const UseOne& use) {
  const auto in_tree_order = [&](std::size_t first, std::vector<Radiance>& answers) -> Result<void> {
    std::atomic<bool> finite = true;
    tbb::parallel_for(std::size_t{0}, answers.size(), [&](std::size_t k) {
      TreePhotograph photograph;
      light(patterns[first + k], tree_.order().size(), photograph.pattern);
      if (!to_tree(tree_, answers[k], photograph)) finite = false;
      if (finite) use(first + k, photograph);
      work_.add(kSampleOperations * samples());
    });
    return finite ? Result<void>() : not_finite();
  };
  SYMRIG_CHECK(take_batches(stage, patterns, in_tree_order, {}));
  return {};
}

std::size_t Photographer::handed_on() const {
  const std::size_t bytes =
      tree_.order().size() * (sizeof(float) + (2 * sizeof(float) + 1) * static_cast<std::size_t>(channels_));
  const std::size_t fit = kPoolBytes / std::max<std::size_t>(bytes, 1);
  if (fit < tensor::kBatch) return kFew;
  return std::min<std::size_t>(fit / tensor::kBatch, 2) * tensor::kBatch;
}

std::span<TreePhotograph> Photographer::pool(std::size_t size) const {
  if (pool_.size() < size) pool_.resize(size);
  return std::span(pool_).first(size);
}

Result<void> Photographer::read(std::int64_t first, std::int64_t count, const Use& use,
                                std::size_t fewest) const {
  const auto pool = this->pool(std::min(std::max(handed_on(), fewest), static_cast<std::size_t>(count)));
  tbb::enumerable_thread_specific<LoggedPhotograph> logged;
  for (std::int64_t begin = first; begin < first + count; begin += std::ssize(pool)) {
    const auto some = pool.first(std::min<std::int64_t>(std::ssize(pool), first + count - begin));
    std::vector<Result<void>> outcome(some.size());
    tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t k) {
      outcome[k] = [&]() -> Result<void> {
        LoggedPhotograph& one = logged.local();
        SYMRIG_CHECK(log_->read(begin + static_cast<std::int64_t>(k), one));
        some[k].pattern.resize(tree_.order().size());
        tree_.to_tree(one.pattern.plane(0), some[k].pattern);
        work_.add(kSampleOperations * samples());
        return to_tree(tree_, one.photograph, some[k]) ? Result<void>() : not_finite();
      }();
    });
    for (const Result<void>& one : outcome) SYMRIG_CHECK(one);
    use(begin, some);
  }
  return {};
}

}  // namespace symrig::acquisition
