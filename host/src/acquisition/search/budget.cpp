// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/budget.hpp"

#include "acquisition/search/brute_force_rest.hpp"

#include <algorithm>

namespace symrig::acquisition {

/// What a photograph takes before any but the flood-lit one is taken. The rig meters for that one, with as
/// many frames as it needs. A photograph takes one of them at least.
void Budget::note_pace() {
  const auto frames = static_cast<double>(std::max<std::int64_t>({1, photographer_.frames(), since_}));
  pace_ = since_seconds_ /
          (photographer_.plans_exposures() ? frames : static_cast<double>(std::max<std::int64_t>(1, since_)));
}

void Budget::begin_pace() {
  pace_ = seconds_each();
  since_ = photographer_.taken();
  since_seconds_ = photographer_.rig_seconds();
}

double Budget::seconds_each() const {
  const std::int64_t taken = photographer_.taken() - since_;
  return taken > 0 ? (photographer_.rig_seconds() - since_seconds_) / static_cast<double>(taken) : pace_;
}

Budget::Limit Budget::of_user(double pace) const {
  Limit limit;
  const std::int64_t taken = photographer_.taken();
  if (options_.max_patterns > 0) limit.tighten(options_.max_patterns - taken, "max_patterns");
  if (options_.max_seconds > 0) {
    const double spent = photographer_.rig_seconds();
    const double each = pace * seconds_each();
    limit.tighten(each > 0 ? photographer_.seconds_left().photographs(spent, each) : 0, "max_seconds");
  }
  return limit;
}

Budget::Limit Budget::tightest(double pace) const {
  Limit limit = of_user(pace);
  if (algorithm_info(options_.algorithm).yields_to_brute_force)
    limit.tighten(brute_force_left(), "brute_force");
  if (reopening_until_) limit.tighten(reopening_left(), "done");
  return limit;
}

namespace {

constexpr const char* kWrongLeaves = "held-out photographs find leaves wrong that passed their tests";

}  // namespace

const char* const Sparseness::kContradiction =
    "photographs of small blocks contradict products that large ones passed as";

/// Photographs of this level and all later ones if no pair of blocks is a leaf and no two share a photograph.
std::int64_t Sparseness::dense_levels(int level) const {
  std::int64_t photographs = 0;
  for (int l = level; l + 1 < facts_.tree.levels(); ++l) photographs += std::ssize(facts_.tree.level(l + 1));
  return photographs;
}

/// No product explains any pair of blocks that the last level tested. Where no light is negative and blocks
/// are equal, c r'/s leaves 3/4 of the energy at most. The limit is half way between that and all energy.
bool Sparseness::unstructured() const {
  constexpr std::int64_t kFewest = 6;  // pairs: those of four blocks
  constexpr double kNothing = 7.0 / 8;
  if (evidence_.empty()) return false;
  const LevelEvidence& last = evidence_.back();
  return last.tested >= kFewest && last.leaves == 0 && last.unexplained > kNothing;
}

/// Brute force fits into the user's budget and into memory.
bool Sparseness::brute_force_fits() const {
  return BruteForceRest::bytes(facts_.tree.grid().size(), facts_.channels) <= facts_.options.memory_limit &&
         budget_.of_user().left >= budget_.brute_force_left();
}

/// Wrong leaves spoil a little of the light only, such as that of a mirror on a rig whose cells are not those
/// of the camera. Then all the photographs of brute force gain less than they cost. Where the tests are
/// deceived (a checkerboard), half of the light and more is missed.
bool Sparseness::misses_little() const {
  constexpr double kLittle = 0.25;
  return misses_little_of_all() || (missed_.between_pixels > 0 && missed_.between_pixels < kLittle);
}

/// Where hardly any light goes between pixels, half of it is little of all light.
bool Sparseness::misses_little_of_all() const {
  constexpr double kLittle = 0.05;
  return missed_.of_all > 0 && missed_.of_all < kLittle;
}

bool Sparseness::can_take_over() const {
  if (budget_.reopening() && misses_little()) return false;
  return algorithm_info(facts_.options.algorithm).yields_to_brute_force && !undetermined_ &&
         brute_force_fits();
}

bool Sparseness::worth_searching(int level, std::int64_t photographs, std::int64_t later) {
  if (!algorithm_info(facts_.options.algorithm).yields_to_brute_force) return true;
  const std::int64_t taken = photographer_.taken();
  if (budget_.reopening()) {
    if (misses_little()) return true;  // the budget of reopened leaves ends the search
    if (photographs <= std::min(budget_.reopening_left(), budget_.brute_force_left())) return true;
    return !doubt(kWrongLeaves, taken + photographs);
  }
  const std::int64_t dense = taken + dense_levels(level);
  if (unstructured() && !misses_little_of_all() && dense > facts_.tree.grid().size())
    return !doubt("no pair of blocks is explained by a product of two pictures", dense);
  if (photographs + later <= budget_.brute_force_left()) return true;
  return !doubt("too few pairs of blocks are explained by a product of two pictures",
                taken + photographs + later);
}

void Sparseness::doubt_leaves() {
  if (!misses_little()) doubt(kWrongLeaves, photographer_.taken());
}

bool Sparseness::doubt_level() {
  if (misses_little_of_all()) return false;
  if (algorithm_info(facts_.options.algorithm).yields_to_brute_force)
    doubt(kContradiction, photographer_.taken());
  return true;
}

/// True if brute force measures the rest.
bool Sparseness::doubt(std::string reason, std::int64_t forecast) {
  if (undetermined_) return false;  // already reported, and a budget does not allow brute force
  undetermined_ = Undetermined{.reason = std::move(reason),
                               .patterns = photographer_.taken(),
                               .forecast = forecast,
                               .brute_force = facts_.tree.grid().size(),
                               .completed = brute_force_fits(),
                               .levels = evidence_};
  return undetermined_->completed;
}

}  // namespace symrig::acquisition
