// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a DLPC350: docs/rig-file.md.
#include "projector/dlpc350/dlpc350_driver.hpp"

#include "projector/dlpc350/dlpc350_projector.hpp"
#include "projector/dlpc350/find_controllers.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector {
namespace {

using dlpc350::Dlpc350Options;

struct Dlpc350Keys {
  std::string controller;  // "/dev/hidraw0"; empty: the only one
  Dlpc350Options options;
};

class Dlpc350Source final : public ProjectorSource {
 public:
  explicit Dlpc350Source(Dlpc350Keys keys) : keys_(std::move(keys)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override {
    Dlpc350Options options = keys_.options;
    options.screen.placement = screen.placement;
    options.screen.grid = grid;
    // The controller is looked for first: without it no mode of a screen is changed.
    SYMRIG_TRY(auto transport, dlpc350::open_transport(keys_.controller));
    SYMRIG_TRY(auto opened, DrmProjector::open(options.screen));
    SYMRIG_TRY(auto projector, dlpc350::Dlpc350Projector::open(
                                   std::move(opened), dlpc350::Controller(std::move(transport)), options));
    return std::unique_ptr<Projector>(std::move(projector));
  }

  Pacing pacing() const override { return Pacing::host; }
  bool shows_planes() const override { return true; }

  std::string identity(const Placement& placement) const override {
    const Dlpc350Options& options = keys_.options;
    const dlpc350::VideoPatternOptions& sequence = options.sequence;
    const auto text = [](const auto& value) {
      return value ? fmt::format("{}", *value) : std::string("longest");
    };
    const auto currents = sequence.led_currents
                              ? fmt::format(", currents {} {} {}", (*sequence.led_currents)[0],
                                            (*sequence.led_currents)[1], (*sequence.led_currents)[2])
                              : std::string();
    return fmt::format(
        "projector dlpc350 {} {}, {} planes, period {}, exposure {}, leds {}{}, cell {}+{}+{}{}{}",
        options.screen.connector, options.screen.mode, sequence.planes, text(sequence.period_us),
        text(sequence.exposure_us), int{sequence.leds}, currents, placement.cell, placement.top,
        placement.left, placement.mirror_rows ? ", rows mirrored" : "",
        placement.mirror_cols ? ", columns mirrored" : "");
  }

 private:
  Dlpc350Keys keys_;
};

/// A duration in whole microseconds, as the controller takes it.
void read_microseconds(base::TableReader& table, std::string_view key, std::optional<std::uint32_t>& value) {
  Nanoseconds time{0};
  if (!table.read(key, time)) return;
  if (time.count() <= 0 || time.count() % 1000 != 0 || time.count() / 1000 > 2'000'000)
    return table.fail(key, "is not whole microseconds up to 2 s", "give a value such as \"684 us\"");
  value = static_cast<std::uint32_t>(time.count() / 1000);
}

void read_delay(base::TableReader& table, std::string_view key, Nanoseconds& value) {
  double us = 1e-3 * static_cast<double>(value.count());
  if (table.read_number(key, us, -20.05, 2.78)) value = Nanoseconds{static_cast<std::int64_t>(1e3 * us)};
}

void read_leds(base::TableReader& table, dlpc350::VideoPatternOptions& sequence) {
  constexpr std::array<std::pair<std::string_view, std::uint8_t>, 7> kLeds{
      {{"red", 1}, {"green", 2}, {"yellow", 3}, {"blue", 4}, {"magenta", 5}, {"cyan", 6}, {"white", 7}}};
  table.read_choice<std::uint8_t>("leds", sequence.leds, kLeds);
  constexpr std::array<std::string_view, 3> kCurrents{"red_current", "green_current", "blue_current"};
  std::array<int, 3> currents{-1, -1, -1};
  int given = 0;
  for (std::size_t k = 0; k < kCurrents.size(); ++k)
    given += table.read_whole(kCurrents[k], currents[k], 0, 255) ? 1 : 0;
  if (given == 0) return;
  for (std::size_t k = 0; k < kCurrents.size(); ++k)
    if (currents[k] < 0)
      return table.fail(kCurrents[k], "is missing: the controller takes the three currents together",
                        "give 0 to 255");
  sequence.led_currents =
      dlpc350::LedCurrents{static_cast<std::uint8_t>(currents[0]), static_cast<std::uint8_t>(currents[1]),
                           static_cast<std::uint8_t>(currents[2])};
}

/// Active levels and delays of the trigger outputs.
void read_triggers(base::TableReader& table, dlpc350::VideoPatternOptions& sequence) {
  constexpr std::array<std::pair<std::string_view, bool>, 2> kLevels{{{"high", false}, {"low", true}}};
  table.read_choice<bool>("plane_active", sequence.plane_inverted, kLevels);
  table.read_choice<bool>("frame_active", sequence.frame_inverted, kLevels);
  read_delay(table, "plane_delay_us", sequence.plane_delay);
  read_delay(table, "frame_delay_us", sequence.frame_delay);
  if (table.ok() && sequence.frame_delay >= sequence.plane_delay)
    table.fail("frame_delay_us", "the frame trigger does not come before the trigger of plane 0",
               "give a smaller delay than plane_delay_us");
}

}  // namespace

std::unique_ptr<ProjectorSource> read_dlpc350_projector(base::TableReader& table) {
  Dlpc350Keys keys;
  table.read("controller", keys.controller);
  DrmProjectorOptions& screen = keys.options.screen;
  screen.mode = "912x1140@60";
  table.read("connector", screen.connector);
  table.read("mode", screen.mode);
  dlpc350::VideoPatternOptions& sequence = keys.options.sequence;
  table.read_whole("planes", sequence.planes, 1, dlpc350::kMostPlanes);
  read_microseconds(table, "plane_period", sequence.period_us);
  read_microseconds(table, "plane_exposure", sequence.exposure_us);
  read_leds(table, sequence);
  constexpr std::array<std::pair<std::string_view, dlpc350::Port>, 2> kPorts{
      {{"parallel", dlpc350::Port::parallel}, {"fpd-link", dlpc350::Port::fpd_link}}};
  table.read_choice<dlpc350::Port>("port", sequence.port, kPorts);
  read_triggers(table, sequence);
  table.read_whole("latency", keys.options.latency, 1, 8);
  return std::make_unique<Dlpc350Source>(std::move(keys));
}

}  // namespace symrig::projector
