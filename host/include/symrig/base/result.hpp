// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace symrig {

/// Stable error codes. A value is never used again, and its meaning never changes. docs/errors.md lists them.
enum class ErrorCode : std::uint16_t {
  // The caller's error: exit code 2.
  bad_argument = 100,  ///< an option or parameter is out of range or malformed
  unknown_name = 101,  ///< no scene, key, algorithm or line of that name
  // A device error: exit code 3.
  device_lost = 200,     ///< the board, camera or projector does not answer
  device_refused = 201,  ///< the board refused a request (its code is in the message)
  protocol = 202,        ///< bytes from the wire break the protocol
  timeout = 203,         ///< an answer or an edge did not come in time
  frame_missing = 204,   ///< fewer frames than exposures
  wrong_light = 205,     ///< photographs contradict what the projector showed
  // An input error: exit code 4.
  not_found = 300,      ///< a file or folder does not exist
  io = 301,             ///< the operating system refused to read or write
  bad_format = 302,     ///< a file is damaged, or not of the expected kind
  size_mismatch = 303,  ///< two things that must share a grid do not
  bad_value = 304,      ///< NaN, infinity, or a value out of its domain in an input
  // A fault or limit: exit code 5.
  limit = 400,        ///< a stated limit (memory, patterns, line on-time) would be broken
  fault = 401,        ///< the board latched a fault during a run
  interrupted = 402,  ///< stopped by the user or by a signal
};

/// The exit code of the `symrig` command for an error: 2 usage, 3 device, 4 bad input, 5 fault or limit.
constexpr int exit_code(ErrorCode code) {
  return 2 + (static_cast<int>(code) / 100 - 1);
}

/// The code's stable name, such as "size_mismatch".
std::string_view name(ErrorCode code);

/// An error in one line. `what` names the thing and the cause, `hint` the next step (may be empty).
struct Error {
  ErrorCode code;
  std::string what;
  std::string hint = {};

  /// "what; hint"
  std::string line() const { return hint.empty() ? what : what + "; " + hint; }
};

/// A value or an Error. Libraries return it; they never print, exit or throw for an error of a user or a rig.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const& { return std::get<1>(state_); }
  Error&& error() && { return std::get<1>(std::move(state_)); }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace symrig

// NOLINTBEGIN(bugprone-macro-parentheses): these parameters are names and declarations, not values.
#define SYMRIG_CONCAT_INNER(a, b) a##b
#define SYMRIG_CONCAT(a, b) SYMRIG_CONCAT_INNER(a, b)
#define SYMRIG_TRY_IMPL(tmp, declaration, expression) \
  auto tmp = (expression);                            \
  if (!tmp) return std::move(tmp).error();            \
  declaration = *std::move(tmp)

/// `SYMRIG_TRY(auto image, read(path));` declares image, or returns the error to the caller.
#define SYMRIG_TRY(declaration, expression) \
  SYMRIG_TRY_IMPL(SYMRIG_CONCAT(symrig_try_, __LINE__), declaration, expression)

#define SYMRIG_CHECK_IMPL(tmp, expression)                 \
  do {                                                     \
    if (auto tmp = (expression); !tmp) return tmp.error(); \
  } while (false)

/// `SYMRIG_CHECK(write(path));` returns the error of a Result<void> to the caller.
#define SYMRIG_CHECK(expression) SYMRIG_CHECK_IMPL(SYMRIG_CONCAT(symrig_check_, __LINE__), expression)
// NOLINTEND(bugprone-macro-parentheses)
