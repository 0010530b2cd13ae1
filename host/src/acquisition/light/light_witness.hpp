// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "symrig/acquisition/probe.hpp"

#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

namespace symrig::acquisition {

/// A probe that watches all photographs of a capture pass. A photograph that lacks the direct light of its
/// own pattern, or that repeats the one before, is taken again aside. If the second one is another, the first
/// one was wrong, whatever the scene is. cost: no photograph if all is well.
class LightWitness final : public ForwardingProbe {
 public:
  /// inner must outlive this. look: without it, nothing is proven.
  LightWitness(Probe& inner, LookAside look) : ForwardingProbe(inner), look_(std::move(look)) {}

  /// After a search with a large error: takes each photograph again of which it could not tell whether it
  /// shows its pattern, because few pixels were lit.
  /// cost: at most cost_of_unjudged() photographs.
  /// fails: wrong_light (a photograph that is proven to be wrong); as look.
  Result<void> look_at_unjudged();
  std::int64_t cost_of_unjudged() const { return std::ssize(unjudged_) + kMostInVain * kEachProof; }

  /// After a search that has found nothing to rely on: takes the flood-lit photograph three times and that
  /// of the first half again, and one of black.
  /// cost: kLooksAgain photographs.
  /// fails: wrong_light (the rig has changed since the capture began, or black is not black); as look.
  Result<void> look_again();
  static constexpr std::int64_t kLooksAgain = 5;

 private:
  /// A scene that deceives the witness so often is not asked about again.
  static constexpr int kMostInVain = 3;
  static constexpr std::int64_t kEachProof = 6;

  /// All channels added.
  struct Picture {
    std::vector<float> light, variance;  ///< 0 where no channel is valid
    std::vector<std::uint8_t> valid;     ///< in all channels
  };
  struct Seen {
    std::int64_t number = 0;  ///< from 1
    Pattern before, pattern;
    Picture picture;
  };
  /// Σ (a − factor b)² over the pixels that are valid in both.
  static double squares_apart(const Picture& a, const Picture& b, double factor = 1);
  /// The factor for which that is least.
  static double factor_of(const Picture& a, const Picture& b);
  static bool differs(const Picture& first, const Picture& again);
  void remember(const Pattern& pattern, const Picture& picture);
  Expectation expected_again(const Picture& picture) const;
  static double apart(const Picture& a, const Picture& b);
  static Picture picture_of(const Radiance& photograph);
  /// fails: as the probe; wrong_light (a photograph that is proven to be wrong).
  Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                     Result<std::vector<Radiance>> photographs) override;
  Result<void> see(const Pattern& pattern, const Radiance& photograph);
  void learn_direct(const Pattern& pattern, const Picture& picture);
  /// The light of the pixels that `lit` lights and `dark` does not, over their direct light; below 0: not
  /// known.
  double answer(const Picture& picture, const Pattern& lit, const Pattern* dark) const;
  /// fails: wrong_light (the second picture lies elsewhere).
  Result<void> check_place(const Picture& first, const Picture& again, const char* what) const;
  /// repeats: it is the same as the one before.
  Result<void> prove(const Seen& seen, bool repeats);

  LookAside look_;
  std::int64_t count_ = 0;
  int asked_in_vain_ = 0;
  Pattern half_pattern_, before_pattern_;
  Picture flood_, half_, before_;
  std::vector<Seen> unjudged_;
  std::vector<float> direct_;  ///< by pixel; empty: not known
  double random_ = 1;          ///< share of direct_ that is other light, in squares
};

}  // namespace symrig::acquisition
