// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/features.hpp"

#include "symrig/base/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace symrig::camera {
namespace {

// A camera rounds a real value to its own steps. A larger difference is another value.
constexpr double kRounding = 1e-4;

template <class Number>
std::optional<Number> parsed(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return number;
}

void add_names(ArvGc* genicam, const char* category, int depth, std::vector<std::string>& names) {
  ArvGcNode* const node = arv_gc_get_node(genicam, category);
  if (depth == 0 || node == nullptr || ARV_IS_GC_CATEGORY(node) == 0) return;
  for (const GSList* item = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); item != nullptr;
       item = item->next) {
    const auto* const name = static_cast<const char*>(item->data);
    ArvGcNode* const feature = arv_gc_get_node(genicam, name);
    if (feature == nullptr) continue;
    if (ARV_IS_GC_CATEGORY(feature) != 0)
      add_names(genicam, name, depth - 1, names);
    else
      names.emplace_back(name);
  }
}

ControlKind kind_of(ArvGcNode* node) {
  if (ARV_IS_GC_COMMAND(node) != 0) return ControlKind::button;
  if (ARV_IS_GC_ENUMERATION(node) != 0) return ControlKind::menu;
  if (ARV_IS_GC_BOOLEAN(node) != 0) return ControlKind::boolean;
  if (ARV_IS_GC_FLOAT(node) != 0) return ControlKind::other;
  return ARV_IS_GC_INTEGER(node) != 0 ? ControlKind::integer : ControlKind::other;
}

}  // namespace

bool Features::has(std::string_view name) const {
  GLibError error;
  return arv_device_is_feature_available(device_, std::string(name).c_str(), error.out()) != 0 && !error;
}

std::string Features::first_of(std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names)
    if (has(name)) return std::string(name);
  return {};
}

std::vector<std::string> Features::names() const {
  std::vector<std::string> names;
  add_names(arv_device_get_genicam(device_), "Root", 8, names);
  return names;
}

std::vector<std::string> Features::entries(std::string_view name) const {
  guint count = 0;
  GLibError error;
  const char** const list = arv_device_dup_available_enumeration_feature_values_as_strings(
      device_, std::string(name).c_str(), &count, error.out());
  std::vector<std::string> entries;
  if (list != nullptr) entries.assign(list, list + count);
  g_free(static_cast<gpointer>(list));
  return entries;
}

Error Features::refusal(const GLibError& error, std::string_view doing) const {
  if (error.silent())
    return {ErrorCode::device_lost, fmt::format("camera {}: {} failed: {}", camera_, doing, error.text()),
            "check its cable and power"};
  return {ErrorCode::device_refused, fmt::format("camera {}: {} failed: {}", camera_, doing, error.text()),
          "give a value that the camera takes in this state"};
}

Error Features::became(std::string_view name, std::string_view now, std::string_view wanted) const {
  return {ErrorCode::device_refused,
          fmt::format("camera {}: feature {} became {}, not {}", camera_, name, now, wanted),
          fmt::format("give {}", now)};
}

Error Features::no_value(std::string_view name, std::string_view value, std::string hint) const {
  return {ErrorCode::bad_argument,
          fmt::format("camera {}: feature {} does not take '{}'", camera_, name, value), std::move(hint)};
}

Result<ArvGcNode*> Features::node(std::string_view name) const {
  ArvGcNode* const node = arv_device_get_feature(device_, std::string(name).c_str());
  if (node != nullptr && ARV_IS_GC_FEATURE_NODE(node) != 0) return node;
  return Error{ErrorCode::unknown_name, fmt::format("camera {} has no feature '{}'", camera_, name),
               nearest_hint(name, names())};
}

Result<void> Features::set(std::string_view name, std::string_view value) {
  SYMRIG_TRY(ArvGcNode* const found, node(name));
  switch (kind_of(found)) {
    case ControlKind::button:
      if (value != "true") return no_value(name, value, "it is a command: give true");
      return execute(name);
    case ControlKind::menu:
      return set_entry(name, value);
    case ControlKind::boolean:
      return set_switch(name, value);
    default:
      break;
  }
  if (ARV_IS_GC_FLOAT(found) != 0) return set_number(name, value, false);
  if (ARV_IS_GC_INTEGER(found) != 0) return set_number(name, value, true);
  return set_text(name, value);
}

Result<void> Features::set_text(std::string_view name, std::string_view value) {
  GLibError error;
  const std::string key(name);
  arv_device_set_string_feature_value(device_, key.c_str(), std::string(value).c_str(), error.out());
  if (error) return refusal(error, fmt::format("setting {} to {}", name, value));
  const char* const now = arv_device_get_string_feature_value(device_, key.c_str(), error.out());
  if (error) return refusal(error, fmt::format("reading {}", name));
  return now != nullptr && value == now ? Result<void>() : became(name, now == nullptr ? "" : now, value);
}

