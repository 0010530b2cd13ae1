// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/level_search.hpp"

#include "acquisition/search/colouring.hpp"
#include "acquisition/search/forecasts.hpp"
#include "acquisition/tree/tree_photograph.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

// Operations for Work: whether a photograph lights a node, and to keep or to compare a sample of it.
// To colour a node: its blocks' partners and their partners, some hundred.
constexpr std::int64_t kLook = 4, kRecord = 4, kSchedule = 1024;

/// Calls use(side) for each side of the node that the shot lights.
template <class Use>
void for_lit_sides(const Node& node, const std::vector<char>& lit, const Use& use) {
  if (lit[node.col] != 0) use(NodeLevel::Side::col);
  if (!node.diagonal() && lit[node.row] != 0) use(NodeLevel::Side::row);
}

std::vector<std::vector<char>> lit_blocks(std::span<const Shot> shots, std::int32_t blocks) {
  std::vector<std::vector<char>> lit(shots.size(), std::vector<char>(blocks));
  for (std::size_t k = 0; k < shots.size(); ++k)
    for (const std::int32_t b : shots[k].blocks) lit[k][b] = 1;
  return lit;
}

std::vector<std::span<float>> means_of(std::span<TreePhotograph> photographs) {
  std::vector<std::span<float>> means;
  for (TreePhotograph& photograph : photographs) means.emplace_back(photograph.mean);
  return means;
}

std::vector<Shot> shots_of(const std::vector<std::vector<std::int32_t>>& colours, const NodeLevel& level) {
  std::vector<Shot> shots;
  for (const auto& colour : colours) {
    for (int slot = 0; slot < 4; ++slot) {
      Shot shot{{}, slot};
      for (const std::int32_t b : colour)
        if (slot < level.block(b).children) shot.blocks.push_back(b);
      if (!shot.blocks.empty()) shots.push_back(std::move(shot));
    }
  }
  return shots;
}

}  // namespace

/// Samples of the blocks of a node, in all channels.
std::int64_t LevelSearch::samples(NodeIndex n) const {
  const Node& of = node(n);
  return std::int64_t{facts_.channels} * (unknown_.block(of.row).size() + unknown_.block(of.col).size());
}

LevelSearch::Split LevelSearch::doubtful_and_predicted() const {
  Split split;
  for (NodeIndex n = 0; n < std::ssize(unknown_.nodes()); ++n)
    (expected_to_pass(node(n)) ? split.predicted : split.doubtful).push_back(n);
  return split;
}

Result<std::vector<Tested>> LevelSearch::run(const Left& left) {
  auto [doubtful, predicted] = doubtful_and_predicted();
  std::vector<Tested> tested;
  while (!doubtful.empty()) {
    const std::int64_t budget = left();
    rounds_.push_back(schedule_within(budget, std::move(doubtful), predicted));
    if (worth_ && !worth_(std::ssize(rounds_.back().shots), later().least)) return give_up();
    for (const NodeIndex n : predicted) accept(n);
    predicted.clear();
    forecast_progress(budget - std::ssize(rounds_.back().shots));
    SYMRIG_CHECK(photograph(rounds_.back()));
    SYMRIG_CHECK(subtract_again());
    tested = judge();
    learn(std::span(tested).last(rounds_.back().tested.size()));
    const auto light = unknown_.diagonal_light(rounds_.back().tested);
    if (light.lit > 0 && rounds_.size() == 1)
      found_.beside = static_cast<float>(std::clamp(light.beside / light.lit, 0.0, 1.0));
    if (cut_short_ && !worth_another_round(left)) break;
    cut_short_ = false;
    doubtful = take_back();
  }
  for (const NodeIndex n : predicted) accept(n);
  return tested;
}

/// After a round that a budget cut: it may have taken less than was feared.
bool LevelSearch::worth_another_round(const Left& left) const {
  constexpr std::int64_t kFewest = 4, kShare = 16;  // of the level's photographs
  return !rounds_.back().shots.empty() && left() >= std::max(kFewest, photographs() / kShare);
}

/// Nothing of this level is known.
std::vector<Tested> LevelSearch::give_up() {
  given_up_ = true;
  rounds_.pop_back();
  for (const Accepted& at : accepted_) found_.known.remove_leaf(at.leaf);
  accepted_.clear();
  return {};
}

