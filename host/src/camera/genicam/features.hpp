// SPDX-License-Identifier: Apache-2.0
// A camera's settings by their GenICam names, and the ownership of GLib's objects and errors. Only files of
// this folder include it.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera_info.hpp"

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arv.h>

namespace symrig::camera {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};

/// A reference to a GObject.
template <class T>
using Owned = std::unique_ptr<T, Unref>;

/// Passed to a call that reports a GError: `call(..., error.out())`.
class GLibError {
 public:
  GLibError() = default;
  GLibError(const GLibError&) = delete;
  GLibError& operator=(const GLibError&) = delete;
  ~GLibError() { g_clear_error(&error_); }

  GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_ == nullptr ? "unknown error" : error_->message; }
  /// The camera did not answer, or is gone.
  bool silent() const {
    return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT) != 0 ||
           g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_CONNECTED) != 0 ||
           g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != 0;
  }

 private:
  GError* error_ = nullptr;
};

/// The features of one open camera. Not thread-safe.
class Features {
 public:
  Features(ArvDevice* device, std::string camera) : device_(device), camera_(std::move(camera)) {}

  /// The camera has the feature, and it can be used now.
  bool has(std::string_view name) const;
  /// The first of several names for one setting. Empty: the camera has none of them.
  std::string first_of(std::initializer_list<std::string_view> names) const;
  /// The names of all features, as the camera's categories list them.
  std::vector<std::string> names() const;
  /// The entries of an enumeration that can be chosen now.
  std::vector<std::string> entries(std::string_view name) const;

  /// Sets a feature of any kind and reads it back. A command is executed if the value is true.
  /// fails: unknown_name (with near names), bad_argument (not a value of this feature), device_refused (the
  /// camera refuses it, or has another value afterwards), device_lost.
  Result<void> set(std::string_view name, std::string_view value);
  Result<void> execute(std::string_view name);
  Result<std::int64_t> integer(std::string_view name) const;
  Result<double> real(std::string_view name) const;
  /// The least and greatest value of an integer.
  Result<std::pair<std::int64_t, std::int64_t>> bounds(std::string_view name) const;
  Result<std::pair<double, double>> real_bounds(std::string_view name) const;
  /// As `symrig info` shows it. None: the feature cannot be read.
  std::optional<ControlInfo> info(std::string_view name) const;

 private:
  Result<ArvGcNode*> node(std::string_view name) const;
  Result<void> set_number(std::string_view name, std::string_view value, bool whole);
  Result<void> set_text(std::string_view name, std::string_view value);
  Result<void> set_entry(std::string_view name, std::string_view value);
  Result<void> set_switch(std::string_view name, std::string_view value);
  Error refusal(const GLibError& error, std::string_view doing) const;
  Error became(std::string_view name, std::string_view now, std::string_view wanted) const;
  Error no_value(std::string_view name, std::string_view value, std::string hint) const;

  ArvDevice* device_;
  std::string camera_;
};

}  // namespace symrig::camera
