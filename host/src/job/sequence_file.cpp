// SPDX-License-Identifier: Apache-2.0
#include "job/sequence_file.hpp"

#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/base/files.hpp"

#include <span>
#include <system_error>

#include <nlohmann/json.hpp>

namespace symrig::job {
namespace {

using SequenceJson = nlohmann::ordered_json;

constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 28;  // two million pictures

std::optional<SequenceFile> parsed(const SequenceJson& json) {
  if (!json.is_object() || !json.contains("scene") || !json["scene"].is_string() || !json.contains("asked") ||
      !json["asked"].is_string() || !json.contains("exposure") || !json["exposure"].is_number() ||
      !json.contains("lights") || !json["lights"].is_object())
    return {};
  SequenceFile file{json["scene"], json["asked"], json["exposure"], {}};
  for (const auto& [picture, light] : json["lights"].items()) {
    if (!light.is_number_unsigned()) return {};
    file.pictures[picture] = light.get<std::uint32_t>();
  }
  return file;
}

}  // namespace

Result<std::optional<SequenceFile>> SequenceFile::read(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kSequenceFile;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::optional<SequenceFile>();
  SYMRIG_TRY(const auto bytes, read_file(path, kLargestFile));
  const SequenceJson json = SequenceJson::parse(bytes.begin(), bytes.end(), nullptr, false);
  std::optional<SequenceFile> file = parsed(json);
  if (!file)
    return Error{ErrorCode::bad_format, path.string() + " is not a list of relit pictures",
                 "give an empty folder, or remove that file"};
  return file;
}

Result<void> SequenceFile::write(const std::filesystem::path& folder) const {
  SequenceJson lights = SequenceJson::object();
  for (const auto& [picture, light] : pictures) lights[picture] = light;
  const SequenceJson json{{"scene", scene}, {"asked", asked}, {"exposure", exposure}, {"lights", lights}};
  return write_file_atomically(folder / kSequenceFile, json.dump(1) + "\n");
}

std::uint32_t light_digest(const Image<float>& light) {
  return acquisition::fast_crc32c(std::as_bytes(light.values()));
}

}  // namespace symrig::job
