// SPDX-License-Identifier: Apache-2.0
#include "scene_for_c.h"

#include <array>

int main(int count, char** words) {
  std::array<float, 99> pattern{};
  std::array<float, 99> photograph{};
  return count == 2 ? make_scene(words[1], pattern.data(), photograph.data()) : 9;
}
