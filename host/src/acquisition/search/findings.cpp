// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/findings.hpp"

#include "acquisition/search/placement.hpp"

namespace symrig::acquisition {
namespace {

/// Of a sample, for Work: the noise is taken out of it.
constexpr std::int64_t kAssumeOperations = 8;

void assume_pairs(const SearchFacts& facts, Findings& found) {
  Tally tally(facts.options.work);
  for (const NodeLevel& level : found.open)
    for (const Node& node : level.nodes()) {
      if (node.diagonal()) continue;
      add_leaf(facts, found.known, level, node);
      tally.add(kAssumeOperations * facts.channels *
                (level.block(node.row).size() + level.block(node.col).size()));
    }
}

void assume_diagonal(const SearchFacts& facts, Findings& found, bool direct) {
  for (const NodeLevel& level : found.open)
    for (const Node& node : level.nodes()) {
      if (!node.diagonal()) continue;
      if (direct)
        add_direct(facts, found.known, level, node);
      else
        add_leaf(facts, found.known, level, node);
    }
}

}  // namespace

Assumption better_assumption(const SearchFacts& facts, Findings& found, Checks& checks) {
  KnownTransport& known = found.known;
  checks.residuals(known);
  const KnownTransport::Mark searched = known.mark();
  assume_pairs(facts, found);
  std::vector<TreePhotograph> without_pairs = checks.halves();
  known.subtract_from(without_pairs, searched);
  const KnownTransport::Mark pairs = known.mark();
  Assumption best;
  for (const bool direct : {true, false}) {
    assume_diagonal(facts, found, direct);
    std::vector<TreePhotograph> left = without_pairs;
    known.subtract_from(left, pairs);
    known.rewind(pairs);
    const ErrorBar error = frobenius_error(facts.tree, checks.photographs(), left);
    if (direct || error.value < best.error.value) best = {direct, error};
  }
  known.rewind(searched);
  return best;
}

TensorBuilder assumed_draft(const SearchFacts& facts, Findings& found, bool direct) {
  const KnownTransport::Mark searched = found.known.mark();
  assume_pairs(facts, found);
  assume_diagonal(facts, found, direct);
  TensorBuilder draft = found.known.draft();
  found.known.rewind(searched);
  return draft;
}

void accept_open(const SearchFacts& facts, Findings& found, Checks* checks) {
  const bool direct = checks == nullptr || better_assumption(facts, found, *checks).direct;
  assume_pairs(facts, found);
  assume_diagonal(facts, found, direct);
  found.close_all(facts);
}

}  // namespace symrig::acquisition
