// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/findings.hpp"
#include "acquisition/search/placement.hpp"
#include "acquisition/tree/photographer.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig::acquisition {

using NodeIndex = std::int32_t;  // of a node in its level

/// The blocks of one colour and which of their (up to four) children this pattern lights.
struct Shot {
  std::vector<std::int32_t> blocks;
  int slot;
};

/// Searches the unknown nodes of one level, in rounds. Nodes that are expected to pass the rank test are
/// accepted at once and subtracted like any other leaf. The others are tested, and as many of the accepted as
/// idle colours have room for. Their tests may show that the scene is less smooth than expected. Then the
/// accepted nodes that became doubtful are taken back and tested in another round.
class LevelSearch {
 public:
  /// unknown: the nodes of the level.
  LevelSearch(const SearchFacts& facts, Photographer& photographer, Findings& found, NodeLevel& unknown)
      : facts_(facts), photographer_(photographer), found_(found), unknown_(unknown) {}

  /// How many more patterns the budget has room for. A budget of seconds knows better after some.
  using Left = std::function<std::int64_t()>;
  /// Takes at most so many patterns; nodes that they do not reach are accepted untested, those that promise
  /// most first left out. Result: the tested nodes.  fails: as Probe::measure; limit (memory).
  Result<std::vector<Tested>> run(const Left& left);
  /// Asked with the photographs of each round before they are taken, and with those that later levels take at
  /// least. False leaves them: then no node of the level is known, and given_up() is true.
  using Worth = std::function<bool(std::int64_t photographs, std::int64_t later)>;
  void ask_first(Worth worth) { worth_ = std::move(worth); }
  bool given_up() const { return given_up_; }
  /// Photographs that the level would begin with, by the present rule.
  std::int64_t foreseen() const;
  /// The tested nodes by the present rule.
  std::vector<Tested> judge() const;
  /// Photographs taken.
  std::int64_t photographs() const;
  /// Of pairs of different blocks.
  LevelEvidence evidence(std::span<const Tested> tested) const;
  /// Nodes were accepted because the budget ended.
  bool cut_short() const { return cut_short_; }

 private:
  /// Nodes tested together and the photographs that test them: log numbers [first, first + shots).
  struct Round {
    std::vector<NodeIndex> tested;
    std::vector<Shot> shots;
    std::int64_t first = 0;
  };
  /// A node accepted before its test, and its leaf.
  struct Accepted {
    NodeIndex node;
    std::int32_t leaf;
  };

  struct Split {
    std::vector<NodeIndex> doubtful, predicted;
  };

  Split doubtful_and_predicted() const;
  const Node& node(NodeIndex n) const { return unknown_.nodes()[n]; }
  std::int64_t samples(NodeIndex n) const;
  bool expected_to_pass(const Node& of) const;
  void accept(NodeIndex n);
  std::vector<Tested> give_up();
  Round schedule(std::vector<NodeIndex> doubtful, std::vector<NodeIndex>& predicted) const;
  UnitsToCome later() const;
  void forecast_progress(std::int64_t budget);
  Round schedule_within(std::int64_t budget, std::vector<NodeIndex> doubtful,
                        std::vector<NodeIndex>& predicted);
  void add_loops(std::vector<std::pair<std::int32_t, std::int32_t>>& edges) const;
  LitBlocks lit_ranges(const Shot& shot) const;
  Result<void> photograph(Round& round);
  double share_of_seconds(const Round& round) const;
  void keep_direct_of(const Round& round);
  Result<void> leave_out_rest(Round& round, std::size_t taken);
  bool worth_another_round(const Left& left) const;
  void preview(std::size_t r, std::span<const Shot> shots, std::span<const LitBlocks> patterns,
               std::span<Preview> previews) const;
  void subtract_and_record(std::size_t r, std::int64_t first, std::span<TreePhotograph> photographs);
  Result<void> subtract_again();
  Result<void> subtract_again(std::size_t r);
  void keep_direct(std::span<const Shot> shots, std::span<const TreePhotograph> photographs,
                   LevelLight& light) const;
  void subtract_measured(std::span<const NodeIndex> tested, std::span<const Shot> shots,
                         std::span<const std::span<float>> means) const;
  void record(std::span<const NodeIndex> tested, std::span<const Shot> shots,
              std::span<const TreePhotograph> photographs);
  void judge(Tested& tested) const;
  void learn(std::span<const Tested> tested);
  std::vector<NodeIndex> take_back();

  const SearchFacts& facts_;
  Photographer& photographer_;
  Findings& found_;
  NodeLevel& unknown_;
  std::vector<Round> rounds_;
  std::vector<Accepted> accepted_;
  bool cut_short_ = false;
  bool given_up_ = false;
  Worth worth_;
};

}  // namespace symrig::acquisition
