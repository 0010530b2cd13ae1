// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/calibration/gray_code.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// `--from DIR`, `--projector ROWSxCOLUMNS` and `--unchecked`, shared by calibrate and fit.
struct CodeFolder {
  std::string folder, projector;
  bool unchecked = false;
};

/// Adds the options; --from is left to the command to require.
CLI::Option* add_code_folder(CLI::App& command, CodeFolder& arguments);

/// Reads the photographs of a Gray-code sequence.  fails: bad_argument (--projector), as
/// read_gray_code_folder.
Result<CodePhotographs> read_code_folder(const CodeFolder& arguments, const Progress& progress);

/// Last part of the folder's name: how a scene made from it is called.
std::string folder_name(const std::string& folder);

/// Help text on what the folder must hold.
inline constexpr const char* kCodeFolderHelp =
    "DIR holds the photographs of one Gray-code sequence (PNG, EXR or PFM), in the order of their names: "
    "column bits, most\n"
    "significant first, each followed by its complement; row bits likewise; white; black. OpenCV's generator "
    "makes it so.\n";

}  // namespace symrig::apps
