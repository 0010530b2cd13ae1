// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/result.hpp"

namespace symrig {

std::string_view name(ErrorCode code) {
  switch (code) {
    case ErrorCode::bad_argument:
      return "bad_argument";
    case ErrorCode::unknown_name:
      return "unknown_name";
    case ErrorCode::device_lost:
      return "device_lost";
    case ErrorCode::device_refused:
      return "device_refused";
    case ErrorCode::protocol:
      return "protocol";
    case ErrorCode::timeout:
      return "timeout";
    case ErrorCode::frame_missing:
      return "frame_missing";
    case ErrorCode::wrong_light:
      return "wrong_light";
    case ErrorCode::not_found:
      return "not_found";
    case ErrorCode::io:
      return "io";
    case ErrorCode::bad_format:
      return "bad_format";
    case ErrorCode::size_mismatch:
      return "size_mismatch";
    case ErrorCode::bad_value:
      return "bad_value";
    case ErrorCode::limit:
      return "limit";
    case ErrorCode::fault:
      return "fault";
    case ErrorCode::interrupted:
      return "interrupted";
  }
  return "unknown";
}

}  // namespace symrig
