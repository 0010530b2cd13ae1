// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// `--from DIR`, `--projector ROWSxCOLUMNS`, `--mirrored` and `--unchecked`, shared by calibrate and fit.
struct CodeFolder {
  std::string folder, projector;
  bool mirrored = false, unchecked = false;
};

/// Adds the options. The command decides whether --from is required.
CLI::Option* add_code_folder(CLI::App& command, CodeFolder& arguments);

/// Reads the photographs of a Gray-code sequence.  fails: bad_argument (--projector), as
/// read_gray_code_folder.
Result<CodePhotographs> read_code_folder(const CodeFolder& arguments, const Progress& progress);

/// How to decode them.
DecodeOptions decode_options(const CodeFolder& arguments);

/// The last part of the folder's path. A scene made from the folder gets this name.
std::string folder_name(const std::string& folder);

/// Help text: what the folder must contain.
inline constexpr const char* kCodeFolderHelp =
    "DIR contains the photographs of one Gray-code sequence (PNG, EXR or PFM), in the order of "
    "their names:\n"
    "  1. column bits, most significant first, each followed by its complement\n"
    "  2. row bits in the same way\n"
    "  3. white, then black\n"
    "With --projector, the complements or the row bits may be missing.\n"
    "OpenCV's Gray-code generator writes this order.\n";

}  // namespace symrig::apps
