// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig::hal {

/// The light that shows a person how the board is.
class Indicator {
 public:
  virtual void show(bool on) = 0;

 protected:
  ~Indicator() = default;
};

}  // namespace symrig::hal
