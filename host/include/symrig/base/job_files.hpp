// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// The content of an output. An output with the suffix of another format is refused.
enum class FileFormat : std::uint8_t {
  scene,         ///< .h5: binary, never to a descriptor
  registration,  ///< .h5: binary
  picture,       ///< .exr, .pfm, .png: binary
  map,           ///< .exr, .pfm: binary
  program,       ///< .symprog: binary
  log,           ///< .log: photographs of a capture: binary
  page,          ///< .html
  json,          ///< .json
  table,         ///< .csv
  settings,      ///< .toml
  waveform,      ///< .vcd
  matrix,        ///< .npy, .mat: binary
  film,          ///< .y4m: binary
  folder,        ///< of files, which the job makes if only it is missing
};

/// True for "-" and for the system's names of standard output, such as /dev/stdout.
bool is_standard_output(const std::filesystem::path& path);

/// The files that one job reads and writes, declared before any work. check() applies the same rules to every
/// job:
/// - No output is an input, and no two outputs are the same file.
/// - An output is a new file, a regular file, or an open descriptor; a folder of outputs is a new folder, or
///   a folder.
/// - The output's suffix fits its format.
/// Files are compared by device and inode, so links are recognised.
class JobFiles {
 public:
  /// what: the file's name in messages, such as "the scene". An empty path is ignored.
  JobFiles& reads(std::string_view what, const std::filesystem::path& path);
  /// The pictures and settings in a folder of photographs, and the files that the settings name.
  JobFiles& reads_folder(std::string_view what, const std::filesystem::path& folder);
  /// A TOML file and the files that it names: profiles, a sensor, levels.
  JobFiles& reads_settings(std::string_view what, const std::filesystem::path& path);
  /// The files that a text names which is in no file; names are relative to the current folder.
  JobFiles& reads_settings_text(std::string_view what, std::string_view text);
  /// option: the output's name in messages, such as "--json". Text may go to "-" and to open descriptors.
  JobFiles& writes(std::string_view option, const std::filesystem::path& path, FileFormat format);
  /// A file that an input names, but that this output measures again. Only this output may replace it.
  JobFiles& measures_anew(std::string_view option, const std::filesystem::path& path);

  /// fails: bad_argument (an output is an input or another output, or has another format's suffix); not_found
  /// (no such folder); io (a folder, device, pipe or socket; or a folder without write permission).
  Result<void> check() const;

 private:
  struct Input {
    std::string what;
    std::filesystem::path path;
  };
  struct Output {
    std::string option;
    std::filesystem::path path;
    FileFormat format;
  };
  Result<void> check_inputs(const Output& output) const;
  Result<void> check_others(std::size_t k) const;
  Result<void> check_redirection() const;

  std::vector<Input> inputs_;
  std::vector<Output> outputs_;
  std::vector<Input> anew_;  ///< `what` is the output's option
};

/// Writes text to "-", to a descriptor such as /dev/fd/3, or with write_file_atomically().
/// fails: io, not_found.
Result<void> write_text_output(const std::filesystem::path& path, std::string_view text);

}  // namespace symrig
