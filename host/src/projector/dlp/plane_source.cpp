// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/plane_source.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

void read_leds(base::TableReader& table, PlaneOptions& planes) {
  constexpr std::array<std::pair<std::string_view, std::uint8_t>, 7> kLeds{
      {{"red", 1}, {"green", 2}, {"yellow", 3}, {"blue", 4}, {"magenta", 5}, {"cyan", 6}, {"white", 7}}};
  table.read_choice<std::uint8_t>("leds", planes.leds, kLeds);
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
  planes.led_currents =
      LedCurrents{static_cast<std::uint8_t>(currents[0]), static_cast<std::uint8_t>(currents[1]),
                  static_cast<std::uint8_t>(currents[2])};
}

void read_order(base::TableReader& table, PlaneOrder& order) {
  std::string text;
  if (!table.read("plane_order", text)) return;
  const auto parsed = parse_plane_order(text);
  if (!parsed)
    return table.fail("plane_order", fmt::format("is no order of the colours: '{}'", text),
                      R"(give three letters such as "GRB" or "RGB", or "RGB highest first")");
  order = *parsed;
}

template <class T>
std::string text_or_longest(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : std::string("longest");
}

}  // namespace

void read_plane_keys(base::TableReader& table, PlaneKeys& keys, PlaneOptions& planes) {
  table.read("controller", keys.controller);
  table.read("connector", keys.screen.connector);
  table.read("mode", keys.screen.mode);
  table.read_whole("planes", planes.planes, 1, kMostPlanes);
  read_microseconds(table, "plane_period", planes.period_us);
  read_leds(table, planes);
  constexpr std::array<std::pair<std::string_view, bool>, 2> kLevels{{{"high", false}, {"low", true}}};
  table.read_choice<bool>("plane_active", planes.plane_inverted, kLevels);
  table.read_choice<bool>("frame_active", planes.frame_inverted, kLevels);
  table.read_whole("latency", keys.latency, 1, 8);
  read_order(table, keys.order);
}

void read_delay(base::TableReader& table, std::string_view key, double least, double most,
                Nanoseconds& value) {
  double us = 1e-3 * static_cast<double>(value.count());
  if (table.read_number(key, us, least, most)) value = Nanoseconds{static_cast<std::int64_t>(1e3 * us)};
}

void check_delays(base::TableReader& table, const PlaneOptions& planes) {
  if (table.ok() && planes.frame_delay >= planes.plane_delay)
    table.fail("frame_delay_us", "the frame trigger does not come before the trigger of plane 0",
               "give a smaller delay than plane_delay_us");
}

void read_microseconds(base::TableReader& table, std::string_view key, std::optional<std::uint32_t>& value) {
  Nanoseconds time{0};
  if (!table.read(key, time)) return;
  if (time.count() <= 0 || time.count() % 1000 != 0 || time.count() / 1000 > 2'000'000)
    return table.fail(key, "is not whole microseconds up to 2 s", "give a value such as \"684 us\"");
  value = static_cast<std::uint32_t>(time.count() / 1000);
}

Result<std::unique_ptr<Projector>> PlaneSource::open(const ScreenFacts& screen, Grid grid) const {
  DrmProjectorOptions wanted = keys_.screen;
  wanted.placement = screen.placement;
  wanted.grid = grid;
  // The controller is looked for first: without it no mode of a screen is changed.
  SYMRIG_TRY(auto transport, open_transport(kind_, keys_.controller));
  SYMRIG_TRY(auto opened, DrmProjector::open(wanted));
  const PlaneProjectorOptions options{planes().plane_delay - planes().frame_delay, keys_.latency,
                                      keys_.order};
  SYMRIG_TRY(auto projector,
             PlaneProjector::open(std::move(opened), options, [&](const PictureSource& source) {
               return begin(std::move(transport), source);
             }));
  return std::unique_ptr<Projector>(std::move(projector));
}

std::string PlaneSource::identity(const Placement& placement) const {
  const PlaneOptions& sequence = planes();
  const auto currents = sequence.led_currents
                            ? fmt::format(", currents {} {} {}", (*sequence.led_currents)[0],
                                          (*sequence.led_currents)[1], (*sequence.led_currents)[2])
                            : std::string();
  const auto order = keys_.order == PlaneOrder{} ? std::string() : ", order " + to_string(keys_.order);
  return fmt::format("projector {} {} {}, {} planes, period {}, exposure {}, leds {}{}, cell {}+{}+{}{}{}{}",
                     driver_, keys_.screen.connector, keys_.screen.mode, sequence.planes,
                     text_or_longest(sequence.period_us), text_or_longest(sequence.exposure_us),
                     int{sequence.leds}, currents, placement.cell, placement.top, placement.left,
                     placement.mirror_rows ? ", rows mirrored" : "",
                     placement.mirror_cols ? ", columns mirrored" : "", order);
}

}  // namespace symrig::projector::dlp
