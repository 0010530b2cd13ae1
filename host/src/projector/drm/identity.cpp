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
  std::string_view choice;  // the value's name; empty: use `value`
  std::uint64_t value = 0;
  bool must = false;
};

constexpr std::uint64_t kOpaque = 0xFFFF;
// In nouveau, hue 90 and vibrance 150 mean "unchanged".
constexpr std::uint64_t kNoHue = 90, kNoVibrance = 150;

constexpr auto kRules = std::to_array<Rule>({
    // Tables and matrices of the CRTC. Without them codes pass through unchanged.
    {Kind::crtc, "DEGAMMA_LUT", "", 0, true},
    {Kind::crtc, "CTM", "", 0, true},
    {Kind::crtc, "GAMMA_LUT", "", 0, true},
    {Kind::crtc, "VRR_ENABLED", "", 0},
    // Geometry and transparency.
    {Kind::plane, "rotation", "rotate-0", 0, true},
    {Kind::plane, "alpha", "", kOpaque, true},
    // The signal on the cable: full-range RGB, 8 bits per code.
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
    // Scalers: off, so that the mode is shown pixel by pixel.
    {Kind::connector, "scaling mode", "None"},
    {Kind::connector, "underscan", "off"},
    {Kind::connector, "underscan hborder", "", 0},
    {Kind::connector, "underscan vborder", "", 0},
    {Kind::connector, "left margin", "", 0},
    {Kind::connector, "right margin", "", 0},
    {Kind::connector, "top margin", "", 0},
    {Kind::connector, "bottom margin", "", 0},
    // Asks the display to leave the picture unchanged (CTA-861 IT content).
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

IdentityValue make_identity(const Rule& rule, std::uint32_t object, const Property& property) {
  IdentityValue identity{
      {object, rule.kind, property.id, rule.value}, property, std::string(rule.choice), rule.must};
  if (rule.choice.empty()) {
    identity.wanted = std::to_string(rule.value);
    if (property.range)
      identity.possible = property.range->first <= rule.value && rule.value <= property.range->second;
  } else {
    const auto choice = std::find_if(property.choices.begin(), property.choices.end(),
                                     [&](const auto& each) { return each.first == rule.choice; });
    identity.possible = choice != property.choices.end();
    if (identity.possible) identity.setting.value = choice->second;
  }
  if (property.immutable && property.value != identity.setting.value) identity.possible = false;
  return identity;
}

}  // namespace

std::vector<IdentityValue> identity_values(std::uint32_t object, Kind kind,
                                           std::span<const Property> properties) {
  std::vector<IdentityValue> identities;
  for (const Rule& rule : kRules)
    for (const Property& property : properties)
      if (rule.kind == kind && rule.property == property.name)
        identities.push_back(make_identity(rule, object, property));
  return identities;
}

Gamma straight_gamma(int size) {
  std::vector<std::uint16_t> ramp;
  ramp.reserve(std::max(size, 0));
  for (int i = 0; i < size; ++i)
    ramp.push_back(static_cast<std::uint16_t>(size > 1 ? (65'535LL * i + (size - 1) / 2) / (size - 1) : 0));
  return {ramp, ramp, ramp};
}

std::string complaint(const IdentityValue& identity) {
  return fmt::format("{} property '{}' is '{}' and cannot be '{}'", kind_name(identity.setting.kind),
                     identity.property.name, value_name(identity.property), identity.wanted);
}

}  // namespace symrig::projector::drm
