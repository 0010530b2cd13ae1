// SPDX-License-Identifier: Apache-2.0
// A polish that is dealt over processes, here threads, against one of all of T.
#include "acquisition/refine/polish.hpp"
#include "acquisition/refine/polish_jacobian.hpp"
#include "assert_ok.hpp"
#include "dense_scene.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <barrier>
#include <cmath>
#include <limits>
#include <numeric>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::polish_team_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::Workbench;

constexpr Grid kGrid{12, 10};
constexpr std::size_t kPixels = 120;
constexpr int kSteps = 8;  ///< conjugate-gradient steps of a step
constexpr double kEpsilon = 0x1p-24;

/// What threads share. Each sum goes through the processes in another order.
class Exchange {
 public:
  explicit Exchange(std::size_t processes)
      : values_(processes), failures_(processes), barrier_(std::ssize(values_)) {}

  void add_up(std::size_t process, std::span<double> values) {
    values_[process].assign(values.begin(), values.end());
    barrier_.arrive_and_wait();
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = 0;
      for (std::size_t n = 0; n < values_.size(); ++n)
        values[k] += values_[(n * (k % 2 == 0 ? 1 : values_.size() - 1) + process + k) % values_.size()][k];
    }
    barrier_.arrive_and_wait();
  }
  Result<void> all(std::size_t process, const Result<void>& mine) {
    failures_[process] = mine;
    barrier_.arrive_and_wait();
    Result<void> first;
    for (const Result<void>& one : failures_)
      if (first && !one) first = one;
    barrier_.arrive_and_wait();
    return first;
  }

 private:
  std::vector<std::vector<double>> values_;
  std::vector<Result<void>> failures_;
  std::barrier<> barrier_;
};

class ThreadTeam final : public PolishTeam {
 public:
  ThreadTeam(Exchange& exchange, std::size_t process, std::size_t parts, std::size_t first)
      : exchange_(exchange), process_(process), parts_(parts), first_(first) {}
  std::size_t parts() const override { return parts_; }
  std::size_t first() const override { return first_; }
  void add_up(std::span<double> values) const override { exchange_.add_up(process_, values); }
  Result<void> all(const Result<void>& mine) const override { return exchange_.all(process_, mine); }

 private:
  Exchange& exchange_;
  std::size_t process_, parts_, first_;
};

/// A log that one process cannot read from photograph `last` on.
class TornLog : public PhotographLog {
 public:
  TornLog(const PhotographLog& log, std::int64_t last) : log_(log), last_(last) {}
  Grid grid() const override { return log_.grid(); }
  int channels() const override { return log_.channels(); }
  std::int64_t size() const override { return log_.size(); }
  Result<void> append_run(std::span<const Pattern>, std::span<const Radiance>, const ProbeCost&) override {
    return Error{ErrorCode::io, "read only", ""};
  }
  Result<Pattern> pattern(std::int64_t k) const override { return log_.pattern(k); }
  Result<Radiance> photograph(std::int64_t k) const override { return log_.photograph(k); }
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override {
    if (k >= last_) return Error{ErrorCode::io, "the disk is gone", "look for it"};
    return log_.read(k, to);
  }
  Result<ProbeCost> spent(std::int64_t k) const override { return log_.spent(k); }

 private:
  const PhotographLog& log_;
  std::int64_t last_;
};

/// Noisy photographs of two planes, and a first guess of their T: positive numbers everywhere, so that sums
/// of magnitudes are the sums themselves.
class PolishTeamTest : public testing::Test {
 protected:
  PolishTeamTest() : scene_(tests::facing_planes(kGrid)), probe_(scene_, 0.002), bench_(probe_) {
    take();
    guess();
  }

  /// 40 random pictures, more than two batches, and each sixteenth of the grid.
  void take() {
    std::vector<LitBlocks> patterns;
    Random random(5);
    for (int k = 0; k < 40; ++k) {
      LitBlocks lit;
      for (std::int32_t t = 0; t < std::int32_t{kPixels}; ++t)
        if (random.uniform() < 0.4) lit.push_back({t, t + 1});
      patterns.push_back(lit);
    }
    for (const Block& block : bench_.tree.level(2)) patterns.push_back({{block.begin, block.end}});
    ASSERT_OK(bench_.photographer.take("all", patterns));
  }