/// Photographs of the first round, if they were taken now.
std::int64_t LevelSearch::foreseen() const {
  auto [doubtful, predicted] = doubtful_and_predicted();
  return doubtful.empty() ? 0 : std::ssize(schedule(std::move(doubtful), predicted).shots);
}

std::int64_t LevelSearch::photographs() const {
  std::int64_t sum = 0;
  for (const Round& round : rounds_) sum += std::ssize(round.shots);
  return sum;
}

LevelEvidence LevelSearch::evidence(std::span<const Tested> tested) const {
  LevelEvidence level{.level = unknown_.level(), .patterns = photographs()};
  double excess = 0;
  double energy = 0;
  for (const Tested& t : tested) {
    if (node(t.node).diagonal()) continue;
    ++level.tested;
    level.leaves += t.leaf ? 1 : 0;
    excess += t.total.excess();
    energy += t.total.energy();
  }
  level.unexplained = energy > 0 ? std::min(1.0, excess / energy) : 0;
  return level;
}

/// Photographs of later levels, once the round planned last is taken.
UnitsToCome LevelSearch::later() const {
  const std::vector<double> children = children_per_block(facts_.tree);
  const std::size_t level = unknown_.level();
  const std::int64_t round = std::ssize(rounds_.back().shots);
  return forecast_later({.level = unknown_.level(),
                         .planned = found_.patterns_per_level[level + 1] + round,
                         .before = found_.patterns_per_level[level],
                         .taken = photographer_.taken() + round,
                         .direct_share = facts_.options.economy.direct_share,
                         .children = children});
}

/// Reports to progress how many photographs later levels may take. budget: of photographs, after this round.
void LevelSearch::forecast_progress(std::int64_t budget) {
  UnitsToCome later = this->later();
  if (later.known()) later = {std::min(later.least, budget), std::min(later.most, budget)};
  photographer_.expect_later(later);
}

/// A block with itself is accepted only where a budget ends. Then it is taken for direct light: a rank-1 leaf
/// would spread direct light over the whole block. One that was a leaf before becomes that leaf again.
void LevelSearch::accept(NodeIndex n) {
  if (node(n).diagonal() && !node(n).distrusted)
    add_direct(facts_, found_.known, unknown_, node(n));
  else
    accepted_.push_back({n, add_leaf(facts_, found_.known, unknown_, node(n))});
  facts_.options.work.add(kRecord * samples(n));
}

bool LevelSearch::expected_to_pass(const Node& of) const {
  return facts_.options.economy.decay > 0 && found_.decay.squared() * of.undecayed <= facts_.tolerance();
}

/// Colours the blocks of the level: no two blocks of one colour share a block whose transport with both is
/// unknown. Lights the children of each colour one after another [Garg06 §5.2]. Predicted nodes that fit into
/// a colour move to the tested, those nearest to failing first.
LevelSearch::Round LevelSearch::schedule(std::vector<NodeIndex> doubtful,
                                         std::vector<NodeIndex>& predicted) const {
  std::vector<std::pair<std::int32_t, std::int32_t>> edges;
  edges.reserve(doubtful.size());
  facts_.options.work.add(kSchedule * std::ssize(doubtful));
  for (const NodeIndex n : doubtful) edges.emplace_back(node(n).row, node(n).col);
  if (facts_.options.economy.look_in_the_dark) add_loops(edges);
  Colouring colouring{ConflictGraph(unknown_.block_count(), edges)};
  std::stable_sort(predicted.begin(), predicted.end(),
                   [&](NodeIndex x, NodeIndex y) { return node(x).undecayed > node(y).undecayed; });
  Tally tally(facts_.options.work);
  std::erase_if(predicted, [&](NodeIndex n) {
    tally.add(kSchedule);
    if (!colouring.add(node(n).row, node(n).col)) return false;
    doubtful.push_back(n);
    return true;
  });
  return {std::move(doubtful), shots_of(colouring.classes(), unknown_), 0};
}

