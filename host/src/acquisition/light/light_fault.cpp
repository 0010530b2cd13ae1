// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_fault.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace symrig::acquisition {

Error LightFault::error() const {
  std::string what = measured;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    const char* const before = k > 0 ? "; or " : causes.size() == 1 ? "; cause: " : "; likely causes: ";
    what += before + causes[k].text;
  }
  std::string next = causes.empty() ? std::string() : causes.front().next;
  return {ErrorCode::wrong_light, std::move(what), std::move(next)};
}

LightCause late_frame() {
  return {"a frame came late or twice",
          "empty the camera's queue before each pattern, and tie each photograph to its trigger"};
}

LightCause stuck_pixels() {
  return {"stuck (hot) pixels of the camera",
          "state them as not valid, or list them as defects of the sensor"};
}

std::vector<LightCause> causes_of_missing_light() {
  return {{"a frame without light: it was lost, or the lamp or the shutter missed it",
           "tie each photograph to its trigger"},
          {"a lamp that flickers", "expose for whole periods of the lamp, or use a steady lamp"}};
}

std::vector<LightCause> causes_of_constant_light(bool equal) {
  const LightCause repeats{equal ? "the camera gives the same photograph again and again, with the same noise"
                                 : "the camera gives old photographs",
                           "check that the camera takes a new photograph for each trigger"};
  const LightCause room{
      "the projector's light does not reach the camera, and other light does (the lamp is off, "
      "the room is lit)",
      "switch the lamp on, and cover the rig"};
  const LightCause still{"the projector does not change its picture", "check what the projector shows"};
  return equal ? std::vector{repeats, still} : std::vector{room, still, repeats};
}

LightCause other_light(double black) {
  if (black > 0)
    return {fmt::format(
                "light of other sources, or a black level that is not subtracted: with the projector black, "
                "the camera still sees {} of that light",
                percent_of_light(black)),
            "cover the rig, and subtract a photograph of the dark projector"};
  return {
      fmt::format(
          "a black level that is subtracted, and too high: with the projector black, the photograph is {} "
          "of that light",
          percent_of_light(black)),
      "measure the black level again"};
}

LightFault afterglow(double share) {
  return {
      fmt::format("each photograph has {} of the light of the pattern before it", percent_of_light(share)),
      {{"the projector's picture is not settled, or the exposure begins before the pattern or ends after "
        "it",
        "wait longer between pattern and exposure (settle)"},
       {"a camera that mixes photographs (noise reduction over time)", ""}}};
}

LightFault sharpening(double less) {
  return {fmt::format("pixels beside lit ones are darker than others by {} of the light of lit ones",
                      percent_of_light(less)),
          {{"sharpening in the camera", "switch off sharpening and noise reduction, and take raw frames"}}};
}

std::string percent_of_light(double share) {
  const double percent = 100 * share;
  // {:.2g} would write 1e+02.
  return std::abs(percent) < 99.5 ? fmt::format("{:.2g} %", percent) : fmt::format("{:.0f} %", percent);
}

}  // namespace symrig::acquisition
