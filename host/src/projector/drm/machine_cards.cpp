// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/libdrm_kms.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = "/dev/dri";

/// The number of "card12". None for other file names.
std::optional<int> card_number(const std::string& name) {
  constexpr std::string_view kNamePrefix = "card";
  if (!name.starts_with(kNamePrefix)) return std::nullopt;
  int number = 0;
  const char* end = name.data() + name.size();
  const auto [at, error] = std::from_chars(name.data() + kNamePrefix.size(), end, number);
  if (error != std::errc{} || at != end) return std::nullopt;
  return number;
}

Error cannot_open(const std::string& card, int error) {
  if (error == EACCES || error == EPERM)
    return {ErrorCode::device_lost, card + ": no permission to open " + (kFolder / card).string(),
            "add yourself to the group 'video' (sudo usermod -aG video $USER) and log in again"};
  return {ErrorCode::device_lost,
          fmt::format("cannot open {} ({})", card, std::generic_category().message(error)),
          "`symrig list` shows the connectors"};
}

/// true: this process has the file open. The kernel hides the files of other users' processes.
bool has_open(const fs::path& process, const fs::path& file) {
  std::error_code error;
  for (fs::directory_iterator at(process / "fd", error), end; !error && at != end; at.increment(error)) {
    std::error_code unreadable;
    if (fs::read_symlink(at->path(), unreadable) == file) return true;
  }
  return false;
}

class MachineCards final : public Cards {
 public:
  std::vector<std::string> names() override {
    std::set<int> numbers;
    std::error_code error;
    for (fs::directory_iterator at(kFolder, error), end; !error && at != end; at.increment(error))
      if (const auto number = card_number(at->path().filename().string())) numbers.insert(*number);
    std::vector<std::string> names;
    names.reserve(numbers.size());
    for (const int number : numbers) names.push_back(fmt::format("card{}", number));
    return names;
  }

  Result<std::unique_ptr<Kms>> open(const std::string& card) override {
    const fs::path path = kFolder / card;
    Fd fd(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
    if (!fd) return cannot_open(card, errno);
    if (drmIsKMS(fd.get()) == 0)
      return Error{ErrorCode::device_refused, card + " has no displays", "`symrig list` shows others"};
    return std::unique_ptr<Kms>(std::make_unique<LibdrmKms>(std::move(fd), card));
  }

  std::vector<std::string> holders(const std::string& card) override {
    std::vector<std::string> holders;
    const std::string self = std::to_string(::getpid());
    std::error_code error;
    for (fs::directory_iterator at("/proc", error), end; !error && at != end; at.increment(error)) {
      const std::string pid = at->path().filename().string();
      if (pid == self || !std::all_of(pid.begin(), pid.end(), [](char c) { return c >= '0' && c <= '9'; }) ||
          !has_open(at->path(), kFolder / card))
        continue;
      std::string name;
      std::getline(std::ifstream(at->path() / "comm") >> std::ws, name);
      holders.push_back(fmt::format("{} ({})", name, pid));
    }
    return holders;
  }
};

}  // namespace

std::unique_ptr<Cards> machine_cards() {
  return std::make_unique<MachineCards>();
}

}  // namespace symrig::projector::drm
