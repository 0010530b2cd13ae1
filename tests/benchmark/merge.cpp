// SPDX-License-Identifier: Apache-2.0
// benchmark_merge [rounds [keep]]: HDR merge speed against the machine's memory speed, both measured in this
// run, alternating, and against the same formulas in double; frames added one by one likewise; and what other
// weights cost. keep: freed memory stays with the program, as a command that photographs for minutes may ask
// of malloc; without it every large photograph is paged in anew.
//
// Every item moves the same number of bytes as one merge of 4 frames with black and dead pixels, so that a
// busy machine disturbs all alike. Bytes are counted as STREAM does: what is named, not what a cache fetches.
#include "symrig/hdr/merge.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"
#include "unit/hdr/merge_contest.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <malloc.h>
#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

namespace {

using namespace symrig;

const NoiseModel kSensor = NoiseModel::from_electrons({});

/// Largest |merged − the same formulas in double| in units of sigma.
double error_in_sigmas(const std::vector<Frame>& frames, const Radiance& merged, const Radiance& black) {
  const double longest = seconds(std::ranges::max(frames, {}, &Frame::exposure).exposure);
  double worst = 0;
  for (std::size_t i = 0; i < merged.mean.values().size(); ++i) {
    double value = 0, time = 0, sum = 0, weights = 0;
    const auto usable = [&](const Frame& f) { return f.raw[i] < kSensor.saturation_code(); };
    const auto electrons = [&](const Frame& f) { return (f.raw[i] - kSensor.pedestal()) / kSensor.gain(); };
    for (const Frame& f : frames) {
      if (!usable(f)) continue;
      value += electrons(f);
      time += seconds(f.exposure);
    }
    const double rate = std::max(value / time, -kSensor.floor_variance() / 2 / longest);
    for (const Frame& f : frames) {
      if (!usable(f)) continue;
      const double t = seconds(f.exposure);
      const double w = t * t / (rate * t + kSensor.floor_variance());
      sum += w * electrons(f) / t;
      weights += w;
    }
    if (merged.valid.values()[i] == 0 || weights == 0) continue;
    const double truth = sum / weights - static_cast<double>(black.mean.values()[i]);
    worst = std::max(worst, std::abs(merged.mean.values()[i] - truth) * std::sqrt(weights));
  }
  return worst;
}

/// A bracket of a ramp over five decades: every pixel another mix of saturated frames.
test::SimulatedBracket ramp(std::size_t values, int frames) {
  using namespace std::chrono_literals;
  test::Random random(1);
  auto bracket = test::photograph_uniform(kSensor, test::exposure_ladder(frames, 8, 100ms), 0, 0, random);
  std::vector<std::uint16_t> period(std::size_t{997} * 16);
  for (std::size_t k = 0; k < bracket.codes.size(); ++k) {
    for (std::size_t i = 0; i < period.size(); ++i) {
      const double electrons = std::pow(10, 1 + 5.0 * static_cast<double>(i % 997) / 997);
      period[i] = test::sample(kSensor, electrons * seconds(bracket.exposures[k]) / 0.1, random);
    }
    bracket.codes[k].resize(values);
    for (std::size_t i = 0; i < values; ++i) bracket.codes[k][i] = period[i % period.size()];
  }
  return bracket;
}

struct Item {
  std::string name;
  double bytes;
  std::function<void()> run;
  std::vector<double> times{};

  double best() const { return *std::min_element(times.begin(), times.end()); }
  double median() const {
    std::vector<double> sorted = times;
    return symrig::median(sorted);
  }
};

/// a = b + s c over arrays far larger than any cache, one piece a call.
class Triad {
 public:
  explicit Triad(std::size_t piece) : piece_(piece) {}
  void run() {
    if (begin_ + piece_ > a_.size()) begin_ = 0;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin_, begin_ + piece_, std::size_t{1} << 15),
                      [this](const auto& range) {
                        float* a = a_.data();
                        const float *b = b_.data(), *c = c_.data();
                        for (std::size_t i = range.begin(); i < range.end(); ++i) a[i] = b[i] + 3.0F * c[i];
                      });
    begin_ += piece_;
  }

 private:
  std::size_t piece_, begin_ = 0;
  std::vector<float> a_ = std::vector<float>(std::size_t{32} << 20, 1),
                     b_ = std::vector<float>(std::size_t{32} << 20, 2),
                     c_ = std::vector<float>(std::size_t{32} << 20, 3);
};