  void guess() {
    Random random(11);
    const auto blocks = bench_.tree.level(2);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        std::vector<float> factors(static_cast<std::size_t>(blocks[i].size() + blocks[j].size()));
        for (float& factor : factors) factor = static_cast<float>(0.01 + 0.04 * random.uniform());
        bench_.known.add_leaf(blocks[i].begin, blocks[i].end, blocks[j].begin, blocks[j].end, 2, factors);
      }
    for (std::int32_t t = 0; t < std::int32_t{kPixels}; ++t) {
      const auto value = static_cast<float>(0.4 + 0.4 * random.uniform());
      bench_.known.add_scalar(t, t, std::span(&value, 1));
    }
  }

  /// Part k of n of the guess: a run of leaves, and a run of entries.
  KnownTransport part_of(std::size_t k, std::size_t n) const {
    const KnownTransport& whole = bench_.known;
    KnownTransport part(bench_.tree, 1);
    const auto leaves = whole.leaves();
    for (std::size_t at = leaves.size() * k / n; at < leaves.size() * (k + 1) / n; ++at) {
      const KnownLeaf& leaf = leaves[at];
      const LeafSides sides = whole.sides(leaf, 0);
      std::vector<float> factors(sides.a.begin(), sides.a.end());
      factors.insert(factors.end(), sides.b.begin(), sides.b.end());
      part.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.level, factors);
    }
    const auto scalars = whole.scalars();
    for (std::size_t at = scalars.size() * k / n; at < scalars.size() * (k + 1) / n; ++at)
      part.add_scalar(scalars[at].row, scalars[at].col, whole.scalar_values().subspan(at, 1));
    return part;
  }

  Polish::Photographs photographs() const {
    return {kPixels, {{0, 20}, {22, bench_.photographer.taken()}}, {1e-6}};
  }

  /// What one process ends with.
  struct Ended {
    Result<Polish::Outcome> outcome = Polish::Outcome{};
    std::vector<float> factors, scalars;
  };

  static void keep_numbers(std::span<const KnownTransport> parts, Ended& ended) {
    for (const KnownTransport& part : parts) {
      ended.factors.insert(ended.factors.end(), part.factors().begin(), part.factors().end());
      ended.scalars.insert(ended.scalars.end(), part.scalar_values().begin(), part.scalar_values().end());
    }
  }

  /// Each process in a thread of its own. torn: the process whose log fails, or none.
  std::vector<Ended> dealt(std::size_t processes, std::size_t parts, std::int64_t readable,
                           std::size_t torn = 99) {
    Exchange exchange(processes);
    std::vector<Ended> ended(processes);
    const TornLog torn_log(*bench_.log, readable);
    std::vector<std::thread> threads;
    for (std::size_t process = 0; process < processes; ++process)
      threads.emplace_back([&, process] {
        const std::size_t first = parts * process / processes, last = parts * (process + 1) / processes;
        std::vector<KnownTransport> mine;
        for (std::size_t k = first; k < last; ++k) mine.push_back(part_of(k, parts));
        const PhotographLog* const log = process == torn ? &torn_log : bench_.log.get();
        const Photographer photographer(bench_.logged, log, bench_.tree, {});
        const ThreadTeam team(exchange, process, parts, first);
        Polish polish(team, mine, photographer, photographs());
        ended[process].outcome = polish.step(kSteps);
        keep_numbers(mine, ended[process]);
      });
    for (std::thread& thread : threads) thread.join();
    return ended;
  }

  static Ended joined(const std::vector<Ended>& processes) {
    Ended all;
    all.outcome = processes[0].outcome;
    for (const Ended& one : processes) {
      all.factors.insert(all.factors.end(), one.factors.begin(), one.factors.end());
      all.scalars.insert(all.scalars.end(), one.scalars.begin(), one.scalars.end());
    }
    return all;
  }

  Ended serial() {
    KnownTransport whole = part_of(0, 1);
    Polish polish(bench_.facts, bench_.photographer, whole, photographs().ranges, photographs().misfit);
    Ended ended;
    ended.outcome = polish.step(kSteps);
    keep_numbers(std::span(&whole, 1), ended);
    return ended;
  }

  DenseTransport scene_;
  DenseProbe probe_;
  Workbench bench_;
  static constexpr std::int64_t kWhole = std::numeric_limits<std::int64_t>::max();
};

TEST_F(PolishTeamTest, any_number_of_processes_gives_the_same_bits) {
  const Ended one = joined(dealt(1, 12, kWhole));
  ASSERT_OK(one.outcome);
  EXPECT_LT(one.outcome->after, one.outcome->before / 2) << "a step that moves little tells little";
  for (const std::size_t processes : {2U, 3U, 4U, 5U, 12U}) {
    const std::vector<Ended> all = dealt(processes, 12, kWhole);
    for (const Ended& process : all) {
      ASSERT_OK(process.outcome);
      EXPECT_EQ(process.outcome->before, one.outcome->before) << processes;
      EXPECT_EQ(process.outcome->after, one.outcome->after) << processes;
    }
    EXPECT_EQ(joined(all).factors, one.factors) << processes;
    EXPECT_EQ(joined(all).scalars, one.scalars) << processes;
  }
}

