// SPDX-License-Identifier: Apache-2.0
#include "keyboard.hpp"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::apps {

struct Keyboard::Before {
  termios settings;
};

Keyboard::Keyboard() {
  // A job in the background must not change the terminal: the system would stop it.
  if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp()) return;
  termios settings{};
  if (tcgetattr(STDIN_FILENO, &settings) != 0) return;
  before_ = std::make_unique<Before>(Before{settings});
  // Ctrl-C stays a signal.
  settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  tcsetattr(STDIN_FILENO, TCSANOW, &settings);
}

Keyboard::~Keyboard() {
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &before_->settings);
}

std::optional<char> Keyboard::key() {
  if (!before_) return std::nullopt;
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char pressed = 0;
  if (poll(&input, 1, 0) != 1 || (input.revents & POLLIN) == 0 || read(STDIN_FILENO, &pressed, 1) != 1)
    return std::nullopt;
  return pressed;
}

}  // namespace symrig::apps
