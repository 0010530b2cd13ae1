// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/files.hpp"
#include "symrig/projector/folder_projector.hpp"

#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace symrig {
namespace {

Error cannot_run(const std::string& command, int error) {
  return {ErrorCode::io, fmt::format("cannot run '{}' ({})", command, std::generic_category().message(error)),
          "check the command that pushes patterns"};
}

/// The last line that is not blank. Its control characters become blanks.
std::string last_line(std::string text) {
  text.erase(text.find_last_not_of(" \r\n\t") + 1);
  text.erase(0, text.find_last_of('\n') + 1);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text;
}

/// Reads until the other end closes. Keeps only the end of a long output.
std::string read_end(int fd) {
  constexpr std::size_t kKept = 4096;
  std::string text;
  std::array<char, kKept> bytes{};
  while (true) {
    const ssize_t got = ::read(fd, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(bytes.data(), static_cast<std::size_t>(got));
    if (text.size() > kKept) text.erase(0, text.size() - kKept);
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return status;
}

/// The child's standard output and error go to `out`.
int spawn_shell(const std::string& command, const std::string& folder, int out, pid_t& child) {
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, out, STDERR_FILENO);
  std::array<std::string, 5> words{"sh", "-c", command, "symrig", folder};
  std::array<char*, 6> arguments{words[0].data(), words[1].data(), words[2].data(),
                                 words[3].data(), words[4].data(), nullptr};
  const int error = ::posix_spawn(&child, "/bin/sh", &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  return error;
}

Result<void> push(const std::string& command, const std::filesystem::path& folder) {
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) return cannot_run(command, errno);
  const Fd in(ends[0]);
  Fd out(ends[1]);
  pid_t child = -1;
  if (const int error = spawn_shell(command, folder.string(), out.get(), child); error != 0)
    return cannot_run(command, error);
  out = {};
  const std::string said = last_line(read_end(in.get()));
  const int status = wait_for(child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  const std::string end = WIFEXITED(status) ? fmt::format("status {}", WEXITSTATUS(status))
                                            : fmt::format("signal {}", WTERMSIG(status));
  return Error{ErrorCode::device_refused,
               fmt::format("'{}' ended with {}{}", command, end, said.empty() ? "" : ": " + said),
               "the projector may lack its patterns: run the command by hand on " + folder.string()};
}

}  // namespace

PushPictures push_by_command(std::string command) {
  return
      [command = std::move(command)](const std::filesystem::path& folder) { return push(command, folder); };
}

}  // namespace symrig
