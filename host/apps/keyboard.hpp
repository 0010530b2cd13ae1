// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

namespace symrig::apps {

/// Single keys from the terminal behind standard input, without Enter. The terminal is as before afterwards.
/// Without a terminal there are no keys.
class Keyboard {
 public:
  Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  ~Keyboard();

  /// The next key that was pressed, or nothing. Does not wait.
  std::optional<char> key();

 private:
  struct Before;
  std::unique_ptr<Before> before_;  // none: no terminal
};

}  // namespace symrig::apps