/// Ties the threads of an arena to one processor each: a merge of 2 ms is over before the kernel has moved a
/// woken thread away from a busy one.
class Pin final : public tbb::task_scheduler_observer {
 public:
  explicit Pin(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) { observe(true); }
  ~Pin() override { observe(false); }
  Pin(const Pin&) = delete;
  Pin& operator=(const Pin&) = delete;
  void on_scheduler_entry(bool /*is_worker*/) override {
    cpu_set_t processor;
    CPU_ZERO(&processor);
    CPU_SET(static_cast<unsigned>(tbb::this_task_arena::current_thread_index()), &processor);
    sched_setaffinity(0, sizeof processor, &processor);
  }
};

/// One photograph size: merges and triads of as many bytes, one and two threads, alternating.
void measure(Grid grid, int channels, int frames, int rounds) {
  const auto values = static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels);
  const auto bracket = ramp(values, frames);
  const auto exposures = bracket.frames();
  const Radiance black{Image<float>(grid, channels, 10.0F), Image<float>(grid, channels, 1.0F),
                       Image<std::uint8_t>(grid, channels, 1)};
  Image<std::uint8_t> dead(grid);
  dead.at(grid.rows / 2, grid.cols / 2) = 1;
  Radiance merged;
  const auto merge = [&] {
    if (!merge_into(exposures, grid, channels, kSensor, {.black = &black, .dead = &dead}, merged))
      std::exit(4);
  };
  // 2 B a frame; black and result 4 + 4 + 1 each; the mask of dead pixels 1 for all channels.
  const double bytes = static_cast<double>(values) * (2 * frames + 18) + static_cast<double>(grid.size());
  Triad triad(static_cast<std::size_t>(bytes / 12));
  tbb::task_arena one(1), two(2);
  const Pin pin_one(one), pin_two(two);
  constexpr std::size_t kBatch = 8;  // photographs, each into a result of its own, as a rig merges them
  const auto batch = [&] {
    std::vector<Radiance> results(kBatch);
    tbb::parallel_for(std::size_t{0}, kBatch, [&](std::size_t i) {
      if (!merge_into(exposures, grid, channels, kSensor, {.black = &black, .dead = &dead}, results[i]))
        std::exit(4);
    });
  };
  std::vector<Item> items;
  items.push_back({"triad 1 thread", bytes, [&] { one.execute([&] { triad.run(); }); }});
  items.push_back({"merge 1 thread", bytes, [&] { one.execute(merge); }});
  items.push_back({"triad 2 threads", bytes, [&] { two.execute([&] { triad.run(); }); }});
  items.push_back({"merge 2 threads", bytes, [&] { two.execute(merge); }});
  items.push_back({"batch 2 threads", kBatch * bytes, [&] { two.execute(batch); }});
  for (int round = 0; round < rounds; ++round)
    for (Item& item : items) {
      const Stopwatch watch;
      item.run();
      item.times.push_back(watch.seconds());
    }
  const auto of = [&](std::size_t a, std::size_t b) { return items[b].best() / items[a].best(); };
  std::printf("%d x %d x %d, %d exposures, %d rounds, %.1f MB: error %.1e sigma\n", grid.rows, grid.cols,
              channels, frames, rounds, 1e-6 * bytes, error_in_sigmas(exposures, merged, black));
  for (const Item& item : items)
    std::printf("  %-16s best %7.3f ms %6.1f GB/s   median %7.3f ms %6.1f GB/s\n", item.name.c_str(),
                1e3 * item.best(), 1e-9 * bytes / item.best(), 1e3 * item.median(),
                1e-9 * bytes / item.median());
  std::printf("  a photograph of a batch, with its allocation: best %.3f ms, median %.3f ms\n",
              1e3 * items[4].best() / kBatch, 1e3 * items[4].median() / kBatch);
  std::printf("  merge / triad, 1 thread %.2f; 2 threads %.2f; merge 2 threads / 1 %.2f (best of each)\n",
              of(1, 0), of(3, 2), of(3, 1));
}

