// SPDX-License-Identifier: Apache-2.0

#include "projector/drm/screen.hpp"
#include "symrig/projector/internal/drm.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <string_view>

#include <fmt/format.h>

namespace symrig::projector::drm {
namespace {

struct Rule {
  ObjectKind kind;
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
    {ObjectKind::crtc, "DEGAMMA_LUT", "", 0, true},
    {ObjectKind::crtc, "CTM", "", 0, true},
    {ObjectKind::crtc, "GAMMA_LUT", "", 0, true},
    {ObjectKind::crtc, "VRR_ENABLED", "", 0},
    // Geometry and transparency.
    {ObjectKind::plane, "rotation", "rotate-0", 0, true},
    {ObjectKind::plane, "alpha", "", kOpaque, true},
    // The signal on the cable: full-range RGB, 8 bits per code.
    {ObjectKind::connector, "Broadcast RGB", "Full"},
    {ObjectKind::connector, "max bpc", "", 8},
    {ObjectKind::connector, "Colorspace", "Default"},
    {ObjectKind::connector, "HDR_OUTPUT_METADATA", "", 0, true},
    {ObjectKind::connector, "output_csc", "bypass"},
    {ObjectKind::connector, "dither", "off"},
    {ObjectKind::connector, "dithering mode", "off"},
    {ObjectKind::connector, "abm level", "", 0},
    {ObjectKind::connector, "vibrant hue", "", kNoHue},
    {ObjectKind::connector, "color vibrance", "", kNoVibrance},
    // Scalers: off, so that the mode is shown pixel by pixel.
    {ObjectKind::connector, "scaling mode", "None"},
    {ObjectKind::connector, "underscan", "off"},
    {ObjectKind::connector, "underscan hborder", "", 0},
    {ObjectKind::connector, "underscan vborder", "", 0},
    {ObjectKind::connector, "left margin", "", 0},
    {ObjectKind::connector, "right margin", "", 0},
    {ObjectKind::connector, "top margin", "", 0},
    {ObjectKind::connector, "bottom margin", "", 0},
    // Asks the display to leave the picture unchanged (CTA-861 IT content).
    {ObjectKind::connector, "content type", "Graphics"},
    {ObjectKind::connector, "DPMS", "On"},
});

std::string_view kind_name(ObjectKind kind) {
  switch (kind) {
    case ObjectKind::crtc:
      return "CRTC";
    case ObjectKind::connector:
      return "connector";
    case ObjectKind::plane:
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

std::vector<IdentityValue> identity_values(std::uint32_t object, ObjectKind kind,
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

namespace {

struct Object {
  std::uint32_t id;
  ObjectKind kind;
};

/// Properties of the objects in a takeover, each object read once.
class PropertyTable {
 public:
  explicit PropertyTable(Kms& kms) : kms_(kms) {}

  /// A setting for the named property. None if the object does not have it.
  std::optional<Setting> setting(Object object, std::string_view name, std::uint64_t value) {
    for (const Property& property : of(object))
      if (property.name == name) return Setting{object.id, object.kind, property.id, value};
    return std::nullopt;
  }

  const std::vector<Property>& of(Object object) {
    const auto known = known_.find(object.id);
    if (known != known_.end()) return known->second;
    return known_.emplace(object.id, kms_.properties(object.id, object.kind).value).first->second;
  }

 private:
  Kms& kms_;
  std::map<std::uint32_t, std::vector<Property>> known_;
};

bool same_timings(const drmModeModeInfo& a, const drmModeModeInfo& b) {
  const auto key = [](const drmModeModeInfo& m) {
    return std::array{m.clock,
                      std::uint32_t{m.hdisplay},
                      std::uint32_t{m.hsync_start},
                      std::uint32_t{m.hsync_end},
                      std::uint32_t{m.htotal},
                      std::uint32_t{m.vdisplay},
                      std::uint32_t{m.vsync_start},
                      std::uint32_t{m.vsync_end},
                      std::uint32_t{m.vtotal}};
  };
  return key(a) == key(b);
}

/// In atomic commits ACTIVE replaces this property, and the kernel refuses it.
bool only_legacy(const IdentityValue& identity) {
  return identity.property.name == "DPMS";
}

bool to_be_set(const IdentityValue& identity) {
  return identity.possible && identity.property.value != identity.setting.value;
}

}  // namespace

/// Returns an error if pixels would be wrong, else adds a warning.
Result<void> Takeover::cannot(const IdentityValue& identity) {
  const std::string text = complaint(identity);
  if (identity.must)
    return Error{ErrorCode::device_refused, route.connector_name + ": " + text,
                 "pictures would be changed on the way: use another connector or card"};
  warnings.push_back(text);
  return {};
}

Result<std::vector<IdentityValue>> Takeover::identities() {
  std::vector<IdentityValue> all;
  const Object objects[] = {{route.crtc, ObjectKind::crtc},
                            {route.connector, ObjectKind::connector},
                            {route.plane, ObjectKind::plane}};
  for (const Object object : objects) {
    if (object.id == 0) continue;
    const auto properties = kms.properties(object.id, object.kind);
    if (!properties) return refusal(route.connector_name, "cannot read its properties", properties.error);
    for (IdentityValue& identity : identity_values(object.id, object.kind, properties.value)) {
      if (!identity.possible)
        SYMRIG_CHECK(cannot(identity));
      else
        all.push_back(std::move(identity));
    }
  }
  return all;
}

/// Connects plane, CRTC and connector, and switches off everything else on this CRTC.
Result<std::vector<Setting>> Takeover::base_settings(std::uint32_t fb) {
  const auto blob = kms.create_blob(std::as_bytes(std::span(&route.mode, 1)));
  if (!blob) return refusal(route.connector_name, "cannot set its mode", blob.error);
  blobs.push_back(blob.value);
  PropertyTable table(kms);
  std::vector<Setting> settings;
  const auto set = [&](Object object, std::string_view name, std::uint64_t value) {
    if (const auto setting = table.setting(object, name, value)) settings.push_back(*setting);
  };
  const std::uint64_t width = route.mode.hdisplay, height = route.mode.vdisplay;
  const Object plane{route.plane, ObjectKind::plane}, crtc{route.crtc, ObjectKind::crtc};
  set({route.connector, ObjectKind::connector}, "CRTC_ID", route.crtc);
  set(crtc, "MODE_ID", blob.value);
  set(crtc, "ACTIVE", 1);
  set(plane, "FB_ID", fb);
  set(plane, "CRTC_ID", route.crtc);
  // One picture pixel per screen pixel. Positions in the picture are fixed-point with 16 fractional bits.
  for (const auto& [name, value] : {std::pair("SRC_X", std::uint64_t{0}),
                                    {"SRC_Y", 0},
                                    {"SRC_W", width << 16U},
                                    {"SRC_H", height << 16U},
                                    {"CRTC_X", 0},
                                    {"CRTC_Y", 0},
                                    {"CRTC_W", width},
                                    {"CRTC_H", height}})
    set(plane, name, value);
  for (const std::uint32_t other : route.other_planes) {
    set({other, ObjectKind::plane}, "FB_ID", 0);
    set({other, ObjectKind::plane}, "CRTC_ID", 0);
  }
  for (const std::uint32_t other : route.other_connectors) set({other, ObjectKind::connector}, "CRTC_ID", 0);
  return settings;
}

Result<void> Takeover::atomic(std::uint32_t fb) {
  SYMRIG_TRY(auto settings, base_settings(fb));
  const std::string mode = "its mode " + to_string(describe(route.mode)) + " cannot be set";
  if (const Errno error = kms.commit(settings, Commit::test, 0); error != 0)
    return refusal(route.connector_name, mode, error);
  SYMRIG_TRY(const auto all, identities());
  std::vector<IdentityValue> kept;
  for (const IdentityValue& identity : all) {
    if (only_legacy(identity)) continue;
    if (to_be_set(identity)) {
      settings.push_back(identity.setting);
      if (kms.commit(settings, Commit::test, 0) != 0) {
        settings.pop_back();
        SYMRIG_CHECK(cannot(identity));
        continue;
      }
      saved.remember(kms, identity);
    }
    kept.push_back(identity);
  }
  SYMRIG_CHECK(straighten_gamma());
  if (const Errno error = kms.commit(settings, Commit::modeset, 0); error != 0)
    return refusal(route.connector_name, mode, error);
  return verify(settings, kept);
}

Result<void> Takeover::legacy(std::uint32_t fb) {
  for (const std::uint32_t other : route.other_planes) kms.disable_plane(other);
  const std::uint32_t connectors[] = {route.connector};
  const Crtc crtc{.id = route.crtc, .fb = fb, .mode = route.mode};
  if (const Errno error = kms.set_crtc(crtc, connectors); error != 0)
    return refusal(route.connector_name, "its mode " + to_string(describe(route.mode)) + " cannot be set",
                   error);
  kms.hide_cursor(route.crtc);  // fails if the cursor was never shown, which is no error
  SYMRIG_TRY(const auto all, identities());
  std::vector<IdentityValue> kept;
  for (const IdentityValue& identity : all) {
    if (to_be_set(identity)) {
      saved.remember(kms, identity);
      if (kms.set_property(identity.setting) != 0) {
        SYMRIG_CHECK(cannot(identity));
        continue;
      }
    }
    kept.push_back(identity);
  }
  SYMRIG_CHECK(straighten_gamma());
  return verify({}, kept);
}

/// Old drivers have a gamma table, but no property for it.
Result<void> Takeover::straighten_gamma() {
  const auto crtc = kms.crtc(route.crtc);
  if (!crtc || crtc.value.gamma_size <= 1) return {};
  for (const Property& property : kms.properties(route.crtc, ObjectKind::crtc).value)
    if (property.name == "GAMMA_LUT") return {};
  const Gamma straight = straight_gamma(crtc.value.gamma_size);
  auto before = kms.gamma(route.crtc, crtc.value.gamma_size);
  if (before && before.value == straight) return {};
  if (before) saved.remember(std::move(before.value));
  const Errno error = kms.set_gamma(route.crtc, straight);
  const auto after = kms.gamma(route.crtc, crtc.value.gamma_size);
  if (error == 0 && after && after.value == straight) return {};
  warnings.emplace_back("cannot set the CRTC's gamma table to identity");
  return {};
}

/// Checks that the kernel reports what was requested.
Result<void> Takeover::verify(std::span<const Setting> settings, std::span<const IdentityValue> kept) {
  const auto crtc = kms.crtc(route.crtc);
  if (!crtc) return refusal(route.connector_name, "cannot read back its state", crtc.error);
  if (!crtc.value.mode || !same_timings(*crtc.value.mode, route.mode))
    return Error{
        ErrorCode::device_refused,
        route.connector_name + ": it was set to " + to_string(describe(route.mode)) + " but has another mode",
        "try another mode"};
  PropertyTable now(kms);
  const auto holds = [&](const Setting& setting) {
    const auto& properties = now.of({setting.object, setting.kind});
    return std::any_of(properties.begin(), properties.end(), [&](const Property& property) {
      return property.id == setting.property && property.value == setting.value;
    });
  };
  for (const Setting& setting : settings)
    if (!holds(setting) && std::none_of(kept.begin(), kept.end(), [&](const IdentityValue& identity) {
          return identity.setting.object == setting.object && identity.setting.property == setting.property;
        }))
      return Error{ErrorCode::device_refused,
                   fmt::format("{}: property {} of object {} did not take the value {}", route.connector_name,
                               setting.property, setting.object, setting.value),
                   "the driver ignores values that it accepts: use another card"};
  for (const IdentityValue& identity : kept)
    if (!holds(identity.setting)) SYMRIG_CHECK(cannot(identity));
  return {};
}

}  // namespace symrig::projector::drm
