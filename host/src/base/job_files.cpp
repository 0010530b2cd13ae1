// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/job_files.hpp"

#include "base/descriptors.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;
using base::descriptor_of, base::FilePlace, base::folder_of, base::place_of;

constexpr std::uint64_t kMostText = 1 << 24;

bool is_picture(const fs::path& path) {
  constexpr std::array<std::string_view, 4> kSuffixes{".png", ".exr", ".pfm", ".raw"};
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kSuffixes.begin(), kSuffixes.end(), suffix) != kSuffixes.end();
}

/// Position of the quote that ends the string which begins at `begin`, on the same line; npos if there is
/// none.
std::size_t closing_quote(std::string_view text, std::size_t begin) {
  for (std::size_t k = begin + 1; k < text.size() && text[k] != '\n'; ++k) {
    if (text[k] == text[begin]) return k;
    if (text[k] == '\\' && text[begin] == '"') ++k;
  }
  return std::string_view::npos;
}

/// All strings in quotes, without those in comments.
std::set<std::string> quoted(std::string_view text) {
  std::set<std::string> strings;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '#') k = std::min(text.find('\n', k), text.size() - 1);
    if (text[k] != '"' && text[k] != '\'') continue;
    const std::size_t end = closing_quote(text, k);
    if (end == std::string_view::npos) continue;
    strings.emplace(text.substr(k + 1, end - k - 1));
    k = end;
  }
  return strings;
}

/// The pictures of a folder. Empty if the folder cannot be read; the code that reads it reports the error.
std::vector<fs::path> photographs_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  if (folder.empty()) return paths;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_picture(at->path())) paths.push_back(at->path());
  return paths;
}

/// Regular files that a TOML text names in a string, relative to `folder`. It needs no knowledge of the keys.
/// A string that happens to be the name of a file protects that file, which does no harm.
std::vector<fs::path> files_named_in(std::string_view text, const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const std::string& name : quoted(text)) {
    if (name.empty() || name.size() > 4096 || name.find('\0') != std::string::npos) continue;
    const fs::path path = folder / name;
    const auto place = place_of(path);
    if (place && place->regular()) paths.push_back(path);
  }
  return paths;
}

/// The same of a TOML file, relative to its own folder.
std::vector<fs::path> files_named_in(const fs::path& settings) {
  const auto bytes = read_file(settings, kMostText);
  if (!bytes) return {};
  return files_named_in(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()),
                        folder_of(settings));
}

struct FormatNames {
  FileFormat format;
  const char* text;    ///< "an HDF5 scene"
  const char* suffix;  ///< the suffixes to suggest
  bool binary;
};

constexpr std::array<FormatNames, 14> kFormats{{{FileFormat::scene, "an HDF5 scene", ".h5", true},
                                                {FileFormat::registration, "a registration", ".h5", true},
                                                {FileFormat::picture, "a picture", ".exr", true},
                                                {FileFormat::map, "a map", ".exr", true},
                                                {FileFormat::program, "a compiled program", ".symprog", true},
                                                {FileFormat::log, "a photograph log", ".log", true},
                                                {FileFormat::page, "an HTML page", ".html", false},
                                                {FileFormat::json, "JSON", ".json", false},
                                                {FileFormat::table, "CSV", ".csv", false},
                                                {FileFormat::settings, "TOML", ".toml", false},
                                                {FileFormat::waveform, "a VCD waveform", ".vcd", false},
                                                {FileFormat::matrix, "a matrix", ".npy or .mat", true},
                                                {FileFormat::film, "a film", ".y4m", true},
                                                {FileFormat::folder, "a folder of files", "", true}}};

const FormatNames& names_of(FileFormat format) {
  return *std::find_if(kFormats.begin(), kFormats.end(),
                       [format](const FormatNames& one) { return one.format == format; });
}

struct Suffix {
  std::string_view text;
  FileFormat format;
};