Result<void> Features::set_entry(std::string_view name, std::string_view value) {
  const auto known = entries(name);
  if (std::ranges::find(known, value) == known.end())
    return no_value(name, value, nearest_hint(value, known));
  return set_text(name, value);
}

Result<void> Features::set_switch(std::string_view name, std::string_view value) {
  if (value != "true" && value != "false") return no_value(name, value, "give true or false");
  const gboolean wanted = value == "true" ? 1 : 0;
  GLibError error;
  const std::string key(name);
  arv_device_set_boolean_feature_value(device_, key.c_str(), wanted, error.out());
  if (error) return refusal(error, fmt::format("setting {} to {}", name, value));
  const gboolean now = arv_device_get_boolean_feature_value(device_, key.c_str(), error.out());
  if (error) return refusal(error, fmt::format("reading {}", name));
  return now == wanted ? Result<void>() : became(name, now != 0 ? "true" : "false", value);
}

Result<void> Features::set_number(std::string_view name, std::string_view value, bool whole) {
  const auto integer_value = parsed<std::int64_t>(value);
  const auto real_value = parsed<double>(value);
  if (!real_value || !std::isfinite(*real_value) || (whole && !integer_value))
    return no_value(name, value, whole ? "give a whole number" : "give a number");
  GLibError error;
  const std::string key(name);
  double least = 0, most = 0;
  if (whole) {
    SYMRIG_TRY(const auto limits, bounds(name));
    least = static_cast<double>(limits.first);
    most = static_cast<double>(limits.second);
  } else {
    SYMRIG_TRY(const auto limits, real_bounds(name));
    least = limits.first;
    most = limits.second;
  }
  if (*real_value < least || *real_value > most)
    return no_value(name, value, fmt::format("it takes {:.10g} to {:.10g}", least, most));
  if (whole)
    arv_device_set_integer_feature_value(device_, key.c_str(), *integer_value, error.out());
  else
    arv_device_set_float_feature_value(device_, key.c_str(), *real_value, error.out());
  if (error) return refusal(error, fmt::format("setting {} to {}", name, value));
  if (whole) {
    SYMRIG_TRY(const std::int64_t now, integer(name));
    return now == *integer_value ? Result<void>() : became(name, std::to_string(now), value);
  }
  SYMRIG_TRY(const double now, real(name));
  const bool same = std::abs(now - *real_value) <= kRounding * std::abs(*real_value);
  return same ? Result<void>() : became(name, fmt::format("{:.10g}", now), value);
}

Result<void> Features::execute(std::string_view name) {
  GLibError error;
  arv_device_execute_command(device_, std::string(name).c_str(), error.out());
  if (error) return refusal(error, fmt::format("the command {}", name));
  return {};
}

Result<std::int64_t> Features::integer(std::string_view name) const {
  GLibError error;
  const auto value = arv_device_get_integer_feature_value(device_, std::string(name).c_str(), error.out());
  if (error) return refusal(error, fmt::format("reading {}", name));
  return std::int64_t{value};
}

Result<double> Features::real(std::string_view name) const {
  GLibError error;
  const double value = arv_device_get_float_feature_value(device_, std::string(name).c_str(), error.out());
  if (error) return refusal(error, fmt::format("reading {}", name));
  return value;
}

Result<std::pair<std::int64_t, std::int64_t>> Features::bounds(std::string_view name) const {
  GLibError error;
  gint64 least = 0, most = 0;
  arv_device_get_integer_feature_bounds(device_, std::string(name).c_str(), &least, &most, error.out());
  if (error) return refusal(error, fmt::format("reading the limits of {}", name));
  return std::pair<std::int64_t, std::int64_t>{least, most};
}

Result<std::pair<double, double>> Features::real_bounds(std::string_view name) const {
  GLibError error;
  double least = 0, most = 0;
  arv_device_get_float_feature_bounds(device_, std::string(name).c_str(), &least, &most, error.out());
  if (error) return refusal(error, fmt::format("reading the limits of {}", name));
  return std::pair<double, double>{least, most};
}

std::optional<ControlInfo> Features::info(std::string_view name) const {
  const auto found = node(name);
  if (!found || !has(name)) return {};
  ControlInfo info;
  info.name = info.title = name;
  info.kind = kind_of(*found);
  if (info.kind == ControlKind::menu)
    for (const std::string& entry : entries(name))
      info.menu.push_back({static_cast<std::int64_t>(info.menu.size()), entry});
  if (info.kind == ControlKind::integer) {
    if (const auto limits = bounds(name)) std::tie(info.least, info.most) = *limits;
    if (const auto value = integer(name)) info.value = *value;
  }
  if (info.kind == ControlKind::menu) {
    GLibError error;
    const char* const now = arv_device_get_string_feature_value(device_, info.name.c_str(), error.out());
    for (const MenuItem& item : info.menu)
      if (now != nullptr && item.text == now) info.value = item.value;
  }
  return info;
}

}  // namespace symrig::camera
