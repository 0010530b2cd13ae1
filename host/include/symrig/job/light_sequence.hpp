// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/y4m.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// Many lights for one scene: the pictures of a folder in the order of their names, or the frames of a film.
class LightSequence {
 public:
  /// path: a folder with .exr, .png or .pfm pictures (other files are ignored), or a .y4m film.
  /// grid, of: the size that each light must have, and what has it, for messages.
  /// fails: not_found, io, bad_argument (no picture; two with one name but for the suffix), and as
  /// Y4mReader::open; size_mismatch (a film of another size).
  static Result<LightSequence> open(const std::filesystem::path& path, Grid grid, const std::string& of);

  const std::filesystem::path& path() const { return path_; }
  std::size_t size() const { return film_ ? film_->frames() : pictures_.size(); }
  /// The name of a light without folder and suffix: "spot", and in a film "walk-00012" for its twelfth frame.
  std::string name(std::size_t light) const;
  /// Of a film.
  std::optional<FrameRate> rate() const;

  /// One channel of linear light. Lights may be read by several threads at once.
  /// fails: as read_light.
  Result<Image<float>> read(std::size_t light) const;

 private:
  LightSequence() = default;

  std::filesystem::path path_;
  Grid grid_;
  std::string of_;
  std::vector<std::filesystem::path> pictures_;
  std::optional<Y4mReader> film_;
};

}  // namespace symrig
