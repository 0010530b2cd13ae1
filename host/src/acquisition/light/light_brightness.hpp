// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_order.hpp"
#include "acquisition/light/light_sums.hpp"

#include <optional>

namespace symrig::acquisition {

/// What the light of two complementary patterns and that of both leave over: H + H' - F.
class LeftOver {
 public:
  explicit LeftOver(const LightSeries& series);

  double share() const { return share_; }  ///< of all light of the flood-lit photograph
  double sigma() const { return sigma_; }
  /// The exponent g for which H^g + H'^g - F^g leaves nothing over, if one does so pixel by pixel: the
  /// camera's values are light to the power of 1 / g.
  std::optional<double> exponent() const;

 private:
  template <class Use>
  void for_each_pixel(double exponent, const Use& use) const;
  /// What is left over of all light with this exponent.
  double raised(double exponent) const;
  double rms(double exponent) const;

  const LightSeries& series_;
  double share_ = 0, sigma_ = 0, noise_ = 0;
};

/// What photographs of black and white show, as shares of the light of the flood-lit photograph.
struct BlackAndWhite {
  double black = 0, black_sigma = 0;
  double negative = 0;  ///< share of the pixels of the black photograph below 0
  double scatter = 0;   ///< of white
  bool known = false;
};
/// cost: six photographs.  fails: as look.
Result<BlackAndWhite> look_at_black_and_white(const LightSeries& series, const LookAside& look);

/// Automatic exposure: more light than if everything is lit, and the more the fewer pixels are lit.
std::optional<LightFault> find_automatic(const LightSeries& series);

/// Light that does not add up, or that is more than all light: automatic exposure, light of other sources, a
/// wrong black level, a camera that is not linear, a lamp that flickers. Where the photographs do not show
/// that they follow their patterns, light of other patterns too. fails: as look.
Result<std::optional<LightFault>> find_wrong_brightness(const LightSeries& series, const LightMatch& match,
                                                        const LookAside& look);

}  // namespace symrig::acquisition