TEST_F(PolishTeamTest, one_part_is_the_polish_of_a_capture) {
  const Ended whole = serial(), one = joined(dealt(1, 1, kWhole));
  ASSERT_OK(one.outcome);
  EXPECT_EQ(one.outcome->after, whole.outcome->after);
  EXPECT_EQ(one.factors, whole.factors);
  EXPECT_EQ(one.scalars, whole.scalars);
}

/// |v|² with the diagonal of the equations as weights.
double squares(std::span<const float> v, std::span<const float> diagonal) {
  double sum = 0;
  for (std::size_t n = 0; n < v.size(); ++n) {
    const double x = v[n];
    sum += x * x * static_cast<double>(diagonal[n]);
  }
  return sum;
}

// Parts group the same float sums otherwise. J, T, patterns and weights are not negative, so one product
// differs by η = 2 (|J| + leaves + parts + 4) ε of itself at most (DealtTransport). In the norm of the
// diagonal D, Jᵀ W J has eigenvalues from 0 to λ and Levenberg adds 0.1: solutions amplify a change of the
// right side by at most 10. So, to first order, the right side √λ η |T p|_W and each of the k products
// η (λ + 0.1) |move|_D move the solution by at most ten times their sum. The step then scales whole leaves,
// by at most one.
TEST_F(PolishTeamTest, parts_differ_from_the_whole_by_the_stated_rounding) {
  const Ended whole = serial(), parts = joined(dealt(1, 12, kWhole));
  ASSERT_OK(parts.outcome);
  const KnownTransport start = part_of(0, 1);
  std::vector<float> diagonal, move, difference;
  double seen = 0;  // |T p|²_W
  std::vector<PolishBatch> batches;
  for (const LogRange& range : photographs().ranges)
    ASSERT_OK(bench_.photographer.read(
        range.first, range.last - range.first, [&](std::int64_t, std::span<TreePhotograph> photographs) {
          std::vector<TreePhotograph> left(photographs.begin(), photographs.end());
          for (TreePhotograph& one : left) one.mean.assign(kPixels, 0.F);
          start.subtract_from(left);
          for (TreePhotograph& one : left)
            for (std::size_t t = 0; t < kPixels; ++t) {
              float& w = one.variance[t];
              w = static_cast<float>(1 / (static_cast<double>(w) + 1e-6));
              seen += static_cast<double>(w) * std::pow(one.mean[t], 2);
            }
          for (std::size_t first = 0; first < left.size(); first += 16)
            batches.emplace_back(
                std::span(left).subspan(first, std::min<std::size_t>(16, left.size() - first)));
        }));
  const PolishJacobian jacobian(start, 1);
  PolishNumbers d(start.factors().size() + start.scalar_values().size());
  jacobian.add_diagonal(batches, d);
  // λ by power iteration on D⁻¹ Jᵀ W J, whose entries are not negative: it grows to λ from below.
  PolishNumbers v(d.size(), 1.F);
  double lambda = 0;
  for (int round = 0; round < 60; ++round) {
    PolishNumbers next(d.size());
    jacobian.gather(batches, jacobian.image(batches, jacobian.tangents(v)), next);
    const double before = squares({v.data(), v.size()}, {d.data(), d.size()});
    for (std::size_t n = 0; n < d.size(); ++n) next[n] = d[n] > 0 ? next[n] / d[n] : 0;
    lambda = std::sqrt(squares({next.data(), next.size()}, {d.data(), d.size()}) / before);
    v = next;
    for (float& x : v) x /= static_cast<float>(lambda);
  }
  const auto append = [&](const std::vector<float>& from, const std::vector<float>& to,
                          std::span<const float> at) {
    for (std::size_t n = 0; n < from.size(); ++n) {
      difference.push_back(to[n] - from[n]);
      move.push_back(from[n] - at[n]);
    }
  };
  append(whole.factors, parts.factors, start.factors());
  append(whole.scalars, parts.scalars, start.scalar_values());
  const std::span<const float> weights(d.data(), d.size());
  const double moved = std::sqrt(squares(move, weights)), off = std::sqrt(squares(difference, weights));
  const double longest = 3 * 3, leaves = 16 + 1, parts_count = 12;
  const double eta = 2 * (longest + leaves + parts_count + 4) * kEpsilon;
  const double most =
      10 * (std::sqrt(lambda) * eta * std::sqrt(seen) + kSteps * eta * (lambda + 0.1) * moved);
  RecordProperty("off", std::to_string(off));
  EXPECT_GT(off, 0) << "the same bits by chance: parts were not added up part by part";
  EXPECT_LE(off, most) << "λ " << lambda << ", move " << moved;
  EXPECT_LE(most, moved / 2) << "the bound tells nothing";
}

