// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/open_node.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig {

std::string ControlInfo::range() const {
  switch (kind) {
    case ControlKind::boolean:
      return "0 or 1";
    case ControlKind::menu: {
      std::string text;
      for (const MenuItem& item : menu)
        text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", item.value, item.text);
      return text;
    }
    case ControlKind::button:
      return "1 to press it";
    case ControlKind::other:
      return "no number";
    case ControlKind::integer:
    case ControlKind::bitmask:
      break;
  }
  return fmt::format("{} to {} in steps of {}", least, most, step);
}

}  // namespace symrig

namespace symrig::camera {
namespace {

constexpr int kMostControls = 1024;  // stops an endless list if the driver never ends it

constexpr std::int64_t kMostMenuIndex = INT32_MAX;

template <class Field>
std::string text(const Field& field) {
  const auto* const begin = std::begin(field);
  return {begin, std::find(begin, std::end(field), decltype(*begin + 0){0})};
}

ControlKind kind_of(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_INTEGER64:
      return ControlKind::integer;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return ControlKind::boolean;
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return ControlKind::menu;
    case V4L2_CTRL_TYPE_BUTTON:
      return ControlKind::button;
    case V4L2_CTRL_TYPE_BITMASK:
      return ControlKind::bitmask;
    default:
      return ControlKind::other;
  }
}

/// As v4l2-ctl writes it: lower case, one '_' for each run of other characters, none at the end.
std::string control_name(std::string_view title) {
  std::string name;
  for (const char c : title) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) != 0)
      name += static_cast<char>(std::tolower(u));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

std::vector<MenuItem> read_menu(OpenNode& driver, const v4l2_query_ext_ctrl& control) {
  std::vector<MenuItem> items;
  const std::int64_t first = std::clamp<std::int64_t>(control.minimum, 0, kMostMenuIndex);
  for (std::int64_t index = first; index <= std::min<std::int64_t>(control.maximum, first + 255); ++index) {
    v4l2_querymenu answer{};
    answer.id = control.id;
    answer.index = static_cast<std::uint32_t>(index);
    if (driver.call(VIDIOC_QUERYMENU, &answer) != 0) continue;  // the driver has no entry with this number
    const bool number = control.type == V4L2_CTRL_TYPE_INTEGER_MENU;
    items.push_back({index, number ? std::to_string(answer.value) : text(answer.name)});
  }
  return items;
}

ControlInfo to_info(OpenNode& driver, const v4l2_query_ext_ctrl& answer) {
  ControlInfo info;
  info.id = answer.id;
  info.title = text(answer.name);
  info.name = control_name(info.title);
  info.kind = kind_of(answer.type);
  info.wide = answer.type == V4L2_CTRL_TYPE_INTEGER64;
  info.least = answer.minimum;
  info.most = std::max(answer.minimum, answer.maximum);  // some drivers swap the two limits
  info.step = static_cast<std::int64_t>(std::clamp<std::uint64_t>(answer.step, 1, INT64_MAX));
  info.preset = answer.default_value;
  info.read_only = (answer.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
  info.inactive = (answer.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
  if (info.kind == ControlKind::menu) info.menu = read_menu(driver, answer);
  if (info.kind != ControlKind::button && info.kind != ControlKind::other)
    if (const auto value = get_control(driver, info)) info.value = *value;
  return info;
}

struct Access {
  explicit Access(const ControlInfo& info, std::int64_t value) {
    control.id = info.id;
    if (info.wide)
      control.value64 = value;
    else
      control.value = static_cast<std::int32_t>(value);
    list.which = V4L2_CTRL_WHICH_CUR_VAL;
    list.count = 1;
    list.controls = &control;
  }
  Access(const Access&) = delete;
  Access& operator=(const Access&) = delete;
  std::int64_t value(const ControlInfo& info) const {
    if (info.wide) return control.value64;
    return info.kind == ControlKind::bitmask ? static_cast<std::uint32_t>(control.value)
                                             : std::int64_t{control.value};
  }

  v4l2_ext_control control{};
  v4l2_ext_controls list{};
};

/// The nearest value that the control accepts. The upper end of a range may lie between two steps.
std::int64_t nearest_value(const ControlInfo& control, std::int64_t value) {
  const std::int64_t inside = std::clamp(value, control.least, control.most);
  const auto steps = static_cast<std::uint64_t>(control.step);
  const std::uint64_t off = static_cast<std::uint64_t>(inside) - static_cast<std::uint64_t>(control.least);
  const std::uint64_t below = off / steps * steps, left = off - below;
  const std::uint64_t up = below + steps;
  const std::uint64_t room =
      static_cast<std::uint64_t>(control.most) - static_cast<std::uint64_t>(control.least);
  const std::uint64_t taken = left > steps - left && up <= room ? up : below;
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(control.least) + taken);
}

Error not_a_value(const ControlInfo& control, std::string_view text) {
  return {ErrorCode::bad_argument, fmt::format("control {} does not take '{}'", control.name, text),
          "it takes " + control.range()};
}

Result<std::int64_t> checked(const ControlInfo& control, std::int64_t value, std::string_view text) {
  if (control.kind == ControlKind::other)
    return Error{ErrorCode::bad_argument, fmt::format("control {} does not hold a number", control.name),
                 "remove it from the settings"};
  if (control.kind == ControlKind::button) return value;
  if (control.kind == ControlKind::menu) {
    const bool known = std::any_of(control.menu.begin(), control.menu.end(),
                                   [&](const MenuItem& item) { return item.value == value; });
    return known ? Result<std::int64_t>(value) : not_a_value(control, text);
  }
  const std::int64_t nearest = nearest_value(control, value);
  if (nearest == value) return value;
  return Error{ErrorCode::bad_argument,
               fmt::format("control {} takes {}, not {}", control.name, control.range(), value),
               fmt::format("the nearest value is {}", nearest)};
}

}  // namespace

