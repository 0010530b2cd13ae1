// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/picture_facts.hpp"
#include "symrig/job/light_sequence.hpp"
#include "symrig/job/relighter.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace symrig {

/// Where the pictures of many lights go.
struct SequenceOutput {
  std::filesystem::path path;   ///< a .y4m film, or a folder, which is made if only it is missing
  std::string suffix = ".exr";  ///< of pictures in a folder: .exr, .pfm, or .png for viewing
  std::optional<double>
      exposure;         ///< of .png and films; empty: that of the flood-lit scene (automatic_exposure)
  bool resume = false;  ///< goes on where an earlier call with the same scene stopped (a folder only)
  std::string asked =
      {};  ///< what else the pictures depend on, such as views; a resumed call must ask the same
  PictureFacts facts = {};  ///< of .exr files; scene must be set. The light is filled in.
};

struct SequenceResult {
  std::size_t pictures = 0;  ///< in the output now
  std::size_t kept = 0;      ///< of them from an earlier call
  Grid grid;
  int channels = 1;
  double exposure = 1;
};

/// The name of the file, beside the pictures, that says what they are made of (docs/command-line.md, "Many
/// lights").
inline constexpr const char* kSequenceFile = "relight.json";

/// Relights a scene with each light of a sequence; reads T once for Relighter::kBatch lights. Pictures of a
/// folder are written atomically; so is a film. A picture is kept by a resumed call if scene, request and
/// light are the same.
/// fails: bad_argument (no known suffix; the folder of the lights; the folder has pictures and resume is not
/// set, or they are of another scene or request); interrupted (says how many pictures are written); as
/// LightSequence::read, write_image and Y4mWriter.
Result<SequenceResult> relight_sequence(const Relighter& relighter, const LightSequence& lights,
                                        const SequenceOutput& output, const Progress& progress = {});

}  // namespace symrig
