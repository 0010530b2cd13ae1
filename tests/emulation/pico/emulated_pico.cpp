// SPDX-License-Identifier: Apache-2.0
#include "emulated_pico.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace symrig::test {
namespace {

const std::string kServer = SYMRIG_EMULATION_DIR "/board/server.mjs";

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().line());
  return std::move(*result);
}

/// Waits for the server's one line. Empty: it ended without one.
std::string read_line(int fd) {
  std::string line;
  char c = 0;
  while (::read(fd, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

}  // namespace

std::string EmulatedPico::missing() {
  namespace fs = std::filesystem;
  if (!fs::exists(SYMRIG_NODE)) return "Node is not installed";
  if (!fs::exists(SYMRIG_EMULATION_DIR "/node_modules/rp2040js"))
    return "the emulator is not installed: npm ci in tests/emulation";
  if (!fs::exists(SYMRIG_PICO_UF2)) return "the Pico's image is not built: tools/firmware";
  return {};
}

EmulatedPico::EmulatedPico() {
  static std::atomic<int> count{0};
  socket_ = (std::filesystem::temp_directory_path() /
             ("symrig-pico-" + std::to_string(::getpid()) + "-" + std::to_string(count++)))
                .string();
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) != 0) throw std::runtime_error("no pipe");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe[1], STDOUT_FILENO);
  posix_spawn_file_actions_addclose(&actions, pipe[0]);
  std::string node = SYMRIG_NODE;
  std::string script = kServer;
  std::string uf2 = SYMRIG_PICO_UF2;
  std::string flag_uf2 = "--uf2";
  std::string flag_unix = "--unix";
  std::array<char*, 7> argv{node.data(),      script.data(),  flag_uf2.data(), uf2.data(),
                            flag_unix.data(), socket_.data(), nullptr};
  const int failed = posix_spawn(&process_, node.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pipe[1]);
  const std::string line = failed == 0 ? read_line(pipe[0]) : "";
  ::close(pipe[0]);
  if (line.rfind("ready ", 0) != 0) throw std::runtime_error("the emulator did not start: " + line);
  bench_ = must(VirtualBench::connect(must(DeviceUri::parse("virtual:unix:" + socket_))));
  idle_ = bench_->link();
}

EmulatedPico::~EmulatedPico() {
  idle_.reset();
  bench_.reset();
  if (process_ > 0) {
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  std::filesystem::remove(socket_);
}

Board EmulatedPico::connect(const BoardOptions& options) {
  return must(Board::connect(bench_->link(), options));
}

std::vector<PinEdge> EmulatedPico::edges() {
  return must(bench_->edges());
}

std::uint64_t EmulatedPico::cycle() const {
  return static_cast<std::uint64_t>(must(bench_->now()) / kCycle);
}

void EmulatedPico::pass(Nanoseconds time) {
  const Nanoseconds until = must(bench_->now()) + time;
  for (Nanoseconds left = time; left.count() > 0; left = until - must(bench_->now()))
    static_cast<void>(must(idle_->receive(left)));
}

std::vector<PinEdge> of_pin(const std::vector<PinEdge>& edges, unsigned gpio) {
  std::vector<PinEdge> found;
  for (const PinEdge& edge : edges)
    if (edge.gpio == gpio) found.push_back(edge);
  return found;
}

unsigned gpio_of(const BoardInfo& info, std::string_view line) {
  const int index = info.line(line);
  if (index < 0) throw std::runtime_error("no line " + std::string(line));
  const std::string& pin = info.lines[index].pin;
  if (pin.rfind("GPIO", 0) != 0) throw std::runtime_error("no GPIO: " + pin);
  return static_cast<unsigned>(std::stoul(pin.substr(4)));
}

}  // namespace symrig::test
