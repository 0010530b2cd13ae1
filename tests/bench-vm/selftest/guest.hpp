// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Functions for the bench's own tests in the guest. Outside the guest each reports an error and fails.
namespace symrig::bench_vm {

/// The value of a $BENCH_... variable. Fails the test if the guest has no such device.
std::string place(const char* variable);

/// CLOCK_MONOTONIC in nanoseconds.
std::int64_t now_ns();

/// Sleeps until CLOCK_MONOTONIC shows `ns`.
void sleep_until(std::int64_t ns);

/// The content of a small file. Empty if it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Writes an existing file with one write, as sysfs requires. true: the kernel accepted it.
bool write_text(const std::filesystem::path& path, std::string_view text);

/// An output that was set, from the kernel's trace.
struct TracedLevel {
  int line = 0;  ///< offset on the bench's chip
  bool level = false;
  std::int64_t stamp_ns = 0;  ///< CLOCK_MONOTONIC, in whole microseconds
};

/// Discards the trace.
void clear_trace();
/// The outputs of the bench's chip that were set since clear_trace(), in order.
std::vector<TracedLevel> traced_levels();

}  // namespace symrig::bench_vm
