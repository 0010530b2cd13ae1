// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/messages.hpp"

namespace symrig::firmware {

inline void refuse(symrig_wire_Reply& reply, symrig_wire_Code code, uint64_t detail) {
  reply.code = code;
  reply.detail = detail;
}

inline void bad_value(symrig_wire_Reply& reply, uint32_t field) {
  reply.code = symrig_wire_Code_CODE_BAD_VALUE;
  reply.field = field;
}

/// Text that does not fit is cut.
template <size_t N>
void put_text(const char* text, char (&out)[N]) {
  size_t i = 0;
  for (; i + 1 < N && text[i] != 0; ++i) out[i] = text[i];
  out[i] = 0;
}

}  // namespace symrig::firmware
