// SPDX-License-Identifier: Apache-2.0
#include "program/file_keys.hpp"

#include <algorithm>
#include <array>

namespace symrig::program {
namespace {

template <class T>
using Choices = std::array<std::pair<std::string_view, T>, 2>;

constexpr Choices<bool> kActive{{{"high", false}, {"low", true}}};
constexpr Choices<ExposureMode> kExposure{
    {{"trigger-width", ExposureMode::trigger_width}, {"timed", ExposureMode::timed}}};
constexpr std::array<std::pair<std::string_view, PatternSync>, 3> kSync{
    {{"vsync", PatternSync::vsync}, {"trigger", PatternSync::trigger}, {"plane", PatternSync::plane}}};

void settled(base::TableReader& table, std::vector<std::string>& assumptions) {
  std::erase_if(assumptions, [&table](const std::string& key) { return table.has(key); });
}

void read_limits(base::TableReader& table, std::vector<BitDepthLimit>& limits) {
  const base::TomlNode* list = table.find("min_exposure");
  if (list == nullptr) return;
  if (list->kind != base::TomlNode::Kind::array)
    return table.fail("min_exposure", "is not a list", "give [{ bits = 1, time = \"105 us\" }, ...]");
  limits.clear();
  for (const base::TomlNode& item : list->children) {
    base::TableReader entry(item, table.path_of("min_exposure"), table.context());
    std::uint64_t bits = 1;
    BitDepthLimit limit;
    entry.require("bits", "the depth in bits");
    entry.require("time", "the shortest time");
    entry.read_count("bits", bits, 1, 16);
    entry.read("time", limit.time);
    entry.finish();
    limit.bits = static_cast<int>(bits);
    limits.push_back(limit);
  }
  std::sort(limits.begin(), limits.end(),
            [](const BitDepthLimit& a, const BitDepthLimit& b) { return a.bits < b.bits; });
}

}  // namespace

void read_camera_keys(base::TableReader& table, CameraProfile& camera) {
  settled(table, camera.assumptions);
  table.read_choice<ExposureMode>("exposure", camera.mode, kExposure);
  table.read_choice<bool>("active", camera.active_low, kActive);
  table.read("exposure_offset", camera.exposure_offset);
  table.read("min_exposure", camera.min_exposure);
  table.read("trigger_pulse", camera.trigger_pulse);
  table.read("trigger_delay", camera.trigger_delay);
  table.read("readout", camera.readout);
  table.read("overlap", camera.overlap);
  table.read("overlap_time_max", camera.overlap_time_max);
}

void read_projector_keys(base::TableReader& table, ProjectorProfile& projector) {
  settled(table, projector.assumptions);
  table.read_choice<PatternSync>("sync", projector.sync, kSync);
  table.read_choice<bool>("active", projector.active_low, kActive);
  table.read("advance_pulse", projector.advance_pulse);
  table.read("refresh", projector.refresh);
  table.read("light_period", projector.light_period);
  table.read("vsync_timeout", projector.vsync_timeout);
  table.read("trigger_delay", projector.trigger_delay);
  table.read("black_insertion", projector.black_insertion);
  table.read("settle", projector.settle);
  auto bits = static_cast<std::uint64_t>(projector.whole_refresh_from_bits);
  table.read_count("whole_refresh_from_bits", bits, 0, 16);
  projector.whole_refresh_from_bits = static_cast<int>(bits);
  table.read_whole("planes", projector.planes, 1, 24);
  table.read("plane_period", projector.plane_period);
  table.read("frame_lead", projector.frame_lead);
  read_limits(table, projector.min_exposure);
}

}  // namespace symrig::program
