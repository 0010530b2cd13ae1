// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/budget.hpp"
#include "acquisition/search/findings.hpp"
#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/rank_test.hpp"
#include "acquisition/tree/search_facts.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::acquisition {

/// Leaves that the check photographs find wrong, although their own photographs fit. Such a leaf has a block
/// that is dark while a random half of the pixels is lit. There the tensor misses by over ten tolerances
/// beyond noise, and by over half the size of its own entries. The leaf shines there strongly enough to have
/// a part in it. Transport that is balanced within every block (a checkerboard) passes every rank test, and
/// is found here.
std::vector<std::int32_t> suspects(const SearchFacts& facts, const KnownTransport& known,
                                   const std::vector<Checks::Residual>& all);

/// Leaves that the checks find wrong are reopened: the search splits them. Together they may cost a tenth of
/// the photographs that were taken before. Where they cost more, brute force takes over (Sparseness).
/// Small blocks may measure mostly noise. If the checks are then missed by more than before, the leaves are
/// put back. CaptureResult::suspects and the estimated errors report what remains.
class Reopening {
 public:
  Reopening(const SearchFacts& facts, const Photographer& photographer, Findings& found, Budget& budget,
            Sparseness& sparseness)
      : facts_(facts), photographer_(photographer), found_(found), budget_(budget), sparseness_(sparseness) {}

  /// After a search of all levels: judges the last reopening, and reopens the suspects that are left.
  /// done: no budget has ended the search.
  void review(Checks& checks, bool done);

  /// Leaves were reopened and stayed so.
  bool changed() const { return changed_; }
  /// Leaves that the checks found wrong in the last review.
  std::int64_t suspects() const { return suspects_; }

 private:
  struct Attempt {
    KnownTransport::Mark mark;  ///< of what was known before
    std::vector<std::int32_t> leaves;
    Comparison seen;          ///< by the checks before, where they are dark
    std::size_t level_light;  ///< number of Findings::level_light before
  };
  void reopen_all(std::vector<std::int32_t> leaves, const Comparison& seen);
  void put_back();

  const SearchFacts& facts_;
  const Photographer& photographer_;
  Findings& found_;
  Budget& budget_;
  Sparseness& sparseness_;
  std::optional<Attempt> last_;
  std::int64_t last_at_ = -1;  ///< photographs taken at the last attempt
  bool changed_ = false;
  std::int64_t suspects_ = 0;
};

}  // namespace symrig::acquisition
