// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/reopening.hpp"

#include "acquisition/errors/dark_excess.hpp"
#include "acquisition/search/placement.hpp"
#include "acquisition/search/residual_shift.hpp"
#include "acquisition/search/suspects.hpp"

#include <utility>

namespace symrig::acquisition {
namespace {

/// Light that a residual shift moves makes no leaf wrong.
std::vector<Checks::Residual> with_shift(const SceneFacts& facts, std::vector<Checks::Residual> residuals) {
  for (Checks::Residual& one : residuals)
    add_shift_variance(facts.tree, facts.residual_shift, {&one.photograph, 1});
  return residuals;
}

}  // namespace

void Reopening::review(Checks& checks, bool done) {
  // A pattern that deceives all blocks looks no better until single pixels are separated.
  constexpr double kWorse = 0.01;
  const auto& residuals = checks.residuals(found_.known);
  const Comparison seen = DarkExcess(Checks::random(residuals), facts_.flood_squared)
                              .of(0, static_cast<std::int32_t>(facts_.tree.grid().size()));
  if (last_ && seen.misfit - last_->seen.misfit > kWorse * last_->seen.excess()) return put_back();
  changed_ = changed_ || last_;
  last_.reset();
  if (!done) return;
  std::vector<std::int32_t> found =
      acquisition::suspects(facts_, found_.known, with_shift(facts_, residuals));
  suspects_ = std::ssize(found);
  const TransportErrors missed = Checks::errors(residuals);
  sparseness_.misses({missed.indirect, missed.frobenius});
  budget_.begin_reopening();
  if (found.empty()) return;
  // The rest of the budget may be too small for a single leaf. Then the same leaves would be reopened for
  // ever.
  if (budget_.left() <= 0 || last_at_ == photographer_.taken())
    sparseness_.doubt_leaves();
  else
    reopen_all(std::move(found), seen);
}

void Reopening::reopen_all(std::vector<std::int32_t> leaves, const Comparison& seen) {
  last_at_ = photographer_.taken();
  last_ = Attempt{found_.known.mark(), std::move(leaves), seen, found_.level_light.size()};
  for (const std::int32_t leaf : last_->leaves) {
    const int level = found_.known.leaves()[leaf].level;
    reopen(facts_, found_.known, leaf, found_.open[level]);
  }
}

void Reopening::put_back() {
  found_.known.rewind(last_->mark);
  for (const std::int32_t leaf : last_->leaves) found_.known.restore_leaf(leaf);
  found_.level_light.resize(last_->level_light, LevelLight(0, {}, 0, 0));
  last_.reset();
}

}  // namespace symrig::acquisition
