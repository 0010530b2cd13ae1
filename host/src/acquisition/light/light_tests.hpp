// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_series.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

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

/// Pixels whose values no light can have: values at which many pixels stand (clipping), pixels that do not
/// depend on the pattern, and less light beside bright pixels than elsewhere (sharpening).
std::optional<LightFault> find_wrong_pixels(const LightSeries& series);

/// Dark rows and columns between lit ones.
/// cost: one photograph for each kind of line that is suspected.  fails: as look.
Result<std::optional<LightFault>> find_dead_lines(const LightSeries& series, const LookAside& look);

/// Photographs that lack the direct light of their own pattern: they show another pattern, or nothing.
std::optional<LightFault> find_missing_light(const LightSeries& series, const LightMatch& match);

/// Photographs that hold some light of the pattern before.
std::optional<LightFault> find_afterglow(const LightSeries& series, const LightMatch& match);

/// Light that lies beside the pixels that are lit: a camera that looks elsewhere.
std::optional<LightFault> find_shift(const LightSeries& series, const LightMatch& match);

/// Light that does not come back: the pixels that a pattern makes bright light others than those of the
/// pattern. So the camera's pixels are not the projector's, in no known way.
/// cost: two photographs if light between pixels differs from the light back, and photographs do not show
/// that they follow their patterns.  fails: as look.
Result<std::optional<LightFault>> find_other_pixels(const LightSeries& series, const LightMatch& match,
                                                    const LookAside& look);

/// Measured by brute force: a photograph for each pixel alone, and nothing else; enough pixels to tell
/// something.
bool are_columns(const TransportTensor& measured);

/// Whether these photographs can be those of a coaxial rig: each holds most light where it is lit, and as
/// much light goes from a pixel to another as comes back. Random patterns tell this from seven photographs,
/// but not on few pixels, and not of one photograph among many. measured: are_columns().  fails: wrong_light.
Result<void> check_columns(const TransportTensor& measured);

/// Whether each pixel is bright in few photographs, mostly not its own, in no known way, and no light goes
/// back. series: of the same rig: without light that goes one way, noise alone is bright.  fails:
/// wrong_light.
Result<void> check_order_of_columns(const TransportTensor& measured, const LightSeries& series);

/// Whether a capture gives the light of each pixel alone. A single photograph that is wrong changes much of
/// one pixel's light. found: of the same rig, with an error far below half of a pixel's light. measured:
/// are_columns(), taken after it.  fails: wrong_light.
Result<void> check_capture_by_columns(const TransportTensor& found, const TransportTensor& measured,
                                      const LightSeries& series);

/// Whether all columns together give the flood-lit photograph.
/// measured: are_columns().  cost: no photograph if they do, else six.  fails: wrong_light; as look.
Result<void> check_sum_of_columns(const TransportTensor& measured, const LightSeries& series,
                                  const LookAside& look);

}  // namespace symrig::acquisition
