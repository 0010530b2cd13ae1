// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/brute_force_rest.hpp"
#include "acquisition/search/findings.hpp"
#include "acquisition/tree/photographer.hpp"
#include "symrig/acquisition/capture.hpp"

#include <cstdint>
#include <vector>

namespace symrig::acquisition {

constexpr int kConjugateSteps = 8;  ///< in one step of polish

/// The errors of a tensor that the checks are no part of, and whether photographs scatter as they state. Into
/// result, whose gain_mismatch is known. again: log numbers of the flood-lit photographs at the end. rest: of
/// a capture that brute force ended, or nullptr.
Result<void> estimate_finished(const TransportTensor& tensor, const Photographer& photographer,
                               const Checks& checks, LogRange again, const BruteForceRest* rest,
                               CaptureResult& result);

/// What follows the search: refits of the known transport to all photographs, and the estimated errors.
class Finishing {
 public:
  /// checks: may be nullptr. No refit uses their photographs.
  Finishing(const SearchFacts& facts, Photographer& photographer, Findings& found, Checks* checks)
      : facts_(facts), photographer_(photographer), found_(found), checks_(checks) {}

  /// Takes flood-lit photographs against the noise of the direct light, as many as Economy::direct_share
  /// says and at most `budget`. Then it refits the direct light to all photographs.
  struct DirectLightRefit {
    bool noisy = false;     ///< photographs have a variance: else no flood-lit one is taken
    bool reopened = false;  ///< leaves were reopened: Findings::level_light does not hold then
    std::int64_t budget = 0;
  };
  Result<void> refit_direct_light(const DirectLightRefit& how);
  /// Economy::polish steps of a refit of everything; fewer if one does not help, or within
  /// Economy::polish_share.
  Result<void> polish();

  /// The errors of a tensor that the checks are no part of, and whether photographs scatter as they state.
  /// rest: of a capture that brute force ended, or nullptr. Needs checks.
  Result<void> estimate(const TransportTensor& tensor, const BruteForceRest* rest,
                        CaptureResult& result) const;
  /// If the estimates of result.tensor are unsure, takes further checks, at most as many as
  /// Economy::check_share says and `budget` photographs, and estimates anew. Needs estimate() before.
  Result<void> make_sure(std::int64_t budget, CaptureResult& result);

 private:
  std::vector<LogRange> whole_photographs(bool reopened) const;
  Result<void> photograph_again(const DirectLightRefit& how);
  std::vector<double> least_misfit() const;
  int polish_steps() const;

  const SearchFacts& facts_;
  Photographer& photographer_;
  Findings& found_;
  Checks* checks_;
  LogRange again_{0, 0};  ///< log numbers of the flood-lit photographs at the end
};

}  // namespace symrig::acquisition