TEST_F(PolishTeamTest, a_log_that_one_process_cannot_read_stops_all_and_moves_nothing) {
  const Ended before = [&] {
    const KnownTransport whole = part_of(0, 1);
    Ended ended;
    keep_numbers(std::span(&whole, 1), ended);
    return ended;
  }();
  for (const std::int64_t readable : {std::int64_t{0}, std::int64_t{25}, std::int64_t{55}})
    for (const std::size_t torn : {0U, 2U}) {
      const std::vector<Ended> all = dealt(3, 12, readable, torn);
      for (const Ended& process : all) {
        ASSERT_FALSE(process.outcome);
        EXPECT_EQ(process.outcome.error().what, "the disk is gone");
      }
      EXPECT_EQ(joined(all).factors, before.factors) << readable;
      EXPECT_EQ(joined(all).scalars, before.scalars) << readable;
    }
}

TEST(ExactSums, have_the_same_bits_in_any_order_and_lose_next_to_nothing) {
  Random random(3);
  std::vector<float> numbers(1000);
  for (float& v : numbers)
    v = static_cast<float>(random.sign() * std::exp(20 * (random.uniform() - 1)));  // 2⁻²⁹ to 1
  double most = 0, plain = 0;
  for (const float v : numbers) most += std::abs(static_cast<double>(v));
  const ExactSums exact(most);
  const auto sum = [&] {
    return std::accumulate(numbers.begin(), numbers.end(), 0.0,
                           [&](double s, float v) { return s + exact.rounded(v); });
  };
  const double first = sum();
  for (const float v : numbers) plain += static_cast<double>(v);
  EXPECT_NEAR(first, plain, 1000 * most * (0x1p-50 + 0x1p-53));
  for (int round = 0; round < 20; ++round) {
    for (std::size_t k = numbers.size() - 1; k > 0; --k)
      std::swap(numbers[k], numbers[static_cast<std::size_t>(random.uniform() * static_cast<double>(k + 1))]);
    EXPECT_EQ(sum(), first);
  }
}

TEST(ExactSums, of_nothing_are_nothing) {
  EXPECT_EQ(ExactSums(0).rounded(0), 0);
}

/// T of positive numbers under full light reaches its bound, and no pattern exceeds it.
TEST_F(PolishTeamTest, most_light_bounds_every_photograph) {
  std::vector<TreePhotograph> full(1);
  full[0].pattern.assign(kPixels, 1.F);
  full[0].mean.assign(kPixels, 0.F);
  bench_.known.subtract_from(full);
  float brightest = 0;
  for (const float v : full[0].mean) brightest = std::max(brightest, -v);
  const double most = most_light(bench_.known, 1, kPixels);
  EXPECT_NEAR(most, static_cast<double>(brightest), 200 * kEpsilon * most);
  for (float& v : bench_.known.change_factors()) v = -v;  // both factors: T is the same
  EXPECT_EQ(most_light(bench_.known, 1, kPixels), most);
}

TEST_F(PolishTeamTest, most_change_bounds_the_image_of_a_direction) {
  Random random(2);
  PolishNumbers direction(bench_.known.factors().size() + bench_.known.scalar_values().size());
  for (float& v : direction) v = random.sign();
  std::vector<TreePhotograph> lit(16);
  for (TreePhotograph& one : lit) {
    one.pattern.resize(kPixels);
    for (float& v : one.pattern) v = random.uniform() < 0.5 ? 1.F : 0.F;
    one.variance.assign(kPixels, 1.F);
  }
  lit[0].pattern.assign(kPixels, 1.F);
  const std::vector<PolishBatch> batch{PolishBatch(lit)};
  const PolishJacobian jacobian(bench_.known, 1);
  const auto largest = [&](const PolishNumbers& along) {
    float found = 0;
    std::vector<PolishSamples> seen;
    jacobian.respond(batch, jacobian.tangents(along), seen);
    for (const float v : seen[0]) found = std::max(found, std::abs(v));
    return static_cast<double>(found);
  };
  EXPECT_LE(largest(direction), most_change(bench_.known, 1, kPixels, direction));
  for (float& v : direction) v = 1;  // now nothing cancels, and full light reaches the bound
  const double most = most_change(bench_.known, 1, kPixels, direction);
  EXPECT_NEAR(largest(direction), most, 400 * kEpsilon * most);
}

}  // namespace
}  // namespace symrig::acquisition::polish_team_test
