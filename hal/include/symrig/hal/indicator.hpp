// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig::hal {

/// The light that shows the board's state to a person.
class Indicator {
 public:
  virtual void show(bool on) = 0;

 protected:
  ~Indicator() = default;
};

}  // namespace symrig::hal