Result<std::vector<ControlInfo>> read_controls(OpenNode& driver) {
  constexpr std::uint32_t kNext = V4L2_CTRL_FLAG_NEXT_CTRL;
  std::vector<ControlInfo> controls;
  std::uint32_t id = 0;
  for (int k = 0; k < kMostControls; ++k) {
    v4l2_query_ext_ctrl answer{};
    answer.id = id | kNext;
    if (const int reason = driver.call(VIDIOC_QUERY_EXT_CTRL, &answer); reason != 0) {
      if (is_gone(reason)) return driver.error(reason, "reading its controls");
      break;
    }
    if (answer.id <= id) break;  // the driver does not advance and would repeat this control for ever
    id = answer.id;
    const bool header = answer.type == V4L2_CTRL_TYPE_CTRL_CLASS;
    if (!header && (answer.flags & V4L2_CTRL_FLAG_DISABLED) == 0) controls.push_back(to_info(driver, answer));
  }
  return controls;
}

Result<ControlInfo> find_control(OpenNode& driver, std::string_view name) {
  SYMRIG_TRY(const auto controls, read_controls(driver));
  std::vector<std::string> names;
  for (const ControlInfo& control : controls) {
    if (control.name == name || control.title == name) return control;
    names.push_back(control.name);
  }
  return Error{ErrorCode::unknown_name, fmt::format("camera {} has no control '{}'", driver.path(), name),
               nearest_hint(name, names)};
}

Result<std::int64_t> control_value(const ControlInfo& control, std::string_view text) {
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value);
  if (parsed.ec == std::errc() && parsed.ptr == end) return checked(control, value, text);
  for (const MenuItem& item : control.menu)
    if (item.text == text) return item.value;
  if (control.kind == ControlKind::boolean) {
    if (text == "on" || text == "true") return 1;
    if (text == "off" || text == "false") return 0;
  }
  return not_a_value(control, text);
}

Result<std::int64_t> get_control(OpenNode& driver, const ControlInfo& control) {
  Access access(control, 0);
  SYMRIG_CHECK(driver.ask(VIDIOC_G_EXT_CTRLS, &access.list, fmt::format("reading control {}", control.name)));
  return access.value(control);
}

Result<void> set_control(OpenNode& driver, const ControlInfo& control, std::int64_t value) {
  SYMRIG_CHECK(checked(control, value, std::to_string(value)));
  if (control.read_only)
    return Error{ErrorCode::device_refused,
                 fmt::format("control {} of camera {} is read-only", control.name, driver.path()),
                 "remove it from the settings"};
  Access access(control, value);
  if (const int reason = driver.call(VIDIOC_S_EXT_CTRLS, &access.list); reason != 0) {
    Error error = driver.error(reason, fmt::format("setting control {} to {}", control.name, value));
    if (control.inactive && !is_gone(reason))
      error.hint = "another control overrides it now: switch off the automatic control first";
    return error;
  }
  if (control.kind == ControlKind::button) return {};
  SYMRIG_TRY(const std::int64_t now, get_control(driver, control));
  if (now == value) return {};
  return Error{
      ErrorCode::device_refused,
      fmt::format("camera {}: control {} became {}, not {}", driver.path(), control.name, now, value),
      control.inactive ? "another control overrides it now: switch off the automatic control first"
                       : "choose another value"};
}

}  // namespace symrig::camera