/// Suffixes with a known format. Any output may have another suffix.
constexpr std::array<Suffix, 24> kSuffixes{{
    {".h5", FileFormat::scene},        {".hdf5", FileFormat::scene},   {".exr", FileFormat::picture},
    {".pfm", FileFormat::picture},     {".png", FileFormat::picture},  {".jpg", FileFormat::picture},
    {".jpeg", FileFormat::picture},    {".tif", FileFormat::picture},  {".tiff", FileFormat::picture},
    {".pgm", FileFormat::picture},     {".raw", FileFormat::picture},  {".uf2", FileFormat::program},
    {".symprog", FileFormat::program}, {".log", FileFormat::log},      {".html", FileFormat::page},
    {".htm", FileFormat::page},        {".json", FileFormat::json},    {".csv", FileFormat::table},
    {".toml", FileFormat::settings},   {".vcd", FileFormat::waveform}, {".elf", FileFormat::program},
    {".npy", FileFormat::matrix},      {".mat", FileFormat::matrix},   {".y4m", FileFormat::film},
}};

bool fits(FileFormat suffix, FileFormat output) {
  if (suffix == output) return true;
  if (suffix == FileFormat::picture && output == FileFormat::map) return true;
  if (suffix == FileFormat::scene && output == FileFormat::registration) return true;
  return suffix == FileFormat::log && !names_of(output).binary;  // a .log file may contain any text
}

Result<void> check_suffix(const std::string& option, const fs::path& path, FileFormat format) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto* const known =
      std::find_if(kSuffixes.begin(), kSuffixes.end(), [&](const Suffix& one) { return one.text == suffix; });
  if (known == kSuffixes.end() || fits(known->format, format)) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("{} writes {}, but {} has the suffix of another format", option,
                           names_of(format).text, path.string()),
               format == FileFormat::folder
                   ? "give a name without a suffix"
                   : fmt::format("give a name that ends in {}", names_of(format).suffix)};
}

Error not_written(const fs::path& path, const std::string& why, const char* hint,
                  ErrorCode code = ErrorCode::io) {
  return {code, fmt::format("{} cannot be written: {}", path.string(), why), hint};
}

Result<void> check_descriptor(const std::string& option, const fs::path& path, int descriptor,
                              FileFormat format) {
  if (names_of(format).binary)
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} writes {}, which cannot go to {}", option, names_of(format).text,
                             path == "-" ? "standard output" : path.string()),
                 "give the name of a file"};
  const int flags = ::fcntl(descriptor, F_GETFL);
  if (descriptor <= STDERR_FILENO || (flags >= 0 && (flags & O_ACCMODE) != O_RDONLY)) return {};
  return not_written(path, "this descriptor is not open for writing", "give the name of a file",
                     ErrorCode::bad_argument);
}

/// Checks that something new can be made in the folder of `path`.
Result<void> check_place(const fs::path& path) {
  const fs::path folder = folder_of(base::link_target(path));
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return not_written(path, "there is no folder " + folder.string(), "make the folder, or give another one",
                       ErrorCode::not_found);
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return not_written(path, fmt::format("{} ({})", folder.string(), std::generic_category().message(errno)),
                     "give a folder that you can write to");
}

/// Checks that the target is a new file in a writable folder, or a regular file there.
Result<void> check_target(const fs::path& path) {
  const auto place = place_of(path);
  if (path.filename().empty() || (place && place->exists() && !place->regular()))
    return not_written(
        path, fmt::format("it is {}", place && place->exists() ? base::kind_of(place->mode) : "a folder"),
        "give a file name");
  return check_place(path);
}

/// Checks that the target is a folder, or a new one in a writable folder. A new one with the suffix of a file
/// was meant as a file.
Result<void> check_folder(const std::string& option, const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return {};
  if (const auto place = place_of(path); place && place->exists())
    return not_written(path, fmt::format("it is {}, not a folder", base::kind_of(place->mode)),
                       "give a folder", ErrorCode::bad_argument);
  SYMRIG_CHECK(check_suffix(option, path, FileFormat::folder));
  return check_place(path.filename().empty() ? path.parent_path() : path);
}

bool same_file(const fs::path& a, const fs::path& b) {
  const auto place = place_of(a);
  return place && place == place_of(b);
}

}  // namespace

