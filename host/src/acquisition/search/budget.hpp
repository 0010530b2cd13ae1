// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/acquisition/capture.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::acquisition {

/// How many photographs a search may still take.
class Budget {
 public:
  /// The limit that leaves the fewest photographs.
  struct Limit {
    std::int64_t left = std::numeric_limits<std::int64_t>::max();  ///< photographs
    const char* name = "done";                                     ///< CaptureResult::stopped_by

    void tighten(std::int64_t photographs, const char* by) {
      if (photographs < left) *this = {std::max<std::int64_t>(0, photographs), by};
    }
  };

  /// pixels: of the grid. photographer: has taken the flood-lit photograph.
  Budget(const CaptureSettings& options, std::int64_t pixels, const Photographer& photographer)
      : options_(options),
        pixels_(pixels),
        photographer_(photographer),
        since_(photographer.taken()),
        since_seconds_(photographer.rig_seconds()) {
    note_pace();
  }

  /// Photographs from now on tell how long one takes.
  void begin_pace();

  /// The limits that the user has set. pace: how long a photograph takes, as a multiple of the last ones.
  Limit of_user(double pace = 1) const;
  /// These, and the limits that need no option: brute force, and a tenth for reopened leaves. The latter is
  /// no limit of the user: a search that it ends is done.
  Limit tightest(double pace = 1) const;
  std::int64_t left() const { return tightest().left; }
  /// Until as many photographs are taken as brute force takes.
  std::int64_t brute_force_left() const { return pixels_ - photographer_.taken(); }

  /// Reopened leaves may cost a tenth of the photographs that were taken before the first of them.
  void begin_reopening() {
    if (!reopening_until_) reopening_until_ = photographer_.taken() + photographer_.taken() / 10;
  }
  void end_reopening() { reopening_until_.reset(); }
  bool reopening() const { return reopening_until_.has_value(); }
  std::int64_t reopening_left() const { return *reopening_until_ - photographer_.taken(); }

 private:
  const CaptureSettings& options_;
  std::int64_t pixels_;
  const Photographer& photographer_;
  std::int64_t since_;                           ///< photographs when begin_pace() was called
  double since_seconds_;                         ///< on the rig's clock by then
  double pace_ = 0;                              ///< seconds a photograph before then
  std::optional<std::int64_t> reopening_until_;  ///< number of photographs

  void note_pace();
  double seconds_each() const;
};

/// Decides whether the transport is data-sparse enough to be searched, or better left to brute force
/// (docs/research/not-data-sparse.md).
class Sparseness {
 public:
  Sparseness(const SearchFacts& facts, const Photographer& photographer, const Budget& budget)
      : facts_(facts), photographer_(photographer), budget_(budget) {}

  /// Adds what the tests of a level found.
  void add(const LevelEvidence& level) { evidence_.push_back(level); }

  /// False, and brute_force_takes_over(), if brute force should measure the rest. photographs: of the next
  /// round of `level`. later: of the levels after it, at least.
  bool worth_searching(int level, std::int64_t photographs, std::int64_t later);
  /// What is missed, by the checks: the estimated error if the search ended now.
  struct Missed {
    double between_pixels = 0;  ///< of the light between pixels (Checks::errors, indirect); 0: not known
    double of_all = 0;          ///< of all light (frobenius); 0: not known
  };
  /// Before leaves are reopened.
  void misses(const Missed& missed) { missed_ = missed; }
  /// After a level. What is missed between pixels stays as it was before leaves were reopened.
  void misses_of_all(double share) { missed_.of_all = share; }
  /// The checks find leaves wrong that cannot be reopened within the budget.
  void doubt_leaves();
  /// The photographs of a level contradict the leaves of coarser ones. False: what is missed is little.
  bool doubt_level();
  static const char* const kContradiction;

  /// Brute force measures the rest.
  bool brute_force_takes_over() const { return undetermined_ && undetermined_->completed; }
  /// Brute force can take over at any moment, so that no round is cut short to what is left of it.
  bool can_take_over() const;

  /// Why the search gave up, and on what evidence; none: it did not.
  std::optional<Undetermined> finding() && { return std::move(undetermined_); }

 private:
  std::int64_t dense_levels(int level) const;
  bool unstructured() const;
  bool brute_force_fits() const;
  bool misses_little() const;
  bool misses_little_of_all() const;
  bool doubt(std::string reason, std::int64_t forecast);

  const SearchFacts& facts_;
  const Photographer& photographer_;
  const Budget& budget_;
  std::vector<LevelEvidence> evidence_;
  Missed missed_;
  std::optional<Undetermined> undetermined_;
};

}  // namespace symrig::acquisition