/// Tests as many of the doubtful nodes as the budget has patterns for, those with the largest expected misfit
/// first. The others are accepted as they are.
LevelSearch::Round LevelSearch::schedule_within(std::int64_t budget, std::vector<NodeIndex> doubtful,
                                                std::vector<NodeIndex>& predicted) {
  const std::vector<NodeIndex> passing = predicted;
  Round round = schedule(doubtful, predicted);
  if (std::ssize(round.shots) <= budget) return round;
  cut_short_ = true;
  std::stable_sort(doubtful.begin(), doubtful.end(),
                   [&](NodeIndex x, NodeIndex y) { return node(x).undecayed > node(y).undecayed; });
  std::size_t most = doubtful.size();
  std::size_t least = 0;
  const auto with_first = [&](std::size_t count) {
    predicted = passing;
    predicted.insert(predicted.end(), doubtful.begin() + static_cast<std::ptrdiff_t>(count), doubtful.end());
    return schedule({doubtful.begin(), doubtful.begin() + static_cast<std::ptrdiff_t>(count)}, predicted);
  };
  while (most - least > 1) {
    const std::size_t middle = least + (most - least) / 2;
    (std::ssize(with_first(middle).shots) <= budget ? least : most) = middle;
  }
  return with_first(least);
}

/// Every block becomes its own partner.
void LevelSearch::add_loops(std::vector<std::pair<std::int32_t, std::int32_t>>& edges) const {
  std::vector<char> looped(unknown_.block_count());
  for (const auto& [a, b] : edges)
    if (a == b) looped[a] = 1;
  const std::size_t pairs = edges.size();
  for (std::size_t k = 0; k < pairs; ++k)
    for (const std::int32_t block : {edges[k].first, edges[k].second})
      if (std::exchange(looped[block], 1) == 0) edges.emplace_back(block, block);
}

LitBlocks LevelSearch::lit_ranges(const Shot& shot) const {
  LitBlocks ranges;
  for (const std::int32_t b : shot.blocks) {
    const Block& child = unknown_.child(unknown_.block(b), shot.slot);
    ranges.push_back({child.begin, child.end});
  }
  return ranges;
}

Result<void> LevelSearch::photograph(Round& round) {
  const std::int64_t bytes = unknown_.room(round.tested);
  if (bytes > facts_.options.memory_limit)
    return Error{ErrorCode::limit,
                 "level " + std::to_string(unknown_.level()) + " would need " + std::to_string(bytes >> 20) +
                     " MiB for " + std::to_string(round.tested.size()) + " unknown nodes",
                 "raise the tolerance or use a smaller grid; the scene may not be data-sparse"};
  unknown_.make_room(round.tested);
  std::vector<LitBlocks> patterns;
  for (const Shot& shot : round.shots) patterns.push_back(lit_ranges(shot));
  round.first = photographer_.taken();
  const std::size_t r = rounds_.size() - 1;
  if (r == 0) keep_direct_of(round);
  photographer_.seconds_left().may_spend(share_of_seconds(round));
  SYMRIG_TRY(const std::size_t taken, photographer_.take_in_time(
      "level " + std::to_string(unknown_.level()), patterns,
      [&](std::int64_t first, std::span<TreePhotograph> photographs) {
        subtract_and_record(r, first, photographs);
      },
      // Before the first level, no photograph has shown how dark the dark pixels are. A guess that is too
      // bright would get photographs that show noise there, and blocks would be taken for empty.
      !found_.beside
          ? Photographer::MakePreviews()
          : [&](std::size_t first, std::span<Preview> previews) {
              const auto shots = std::span(round.shots).subspan(first, previews.size());
              preview(r, shots, std::span(patterns).subspan(first, previews.size()), previews);
            }));
  found_.patterns_per_level[static_cast<std::size_t>(unknown_.level()) + 1] +=
      static_cast<std::int64_t>(taken);
  return taken < patterns.size() ? leave_out_rest(round, taken) : Result<void>();
}

/// What this round may take of the budget of seconds that is left. Later levels need about as much for each
/// of their photographs, but only a forecast says how many these are.
double LevelSearch::share_of_seconds(const Round& round) const {
  constexpr double kGenerous = 2, kMost = 0.95;
  const auto shots = static_cast<double>(round.shots.size());
  const UnitsToCome later = this->later();
  const auto levels_left = static_cast<double>(facts_.tree.levels() - 2 - unknown_.level());
  const double more = later.known() ? static_cast<double>(later.least) : levels_left * 2 * shots;
  return std::min(kMost, kGenerous * shots / std::max(1.0, shots + more));
}

/// Blocks with themselves are tested in the first round: its photographs hold their direct light.
void LevelSearch::keep_direct_of(const Round& round) {
  if (facts_.options.economy.direct_share <= 0) return;
  found_.level_light.emplace_back(unknown_.level(),
                                  LogRange{round.first, round.first + std::ssize(round.shots)},
                                  facts_.tree.order().size(), static_cast<std::size_t>(facts_.channels));
}

