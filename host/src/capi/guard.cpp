// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>

namespace symrig::capi {
namespace {

constexpr bool same(ErrorCode ours, symrig_code theirs) {
  return static_cast<int>(ours) == static_cast<int>(theirs);
}
static_assert(same(ErrorCode::bad_argument, SYMRIG_BAD_ARGUMENT) &&
              same(ErrorCode::unknown_name, SYMRIG_UNKNOWN_NAME) &&
              same(ErrorCode::device_lost, SYMRIG_DEVICE_LOST) &&
              same(ErrorCode::device_refused, SYMRIG_DEVICE_REFUSED) &&
              same(ErrorCode::protocol, SYMRIG_PROTOCOL) && same(ErrorCode::timeout, SYMRIG_TIMEOUT) &&
              same(ErrorCode::frame_missing, SYMRIG_FRAME_MISSING) &&
              same(ErrorCode::not_found, SYMRIG_NOT_FOUND) && same(ErrorCode::io, SYMRIG_IO) &&
              same(ErrorCode::bad_format, SYMRIG_BAD_FORMAT) &&
              same(ErrorCode::size_mismatch, SYMRIG_SIZE_MISMATCH) &&
              same(ErrorCode::bad_value, SYMRIG_BAD_VALUE) && same(ErrorCode::limit, SYMRIG_LIMIT) &&
              same(ErrorCode::fault, SYMRIG_FAULT) && same(ErrorCode::interrupted, SYMRIG_INTERRUPTED));

/// Copies a text, cut between two UTF-8 characters if it is too long.
template <std::size_t N>
void copy(const std::string& text, char (&out)[N]) {
  std::size_t size = std::min(text.size(), N - 1);
  while (size > 0 && size < text.size() && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  std::memcpy(out, text.data(), size);
  out[size] = '\0';
}

}  // namespace

int report(const Error& failure, symrig_error* error) {
  const int code = static_cast<int>(failure.code);
  if (error == nullptr) return code;
  error->code = code;
  copy(failure.what, error->what);
  copy(failure.hint, error->hint);
  return code;
}

int give_text(std::string_view text, char** out, symrig_error* error) {
  char* copy = static_cast<char*>(std::malloc(text.size() + 1));
  if (copy == nullptr) return report({ErrorCode::limit, "out of memory", ""}, error);
  std::memcpy(copy, text.data(), text.size());
  copy[text.size()] = '\0';
  *out = copy;
  return 0;
}

}  // namespace symrig::capi

uint32_t symrig_api_version() {
  return SYMRIG_API_VERSION;
}

const char* symrig_version() {
  return SYMRIG_VERSION;
}

const char* symrig_error_name(int code) {
  // name() gives string literals.
  return symrig::name(static_cast<symrig::ErrorCode>(code)).data();
}

void symrig_free(char* text) {
  std::free(text);
}
