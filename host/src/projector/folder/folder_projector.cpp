// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/folder_projector.hpp"

#include "symrig/base/files.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/internal/size_text.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
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

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kManifestVersion = 1;
constexpr const char* kManifest = "manifest.json";
constexpr std::string_view kHead = "pattern-", kTail = ".png";

std::string file_name(std::size_t number) {
  return fmt::format("{}{:05}{}", kHead, number, kTail);
}

/// true for pattern-00000.png and so on: files that load() may replace.
bool is_picture_of_ours(const std::string& name) {
  if (!name.starts_with(kHead) || !name.ends_with(kTail) || name.size() <= kHead.size() + kTail.size())
    return false;
  const auto digits = std::string_view(name).substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  return std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Removes the manifest first, so that a partly cleared folder never looks complete.
Result<void> clear(const fs::path& folder) {
  std::error_code error;
  fs::remove(folder / kManifest, error);
  std::vector<fs::path> old;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_picture_of_ours(at->path().filename().string())) old.push_back(at->path());
  for (const fs::path& path : old)
    if (!error) fs::remove(path, error);
  if (!error) return {};
  return Error{ErrorCode::io, folder.string() + ": cannot clear the folder (" + error.message() + ")",
               "check that it is a folder and that you may write to it"};
}

/// Writes one picture and returns its entry in the manifest.
Result<Json> write_picture(const fs::path& folder, std::size_t number, const Image<std::uint8_t>& picture) {
  const auto values = picture.values();
  const bool binary = std::all_of(values.begin(), values.end(), [](auto v) { return v == 0 || v == 255; });
  const auto png = binary ? encode_bit_png(picture) : encode_png(picture);
  const std::string name = file_name(number);
  if (png.empty())
    return Error{ErrorCode::io, (folder / name).string() + ": cannot be written", "use a smaller screen"};
  SYMRIG_CHECK(write_file_atomically(folder / name, std::as_bytes(std::span(png))));
  return Json{{"file", name}, {"bits", binary ? 1 : 8}, {"sha256", board::sha256(png)}};
}

Json size(Grid grid) {
  return {grid.rows, grid.cols};
}

Json manifest_head(const FolderProjectorOptions& options, Grid grid) {
  const Placement& at = options.placement;
  return {{"symrig", kManifestVersion},
          {"kind", "patterns"},
          {"screen", size(options.screen)},
          {"grid", size(grid)},
          {"cell", at.cell},
          {"top", at.top},
          {"left", at.left},
          {"mirror_rows", at.mirror_rows},
          {"mirror_cols", at.mirror_cols},
          {"patterns", Json::array()}};
}

Result<void> write_set(const FolderProjectorOptions& options, Grid grid,
                       std::span<const Image<std::uint8_t>> codes) {
  Json manifest = manifest_head(options, grid);
  for (std::size_t k = 0; k < codes.size(); ++k) {
    SYMRIG_TRY(Json entry,
               write_picture(options.folder, k, draw(codes[k], options.placement, options.screen)));
    manifest["patterns"].push_back(std::move(entry));
  }
  return write_file_atomically(options.folder / kManifest, manifest.dump(2) + "\n");
}

}  // namespace

Result<std::unique_ptr<FolderProjector>> FolderProjector::open(FolderProjectorOptions options) {
  if (options.refresh_period.count() <= 0)
    return Error{ErrorCode::bad_argument, "a projector's refresh period is not positive",
                 "give it in nanoseconds"};
  if (!options.screen.valid())
    return Error{ErrorCode::bad_argument, "a projector's screen is " + to_string(options.screen),
                 "give its rows and columns"};
  SYMRIG_TRY(const Grid grid, placed_grid(options.screen, options.placement, options.grid));
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error || !fs::is_directory(options.folder, error))
    return Error{
        ErrorCode::io,
        options.folder.string() + ": cannot create the folder" + (error ? " (" + error.message() + ")" : ""),
        "choose another folder for patterns"};
  return std::unique_ptr<FolderProjector>(new FolderProjector(std::move(options), grid));
}

FolderProjector::FolderProjector(FolderProjectorOptions options, Grid grid)
    : options_(std::move(options)), grid_(grid) {}

Result<void> FolderProjector::load(std::span<const Pattern> patterns) {
  std::vector<Image<std::uint8_t>> codes;
  for (const Pattern& pattern : patterns) {
    SYMRIG_TRY(auto converted, to_codes(pattern, grid_, options_.codes, codes.size()));
    codes.push_back(std::move(converted));
  }
  SYMRIG_CHECK(clear(options_.folder));
  if (auto written = write_set(options_, grid_, codes); !written) {
    (void)clear(options_.folder);  // reports the first error, not this one
    return written;
  }
  return options_.push ? options_.push(options_.folder) : Result<void>();
}

std::string FolderProjector::describe() const {
  return fmt::format("pictures of {} in {}, patterns {} in cells of {}", to_string(options_.screen),
                     options_.folder.string(), to_string(grid_), options_.placement.cell);
}

}  // namespace symrig

// The keys of `[projector]` for a folder: docs/rig-file.md.

namespace symrig::projector {
namespace {

struct FolderKeys {
  std::string folder;  // where patterns are written
  Grid screen;         // the projector's pixels
  std::string push;    // shell command that transfers the pictures to the projector; may be empty
};

class FolderSource final : public ProjectorSource {
 public:
  explicit FolderSource(FolderKeys keys) : keys_(std::move(keys)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override {
    FolderProjectorOptions options;
    options.folder = screen.folder / keys_.folder;
    options.screen = keys_.screen;
    options.placement = screen.placement;
    options.grid = grid;
    options.codes = screen.codes;
    options.refresh_period = screen.refresh;
    if (!keys_.push.empty()) options.push = push_by_command(keys_.push);
    SYMRIG_TRY(auto projector, FolderProjector::open(std::move(options)));
    return std::unique_ptr<Projector>(std::move(projector));
  }

  Pacing pacing() const override { return Pacing::trigger; }

  std::string identity(const Placement& /*placement*/) const override {
    return fmt::format("projector folder {}", keys_.folder);
  }

 private:
  FolderKeys keys_;
};

std::unique_ptr<ProjectorSource> read_folder_projector(base::TableReader& table) {
  FolderKeys keys;
  table.require("folder", "the folder for patterns");
  table.read("folder", keys.folder);
  for (const char* const key : {"connector", "mode"})
    if (table.has(key))
      table.fail("folder", "cannot be combined with a screen's keys", "give either a folder or a connector");
  image::read_picture_size(table, "screen", keys.screen);
  table.read("push", keys.push);
  table.require("screen", "the projector's pixels, columns x rows, such as \"1280x800\"");
  return std::make_unique<FolderSource>(std::move(keys));
}

}  // namespace

ProjectorDriver folder_driver() {
  return {"folder", "a folder of pictures for a projector with its own memory", "folder",
          read_folder_projector};
}

}  // namespace symrig::projector
