// SPDX-License-Identifier: Apache-2.0
#include "memory_option.hpp"

#include "symrig/base/text.hpp"

namespace symrig::apps {

void add_memory(CLI::App& command, std::string& memory) {
  command
      .add_option(
          "--memory", memory,
          "Memory to use, such as 4G; what needs more stays on the disk (default: half of what is free)")
      ->type_name("SIZE");
}

Result<std::int64_t> memory_of(const std::string& memory) {
  if (memory.empty()) return std::int64_t{0};
  auto bytes = parse_byte_size(memory);
  if (bytes) return bytes;
  return Error{bytes.error().code, "--memory: " + bytes.error().what, bytes.error().hint};
}

}  // namespace symrig::apps
