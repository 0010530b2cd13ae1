// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/device_words.hpp"

#include "image/size_text.hpp"
#include "symrig/base/text.hpp"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace symrig::rig {
namespace {

/// A number of a fact, from `least` to `most`.
template <class Number>
std::optional<Number> number_of(const std::string& text, Number least, Number most) {
  Number value{};
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = failed == std::errc{} && end == text.data() + text.size();
  return whole && value >= least && value <= most ? std::optional(value) : std::nullopt;
}

std::optional<Grid> grid_of(const std::string& text) {
  const auto sides = image::two_sides(text);
  if (!sides) return std::nullopt;
  const Grid grid{sides->first, sides->second};
  return grid.valid() && grid.size() <= kLargestPairImage ? std::optional(grid) : std::nullopt;
}

std::optional<NoiseModel> noise_of(const PairLink& link) {
  const auto full_well = number_of(link.fact("full_well"), 1.0, 1e9);
  const auto read_noise = number_of(link.fact("read_noise"), 0.0, 1e6);
  const auto gain = number_of(link.fact("gain"), 1e-9, 1e9);
  const auto pedestal = number_of(link.fact("pedestal"), 0.0, 65'535.0);
  const auto bits = number_of(link.fact("bits"), 1, 16);
  if (!full_well || !read_noise || !gain || !pedestal || !bits) return std::nullopt;
  const NoiseModel noise = NoiseModel::from_numbers(*full_well, *read_noise, *gain, *pedestal, *bits);
  return noise.valid() ? std::optional(noise) : std::nullopt;
}

}  // namespace

std::string facts_of(const Camera& camera, const Projector& projector) {
  const CameraTiming timing = camera.timing();
  const NoiseModel& noise = camera.noise();
  return fmt::format(
      "cells={} camera={} channels={} mosaic={} pacing={} refresh={} min_exposure={} max_exposure={} "
      "readout={} trigger_delay={} overlap={} "
      "full_well={} read_noise={} gain={} pedestal={} bits={}",
      to_string(projector.grid()), to_string(camera.grid()), camera.channels(),
      static_cast<int>(camera.mosaic()), projector.pacing() == Pacing::host ? "host" : "trigger",
      projector.refresh_period().count(), timing.min_exposure.count(), timing.max_exposure.count(),
      timing.readout.count(), timing.trigger_delay.count(), timing.overlap.count(), noise.full_well(),
      noise.read_noise(), noise.gain(), noise.pedestal(), noise.bits());
}

Result<DeviceFacts> read_facts(const PairLink& link) {
  constexpr std::int64_t kDay = 86'400'000'000'000;
  DeviceFacts facts;
  const auto cells = grid_of(link.fact("cells")), camera = grid_of(link.fact("camera"));
  const auto channels = number_of(link.fact("channels"), 1, 16),
             mosaic = number_of(link.fact("mosaic"), 0, 4);
  const auto time = [&](const char* key) { return number_of<std::int64_t>(link.fact(key), 0, kDay); };
  const auto refresh = time("refresh"), shortest = time("min_exposure"), longest = time("max_exposure"),
             readout = time("readout");
  const std::string pacing = link.fact("pacing");
  facts.noise = noise_of(link);
  const bool complete = cells && camera && channels && mosaic && refresh && shortest && longest && readout &&
                        facts.noise && (pacing == "host" || pacing == "trigger") &&
                        camera->size() * *channels <= kLargestPairImage;
  if (!complete)
    return Error{ErrorCode::protocol,
                 fmt::format("{} states its camera and projector incompletely", link.place()),
                 "see docs/pair-protocol.md"};
  facts.cells = *cells;
  facts.camera = *camera;
  facts.channels = *channels;
  facts.mosaic = static_cast<Mosaic>(*mosaic);
  facts.pacing = pacing == "host" ? Pacing::host : Pacing::trigger;
  facts.refresh = Nanoseconds(*refresh);
  // A pair that does not state these has neither.
  const auto delay = time("trigger_delay"), overlap = time("overlap");
  facts.timing = {Nanoseconds(*shortest), Nanoseconds(*longest), Nanoseconds(*readout),
                  Nanoseconds(delay.value_or(0)), Nanoseconds(overlap.value_or(0))};
  return facts;
}

std::optional<std::vector<std::int64_t>> numbers_after(std::string_view word, std::string_view line,
                                                       std::size_t count) {
  if (!line.starts_with(word)) return std::nullopt;
  line.remove_prefix(word.size());
  std::vector<std::int64_t> numbers;
  while (line.starts_with(' ') && numbers.size() < count) {
    line.remove_prefix(1);
    std::int64_t value = 0;
    const auto [end, failed] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (failed != std::errc{} || value < 0) return std::nullopt;
    numbers.push_back(value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
  if (!line.empty() || numbers.size() != count) return std::nullopt;
  return numbers;
}

}  // namespace symrig::rig
