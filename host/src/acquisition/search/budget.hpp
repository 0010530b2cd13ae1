// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/photographer.hpp"
#include "symrig/acquisition/capture.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

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

}  // namespace symrig::acquisition
