// SPDX-License-Identifier: Apache-2.0
// Ownership of GLib's objects and errors. Only files of this folder include it.
#pragma once

#include <memory>
#include <string>

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

}  // namespace symrig::camera
