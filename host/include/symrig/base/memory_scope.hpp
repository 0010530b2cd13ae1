// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

namespace symrig {

/// How much memory the process may use, and where data go that do not fit.
struct MemoryBudget {
  std::int64_t bytes = 0;
  std::int64_t unpaged = 0;      ///< what the process needs besides paged memory
  std::filesystem::path folder;  ///< of scratch files, which have no names: nothing is left of them
};

/// While it lives, the budget holds for all PagedMemory of the process. What exceeds it is in scratch files,
/// mapped into memory. A thread watches the memory that the process occupies, and gives pages of these files
/// back before it exceeds the budget. Only one may live at a time: a second one changes nothing.
///
/// Only time depends on a budget, never a result. Memory that is not paged must fit by itself.
class MemoryScope {
 public:
  explicit MemoryScope(const MemoryBudget& budget);
  MemoryScope(const MemoryScope&) = delete;
  MemoryScope& operator=(const MemoryScope&) = delete;
  ~MemoryScope();

  /// Bytes in scratch files now.
  static std::int64_t scratch_bytes();

 private:
  class Watch;
  std::unique_ptr<Watch> watch_;
};

}  // namespace symrig
