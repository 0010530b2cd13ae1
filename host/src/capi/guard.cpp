// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>

namespace symrig::capi {
namespace {

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
