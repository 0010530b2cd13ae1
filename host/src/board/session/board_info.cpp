// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/board_info.hpp"

#include <algorithm>

namespace symrig {

int BoardInfo::line(std::string_view name) const {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [name](const LineInfo& info) { return info.name == name; });
  return found == lines.end() ? -1 : static_cast<int>(found - lines.begin());
}

}  // namespace symrig
