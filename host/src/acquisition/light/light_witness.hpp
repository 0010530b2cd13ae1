// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "symrig/acquisition/probe.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::acquisition {

/// A probe that watches all photographs of a capture pass. A photograph that lacks the direct light of its
/// own pattern, or that repeats the one before, is taken again aside. If the second one is another, the first
/// one was wrong, whatever the scene is. cost: no photograph if all is well.
class LightWitness final : public Probe {
 public:
  /// inner must outlive this. look: without it, nothing is proven.
  LightWitness(Probe& inner, LookAside look) : inner_(inner), look_(std::move(look)) {}

  Grid grid() const override { return inner_.grid(); }
  Grid camera_grid() const override { return inner_.camera_grid(); }
  ViewLayout views() const override { return inner_.views(); }
  int channels() const override { return inner_.channels(); }
  double residual_shift() const override { return inner_.residual_shift(); }
  bool plans_exposures(std::size_t photographs) const override { return inner_.plans_exposures(photographs); }
  std::size_t together() const override { return inner_.together(); }
  bool computes() const override { return inner_.computes(); }
  void tell(TakenSome taken) override { inner_.tell(std::move(taken)); }
  ProbeCost cost() const override { return inner_.cost(); }
  Result<void> continue_after(const ProbeCost& spent) override { return inner_.continue_after(spent); }
  std::string describe() const override { return inner_.describe(); }
  std::string identity() const override { return inner_.identity(); }
  /// fails: also wrong_light (a photograph that is proven to be wrong).
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return seen(patterns, inner_.measure(patterns));
  }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    return seen(patterns, inner_.measure_expected(patterns, expected));
  }

  /// After a search that has found nothing to rely on: takes the flood-lit photograph three times and that
  /// of the first half again, and one of black.
  /// cost: kLooksAgain photographs.
  /// fails: wrong_light (the rig has changed since the capture began, or black is not black); as look.
  Result<void> look_again();
  static constexpr std::int64_t kLooksAgain = 5;

 private:
  /// All channels added.
  struct Picture {
    std::vector<float> light, variance;
  };
  static double apart(const Picture& a, const Picture& b);
  static Picture picture_of(const Radiance& photograph);
  Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                     Result<std::vector<Radiance>> photographs);
  Result<void> see(const Pattern& pattern, const Radiance& photograph);
  void learn_direct(const Pattern& pattern, const Picture& picture);
  /// The light of the pixels that `lit` lights and `dark` does not, over their direct light; below 0: not
  /// known.
  double answer(const Picture& picture, const Pattern& lit, const Pattern* dark) const;
  /// fails: wrong_light (the second picture lies elsewhere).
  Result<void> check_place(const Picture& first, const Picture& again, const char* what) const;
  Result<void> prove(const Pattern& pattern, const Picture& picture, bool repeats);

  Probe& inner_;
  LookAside look_;
  std::int64_t count_ = 0;
  int asked_in_vain_ = 0;
  Pattern half_pattern_, before_pattern_;
  Picture flood_, half_, before_;
  std::vector<float> direct_;  ///< by pixel; empty: not known
  double random_ = 1;          ///< share of direct_ that is other light, in squares
};

}  // namespace symrig::acquisition