/// Frames added one by one (MergeStream), two threads: input pixels a second, beginning and end included.
void measure_stream(Grid grid, int frames, int rounds) {
  const std::size_t values = grid.size();
  const auto bracket = ramp(values, frames);
  const auto all = bracket.frames();
  tbb::task_arena two(2);
  const Pin pin(two);
  // 2 B of the frame; four sums of 4 B, read and written.
  const double bytes = static_cast<double>(values) * frames * 34;
  Triad triad(static_cast<std::size_t>(bytes / 12));
  Item ceiling{"triad", bytes, [&] { two.execute([&] { triad.run(); }); }};
  Item stream{"stream", bytes, [&] {
                two.execute([&] {
                  auto merging = MergeStream::begin(grid, 1, kSensor, bracket.exposures);
                  if (!merging) std::exit(4);
                  for (const Frame& frame : all)
                    if (!merging->add(frame)) std::exit(4);
                  if (!merging->finish()) std::exit(4);
                });
              }};
  for (int round = 0; round < rounds; ++round)
    for (Item* item : {&ceiling, &stream}) {
      const Stopwatch watch;
      item->run();
      item->times.push_back(watch.seconds());
    }
  const double pixels = static_cast<double>(values) * frames;
  std::printf("frame by frame, %d x %d, %d frames: %.0f MPix/s best, %.0f median; %.2f of triad's speed\n",
              grid.rows, grid.cols, frames, 1e-6 * pixels / stream.best(), 1e-6 * pixels / stream.median(),
              ceiling.best() / stream.best());
}

/// Four exposures, each 8 times the one before; levels in electrons of the longest.
void compare_weights() {
  using namespace std::chrono_literals;
  constexpr Grid kField{400, 500};
  std::printf(
      "level e-   share of the Cramer-Rao bound: merge  frame by frame   dB above: Debevec  Robertson\n");
  test::Random random(41);
  for (const double level : {10., 100., 1e3, 1e4, 3e4, 1e5, 1e6, 5e6}) {
    const double rate = level / 0.1;
    const auto bracket =
        test::photograph_uniform(kSensor, test::exposure_ladder(4, 8, 100ms), rate, 200'000, random);
    const auto merged = merge(bracket.frames(), kField, 1, kSensor);
    auto stream = MergeStream::begin(kField, 1, kSensor, bracket.exposures);
    if (!merged || !stream) std::exit(4);
    for (const Frame& frame : bracket.frames())
      if (!stream->add(frame)) std::exit(4);
    const auto streamed = stream->finish();
    if (!streamed) std::exit(4);
    const double ours = test::mean_square_error(*merged, rate);
    const double bound = test::cramer_rao(kSensor, bracket.exposures, rate);
    const auto above = [&](const test::Weight& weight) {
      return 10 * std::log10(test::mean_square_error(kSensor, bracket.frames(), rate, weight) / ours);
    };
    std::printf("%8.0f   %35.3f  %14.3f   %17.2f  %9.2f\n", level, bound / ours,
                bound / test::mean_square_error(*streamed, rate), above(test::debevec_weight(kSensor)),
                above(test::robertson_weight(kSensor)));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[2]) == "keep") {
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 2'000'000'000);
    mallopt(M_ARENA_MAX, 1);
  }
  const int rounds = argc > 1 ? std::max(1, static_cast<int>(std::strtol(argv[1], nullptr, 10))) : 60;
  measure({1000, 984}, 3, 4, rounds);
  measure({310, 350}, 1, 4, 10 * rounds);
  measure_stream({1000, 1000}, 8, rounds);
  compare_weights();
  return 0;
}