/// Only the first photographs of the round were taken. Nodes that the others would have lit are accepted
/// untested, like those that a budget of patterns does not reach.
Result<void> LevelSearch::leave_out_rest(Round& round, std::size_t taken) {
  cut_short_ = true;
  std::vector<char> dark(unknown_.block_count());
  for (const Shot& shot : std::span(round.shots).subspan(taken))
    for (const std::int32_t b : shot.blocks) dark[b] = 1;
  round.shots.resize(taken);
  std::erase_if(round.tested, [&](NodeIndex n) {
    if (dark[node(n).row] == 0 && dark[node(n).col] == 0) return false;
    accept(n);
    return true;
  });
  const std::size_t r = rounds_.size() - 1;
  if (r == 0 && !found_.level_light.empty() && found_.level_light.back().level == unknown_.level()) {
    found_.level_light.pop_back();
    keep_direct_of(round);
  }
  return subtract_again(r);
}

/// What photographs of round r will show: known transport and what other rounds measured, and the estimates
/// of the nodes that are tested.
void LevelSearch::preview(std::size_t r, std::span<const Shot> shots, std::span<const LitBlocks> patterns,
                          std::span<Preview> previews) const {
  const std::size_t size = facts_.tree.order().size() * static_cast<std::size_t>(facts_.channels);
  std::vector<std::span<float>> known;
  for (Preview& one : previews) {
    one.known.assign(size, 0);
    one.unknown.assign(size, 0);
    known.emplace_back(one.known);
  }
  found_.known.subtract_lit(patterns, known);
  for (std::size_t other = 0; other < rounds_.size(); ++other)
    if (other != r) subtract_measured(rounds_[other].tested, shots, known);
  const auto lit = lit_blocks(shots, unknown_.block_count());
  tbb::parallel_for(std::size_t{0}, shots.size(), [&](std::size_t k) {
    for (float& value : known[k]) value = -value;
    Tally tally(facts_.options.work);
    for (const NodeIndex n : rounds_[r].tested) {
      tally.add(kLook);
      for_lit_sides(node(n), lit[k], [&](NodeLevel::Side side) {
        unknown_.add_estimate(node(n), side, shots[k].slot, *found_.beside, previews[k].unknown);
        tally.add(samples(n));
      });
    }
  });
}

/// Takes what is known out of photographs of round r and keeps what is left as evidence. Where a node of one
/// round shines into a photograph of another, what its own round measured is taken out too.
void LevelSearch::subtract_and_record(std::size_t r, std::int64_t first,
                                      std::span<TreePhotograph> photographs) {
  const Round& round = rounds_[r];
  add_shift_variance(facts_.tree, kNotDescribed * facts_.residual_shift, photographs);
  const auto shots = std::span(round.shots).subspan(first - round.first, photographs.size());
  const auto means = means_of(photographs);
  if (photographer_.hands_on_few()) {
    std::vector<LitBlocks> patterns;
    for (const Shot& shot : shots) patterns.push_back(lit_ranges(shot));
    found_.known.subtract_lit(patterns, means);
  } else {
    found_.known.subtract_from(photographs);
  }
  for (std::size_t other = 0; other < rounds_.size(); ++other)
    if (other != r) subtract_measured(rounds_[other].tested, shots, means);
  record(round.tested, shots, photographs);
  if (r == 0 && facts_.options.economy.direct_share > 0)
    keep_direct(shots, photographs, found_.level_light.back());
}

/// The rounds before the last one, now that more is known of what shone into them.
Result<void> LevelSearch::subtract_again() {
  for (std::size_t r = rounds_.size() - 1; r-- > 0;) SYMRIG_CHECK(subtract_again(r));
  return {};
}

Result<void> LevelSearch::subtract_again(std::size_t r) {
  return photographer_.read(rounds_[r].first, std::ssize(rounds_[r].shots),
                            [&](std::int64_t first, std::span<TreePhotograph> photographs) {
                              subtract_and_record(r, first, photographs);
                            });
}

