// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/files.hpp"
#include "symrig/rig/pair_link.hpp"

#include <filesystem>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::uint64_t kLongestSecret = 4096;
constexpr std::size_t kShortestSecret = 16;  // bytes: nobody guesses as many random ones

bool others_can_read(const std::string& file) {
  using std::filesystem::perms;
  std::error_code failed;
  const auto status = std::filesystem::status(file, failed);
  return !failed && (status.permissions() & (perms::group_all | perms::others_all)) != perms::none;
}

}  // namespace

Result<std::string> read_pair_secret(const std::string& file) {
  SYMRIG_TRY(const auto bytes, read_file(file, kLongestSecret));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): text of a file
  std::string secret(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  secret.erase(secret.find_last_not_of("\r\n") + 1);
  if (others_can_read(file))
    return Error{ErrorCode::bad_value, fmt::format("{}: other users can read this secret", file),
                 fmt::format("run: chmod 600 {}", file)};
  if (secret.size() >= kShortestSecret) return secret;
  return Error{
      ErrorCode::bad_value,
      fmt::format("{}: the secret has {} bytes, but needs at least {}", file, secret.size(), kShortestSecret),
      "write a random one: openssl rand -hex 32"};
}

}  // namespace symrig
