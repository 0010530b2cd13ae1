// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// What the bench's own tests need in the guest. They are of no use outside: each says so and fails.
namespace symrig::bench_vm {

/// A $BENCH_... variable; the test fails if the guest has no such device.
std::string place(const char* variable);

/// CLOCK_MONOTONIC in nanoseconds.
std::int64_t now_ns();

/// Sleeps until CLOCK_MONOTONIC shows `ns`.
void sleep_until(std::int64_t ns);

/// The whole of a small file; empty if it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Writes a file that exists, as sysfs wants it: in one write.  true if the kernel took it.
bool write_text(const std::filesystem::path& path, std::string_view text);

/// An output that was set, as the kernel traced it.
struct TracedLevel {
  int line = 0;  ///< offset on the bench's chip
  bool level = false;
  std::int64_t stamp_ns = 0;  ///< CLOCK_MONOTONIC, in whole microseconds
};

/// Forgets what was traced.
void clear_trace();
/// What was set on the bench's chip since then, in order.
std::vector<TracedLevel> traced_levels();

}  // namespace symrig::bench_vm
