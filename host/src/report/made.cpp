// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/made.hpp"

#include <ctime>

namespace symrig {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  char text[sizeof "2026-01-31T23:59:58Z"] = "";
  if (gmtime_r(&now, &parts) == nullptr) return {};
  return std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) > 0 ? text : "";
}

}  // namespace symrig