bool is_standard_output(const fs::path& path) {
  return descriptor_of(path) == STDOUT_FILENO;
}

JobFiles& JobFiles::reads(std::string_view what, const fs::path& path) {
  if (!path.empty()) inputs_.push_back({std::string(what), path});
  return *this;
}

JobFiles& JobFiles::reads_folder(std::string_view what, const fs::path& folder) {
  for (const fs::path& path : photographs_in(folder)) reads(what, path);
  return reads_settings(what, folder.empty() ? folder : folder / "capture.toml");
}

JobFiles& JobFiles::reads_settings(std::string_view what, const fs::path& path) {
  if (path.empty()) return *this;
  for (const fs::path& named : files_named_in(path)) reads(what, named);
  return reads(what, path);
}

JobFiles& JobFiles::reads_settings_text(std::string_view what, std::string_view text) {
  for (const fs::path& named : files_named_in(text, ".")) reads(what, named);
  return *this;
}

JobFiles& JobFiles::writes(std::string_view option, const fs::path& path, FileFormat format) {
  if (!path.empty()) outputs_.push_back({std::string(option), path, format});
  return *this;
}

JobFiles& JobFiles::measures_anew(std::string_view option, const fs::path& path) {
  if (!path.empty()) anew_.push_back({std::string(option), path});
  return *this;
}

Result<void> JobFiles::check_inputs(const Output& output) const {
  for (const Input& one : anew_)
    if (one.what == output.option && same_file(one.path, output.path)) return {};
  for (const Input& input : inputs_)
    if (same_file(input.path, output.path))
      return Error{ErrorCode::bad_argument,
                   fmt::format("{} {} is the same file as {} {}, which is an input", output.option,
                               output.path.string(), input.what, input.path.string()),
                   "give the output another name"};
  return {};
}

Result<void> JobFiles::check_others(std::size_t k) const {
  const Output& one = outputs_[k];
  for (std::size_t i = 0; i < k; ++i)
    if (same_file(outputs_[i].path, one.path))
      return Error{ErrorCode::bad_argument,
                   fmt::format("{} {} is the same file as {} {}", one.option, one.path.string(),
                               outputs_[i].option, outputs_[i].path.string()),
                   "give each output its own name"};
  return {};
}

/// Checks the file that a shell redirected standard output to, as in `symrig inspect a.h5 >> a.h5`.
Result<void> JobFiles::check_redirection() const {
  const auto printed = place_of(STDOUT_FILENO);
  if (!printed || !printed->regular()) return {};
  const auto clash = [&](const fs::path& path) -> Result<void> {
    if (is_standard_output(path) || printed != place_of(path)) return {};
    return Error{ErrorCode::bad_argument,
                 fmt::format("standard output goes to {}, which this command uses", path.string()),
                 "redirect standard output to another file"};
  };
  for (const Input& input : inputs_) SYMRIG_CHECK(clash(input.path));
  for (const Output& output : outputs_) SYMRIG_CHECK(clash(output.path));
  return {};
}

Result<void> JobFiles::check() const {
  for (const Output& output : outputs_) SYMRIG_CHECK(check_inputs(output));
  for (std::size_t k = 0; k < outputs_.size(); ++k) SYMRIG_CHECK(check_others(k));
  SYMRIG_CHECK(check_redirection());
  for (const Output& output : outputs_) {
    if (const auto descriptor = descriptor_of(output.path)) {
      SYMRIG_CHECK(check_descriptor(output.option, output.path, *descriptor, output.format));
      continue;
    }
    if (output.format == FileFormat::folder) {
      SYMRIG_CHECK(check_folder(output.option, output.path));
      continue;
    }
    SYMRIG_CHECK(check_target(output.path));
    SYMRIG_CHECK(check_suffix(output.option, output.path, output.format));
  }
  return {};
}

Result<void> write_text_output(const fs::path& path, std::string_view text) {
  if (const auto descriptor = descriptor_of(path)) return base::write_descriptor(*descriptor, text);
  return write_file_atomically(path, text);
}

}  // namespace symrig
