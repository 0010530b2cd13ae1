// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/identity.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

namespace symrig::projector::drm {
namespace {

struct Rule {
  Kind kind;
  std::string_view property;
  std::string_view choice;  // by name; empty: `value`
  std::uint64_t value = 0;
  bool must = false;
};

constexpr std::uint64_t kOpaque = 0xFFFF;
// nouveau counts hue from 90 and vibrance from 150, both "unchanged".
constexpr std::uint64_t kNoHue = 90, kNoVibrance = 150;

constexpr auto kRules = std::to_array<Rule>({
    // Tables and matrices of the CRTC: none of them means that codes pass through.
    {Kind::crtc, "DEGAMMA_LUT", "", 0, true},
    {Kind::crtc, "CTM", "", 0, true},
    {Kind::crtc, "GAMMA_LUT", "", 0, true},
    {Kind::crtc, "VRR_ENABLED", "", 0},
    // Geometry and transparency.
    {Kind::plane, "rotation", "rotate-0", 0, true},
    {Kind::plane, "alpha", "", kOpaque, true},
    // What goes over the wire: full-range RGB, eight bits for eight bits.
    {Kind::connector, "Broadcast RGB", "Full"},
    {Kind::connector, "max bpc", "", 8},
    {Kind::connector, "Colorspace", "Default"},
    {Kind::connector, "HDR_OUTPUT_METADATA", "", 0, true},
    {Kind::connector, "output_csc", "bypass"},
    {Kind::connector, "dither", "off"},
    {Kind::connector, "dithering mode", "off"},
    {Kind::connector, "abm level", "", 0},
    {Kind::connector, "vibrant hue", "", kNoHue},
    {Kind::connector, "color vibrance", "", kNoVibrance},
    // Scalers: a mode is shown pixel by pixel.
    {Kind::connector, "scaling mode", "None"},
    {Kind::connector, "underscan", "off"},
    {Kind::connector, "underscan hborder", "", 0},
    {Kind::connector, "underscan vborder", "", 0},
    {Kind::connector, "left margin", "", 0},
    {Kind::connector, "right margin", "", 0},
    {Kind::connector, "top margin", "", 0},
    {Kind::connector, "bottom margin", "", 0},
    // Asks the display itself to leave the picture alone (CTA-861 IT content).
    {Kind::connector, "content type", "Graphics"},
    {Kind::connector, "DPMS", "On"},
});

std::string_view kind_name(Kind kind) {
  switch (kind) {
    case Kind::crtc:
      return "CRTC";
    case Kind::connector:
      return "connector";
    case Kind::plane:
      return "plane";
  }
  return "object";
}

std::string value_name(const Property& property) {
  for (const auto& [name, value] : property.choices)
    if (value == property.value) return name;
  return std::to_string(property.value);
}

Wish make_wish(const Rule& rule, std::uint32_t object, const Property& property) {
  Wish wish{{object, rule.kind, property.id, rule.value}, property, std::string(rule.choice), rule.must};
  if (rule.choice.empty()) {
    wish.wanted = std::to_string(rule.value);
    if (property.range)
      wish.possible = property.range->first <= rule.value && rule.value <= property.range->second;
  } else {
    const auto choice = std::find_if(property.choices.begin(), property.choices.end(),
                                     [&](const auto& each) { return each.first == rule.choice; });
    wish.possible = choice != property.choices.end();
    if (wish.possible) wish.setting.value = choice->second;
  }
  if (property.immutable && property.value != wish.setting.value) wish.possible = false;
  return wish;
}

}  // namespace

std::vector<Wish> identity_wishes(std::uint32_t object, Kind kind, std::span<const Property> properties) {
  std::vector<Wish> wishes;
  for (const Rule& rule : kRules)
    for (const Property& property : properties)
      if (rule.kind == kind && rule.property == property.name)
        wishes.push_back(make_wish(rule, object, property));
  return wishes;
}

Gamma straight_gamma(int size) {
  std::vector<std::uint16_t> ramp;
  ramp.reserve(std::max(size, 0));
  for (int i = 0; i < size; ++i)
    ramp.push_back(static_cast<std::uint16_t>(size > 1 ? (65'535LL * i + (size - 1) / 2) / (size - 1) : 0));
  return {ramp, ramp, ramp};
}

std::string complaint(const Wish& wish) {
  return fmt::format("{} property '{}' is '{}' and cannot be '{}'", kind_name(wish.setting.kind),
                     wish.property.name, value_name(wish.property), wish.wanted);
}

}  // namespace symrig::projector::drm