/// Direct light is unknown where a block with itself is tested.
void LevelSearch::keep_direct(std::span<const Shot> shots, std::span<const TreePhotograph> photographs,
                              LevelLight& light) const {
  std::vector<char> unknown(unknown_.block_count());
  for (const NodeIndex n : rounds_[0].tested)
    if (node(n).diagonal()) unknown[node(n).row] = 1;
  for (std::size_t k = 0; k < shots.size(); ++k) {
    const LitBlocks lit = lit_ranges(shots[k]);
    std::int32_t area = 0;
    LitBlocks kept;
    for (std::size_t b = 0; b < lit.size(); ++b) {
      area += lit[b].end - lit[b].begin;
      if (unknown[shots[k].blocks[b]] != 0) kept.push_back(lit[b]);
    }
    light.keep(photographs[k], kept,
               static_cast<float>(area) / static_cast<float>(facts_.tree.order().size()));
  }
}

void LevelSearch::subtract_measured(std::span<const NodeIndex> tested, std::span<const Shot> shots,
                                    std::span<const std::span<float>> means) const {
  const auto lit = lit_blocks(shots, unknown_.block_count());
  tbb::parallel_for(std::size_t{0}, means.size(), [&](std::size_t k) {
    Tally tally(facts_.options.work);
    for (const NodeIndex n : tested) {
      tally.add(kLook);
      for_lit_sides(node(n), lit[k], [&](NodeLevel::Side side) {
        unknown_.subtract_measured(node(n), side, shots[k].slot, means[k]);
        tally.add(samples(n));
      });
    }
  });
}

void LevelSearch::record(std::span<const NodeIndex> tested, std::span<const Shot> shots,
                         std::span<const TreePhotograph> photographs) {
  const auto lit = lit_blocks(shots, unknown_.block_count());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tested.size()), [&](const auto& range) {
    Tally tally(facts_.options.work);
    for (std::size_t t = range.begin(); t < range.end(); ++t)
      for (std::size_t k = 0; k < photographs.size(); ++k) {
        tally.add(kLook);
        for_lit_sides(node(tested[t]), lit[k], [&](NodeLevel::Side side) {
          const TreePhotograph& p = photographs[k];
          unknown_.record(node(tested[t]), side, shots[k].slot, p.mean, p.variance, p.valid);
          tally.add(kRecord * samples(tested[t]));
        });
      }
  });
}

std::vector<Tested> LevelSearch::judge() const {
  std::vector<Tested> tested;
  for (const Round& round : rounds_)
    for (const NodeIndex n : round.tested) tested.push_back({n, false, {}, {}});
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tested.size()), [&](const auto& range) {
    Tally tally(facts_.options.work);
    for (std::size_t k = range.begin(); k < range.end(); ++k) {
      judge(tested[k]);
      tally.add(kRecord * 4 * samples(tested[k].node));
    }
  });
  return tested;
}

void LevelSearch::judge(Tested& tested) const {
  const RankRule rule = facts_.rule();
  const Node& of = node(tested.node);
  const RankEvidence evidence = unknown_.evidence(of, facts_.flood_squared);
  tested.total = evidence.total();
  tested.leaf = !of.split && is_leaf(evidence, rule);
  if (tested.leaf) return;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      const int pair = 4 * a + b;
      tested.undecayed[pair] =
          of.distrusted ? std::numeric_limits<double>::infinity()
                        : undecayed_misfit(evidence, a, b, unknown_.level(), rule, facts_.options.economy);
    }
}

/// Only nodes that were expected to pass teach: the others were tested because they are hard.
void LevelSearch::learn(std::span<const Tested> tested) {
  double found = 0;
  double nodes = 0;
  for (const Tested& t : tested) {
    if (!expected_to_pass(node(t.node)) || t.total.samples <= 0) continue;
    const double allowed = noise_allowance(t.total.noise, t.total.samples, facts_.rule().noise_sigmas);
    found += std::max(0.0, t.total.misfit - allowed) / t.total.samples / facts_.tolerance();
    ++nodes;
  }
  found_.decay.learn(found, nodes);
}

/// Accepted nodes that are not expected to pass any more.
std::vector<NodeIndex> LevelSearch::take_back() {
  std::vector<NodeIndex> doubtful;
  std::erase_if(accepted_, [&](const Accepted& at) {
    if (expected_to_pass(node(at.node))) return false;
    doubtful.push_back(at.node);
    found_.known.remove_leaf(at.leaf);
    return true;
  });
  return doubtful;
}

}  // namespace symrig::acquisition
