// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/rank_test.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/acquisition/internal/error_sums.hpp"
#include "symrig/tensor/file.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Six photographs that no part of the tensor is made from. Their patterns are independent of blocks: a
/// random half of the pixels and its complement, two random thirty-seconds, a bar, and a picture. The picture
/// has all scales and is cut at its median. Further sets of four have other random pixels; only estimates of
/// a finished tensor look at them.
class Checks : public HeldOutOrder {
 public:
  /// Takes them.  fails: as Probe::measure.
  static Result<Checks> take(const BlockTree& tree, Photographer& photographer);
  /// Those of a capture that has ended, from its log. six: the log numbers of the first set; further: those
  /// of further sets.  fails: as Photographer::read.
  static Result<Checks> of_log(const Photographer& photographer, LogRange six, std::vector<LogRange> further);
  /// Takes further sets.  fails: as Probe::measure.
  Result<void> take_further(std::int64_t sets, const BlockTree& tree, Photographer& photographer);

  /// What the known transport leaves of each check photograph.
  struct Residual {
    TreePhotograph photograph;    ///< pattern as shown, mean as measured
    PagedVector<float> residual;  ///< [channel][pixel]
  };
  /// Of the transport known now: subtracts what has been added since the last time, or all of it if some was
  /// changed. Valid until the next call.
  const std::vector<Residual>& residuals(const KnownTransport& known);
  /// The photographs; what is left of them is of the last residuals().
  const std::vector<Residual>& photographs() const { return residuals_; }
  /// Sets of photographs: the six, and further ones.
  std::size_t sets() const;
  /// Calls use() with the photographs of each set in turn. Those of further sets are read from the log.
  /// fails: as Photographer::read.
  using UseSet = std::function<void(std::span<const TreePhotograph* const> set)>;
  Result<void> visit_sets(const Photographer& photographer, const UseSet& use) const;
  /// Subtract everything anew next time: needed after KnownTransport::rewind() to before the last
  /// residuals().
  void forget() { rewritten_ = -1; }
  /// Pattern and residual of the two halves, to see what more would leave of them.
  std::vector<TreePhotograph> halves() const;

  /// Estimates of TransportErrors: squares of the residual less their noise, over squares of the photograph
  /// less its noise. Never below what the noise of the check itself can resolve.
  static TransportErrors errors(const std::vector<Residual>& residuals);

  /// The checks whose pixels are lit independently of each other.
  static std::span<const Residual> random(const std::vector<Residual>& residuals) {
    return std::span(residuals).first(4);
  }
  /// Mean square of what the known transport misses where a random half is dark, beyond noise, by channel. It
  /// is the error that half the light leaves in a sample.
  static std::vector<double> misfit_of_half(const std::vector<Residual>& residuals);
  /// How long one of them took on the rig's clock.
  double seconds_each() const { return seconds_each_; }
  /// Log numbers [first, last) of the six.
  std::int64_t first() const { return first_; }
  std::int64_t last() const;
  /// Log numbers of all.
  std::vector<LogRange> ranges() const;

  /// The photographs as they are kept in scene.h5.  fails: as visit_sets.
  Result<std::vector<HeldOut>> held_out(const BlockTree& tree, const Photographer& photographer) const;

 private:
  std::int64_t first_ = 0;  // log number
  double seconds_each_ = 0;
  std::vector<Residual> residuals_;
  std::vector<LogRange> further_ranges_;
  KnownTransport::Mark mark_;    // what residuals_ has been rid of
  std::int64_t rewritten_ = -1;  // KnownTransport::rewritten() then
};

/// Sums of the check photographs over ranges of pixels, where they are dark. There no direct light and little
/// noise is in the way.
class DarkExcess {
 public:
  DarkExcess(std::span<const Checks::Residual> residuals, std::span<const double> flood_squared);

  /// Σ residual² of pixels [begin, end) in units of F², and what noise explains of it, as the rank test
  /// counts.
  Comparison of(std::int32_t begin, std::int32_t end) const;
  /// Σ of the light that check k puts into pixels [begin, end): Σ pattern.
  double lit(std::size_t check, std::int32_t begin, std::int32_t end) const;

 private:
  std::vector<Comparison> before_;               // running sums over pixels
  std::vector<std::vector<double>> lit_before_;  // [check], running sums
};

}  // namespace symrig::acquisition
