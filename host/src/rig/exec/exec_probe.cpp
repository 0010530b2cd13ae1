// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/exec_probe.hpp"

#include "rig/exec/child_talk.hpp"
#include "symrig/base/text.hpp"
#include "symrig/base/time.hpp"
#include "symrig/rig/internal/received_photograph.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

static_assert(std::endian::native == std::endian::little, "the floats of the framing are little-endian");

constexpr std::size_t kLongestName = 80;              // of a command in a message
constexpr std::size_t kQuoted = 60;                   // bytes of a wrong answer in a message
constexpr Nanoseconds kLast{1'000'000'000};           // a child that closes its output ends within this time
constexpr int kNotExecutable = 126, kNotFound = 127;  // a shell's status

constexpr const char* kSee = "see docs/howto-own-rig.md; write nothing but answers to standard output";

std::string named(const std::string& command) {
  std::string name = "exec:" + command;
  if (name.size() > kLongestName) name = name.substr(0, kLongestName) + "...";
  return printable_line(name);
}

std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // NOLINT(*-reinterpret-cast)
}

}  // namespace

/// The child, and the framing.
class ExecProbe::Conversation {
 public:
  Conversation(std::string name, rig::ChildProcess child, ExecOptions options)
      : name_(std::move(name)),
        options_(std::move(options)),
        child_(std::move(child)),
        talk_(child_, options_.patience, options_.keep_waiting) {}
  ~Conversation() { child_.end(options_.grace, options_.keep_waiting); }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  Result<void> greet();
  Result<void> measure(std::span<const Pattern> patterns, std::vector<Radiance>& photographs);
  void tell(const TakenSome& taken) { taken_ = taken; }
  const rig::ExecShape& shape() const { return shape_; }
  /// Ends the child at once.
  void hang_up() { child_.end({}, {}); }

 private:
  Error silence(rig::Silence why, const std::string& awaited) const;
  Error end(const std::string& awaited) const;
  Error garbage(const std::string& answer, const std::string& awaited);
  Result<void> check_quiet(const std::string& awaited);
  Result<Radiance> receive(std::size_t number, const std::string& awaited);
  Result<void> receive_header(std::size_t number, const std::string& awaited);

  std::string name_;
  ExecOptions options_;
  rig::ChildProcess child_;
  rig::ChildTalk talk_;
  rig::ExecShape shape_;
  bool greeted_ = false;
  TakenSome taken_;
};

Error ExecProbe::Conversation::end(const std::string& awaited) const {
  const auto end = child_.wait(kLast, options_.keep_waiting);
  if (!end)
    return {ErrorCode::device_lost, fmt::format("{} closed its output before {}", name_, awaited), kSee};
  const bool shell_failed = !greeted_ && !end->by_signal;
  if (shell_failed && end->number == kNotFound)
    return {ErrorCode::not_found, fmt::format("{}: the shell finds no such command", name_),
            "check the command and the PATH; its own message is above"};
  if (shell_failed && end->number == kNotExecutable)
    return {ErrorCode::not_found, fmt::format("{}: the shell cannot run this command", name_),
            "make the file executable (chmod +x); its own message is above"};
  return {ErrorCode::device_lost, fmt::format("{} {} before {}", name_, rig::to_string(*end), awaited),
          "its own messages are above; run it by hand"};
}

Error ExecProbe::Conversation::silence(rig::Silence why, const std::string& awaited) const {
  switch (why) {
    case rig::Silence::ended:
      return end(awaited);
    case rig::Silence::deaf:
      return {ErrorCode::device_lost, fmt::format("{} closed its input before {}", name_, awaited),
              "read each pattern whole"};
    case rig::Silence::timeout:
      return {ErrorCode::timeout,
              fmt::format("{} moved no byte for {:.3g} s before {}", name_,
                          seconds(shape_.patience.value_or(options_.patience)), awaited),
              "flush its standard output after each photograph; a slow rig answers patience=SECONDS"};
    case rig::Silence::stopped:
      break;
  }
  return {ErrorCode::interrupted, fmt::format("stopped before {} of {}", awaited, name_),
          "run the command again"};
}

/// answer: what has been received of it. What has come after it is also shown.
Error ExecProbe::Conversation::garbage(const std::string& answer, const std::string& awaited) {
  std::string quoted = answer + std::string(as_text(talk_.unread()));
  quoted = quoted.substr(0, std::min(quoted.find('\n'), kQuoted));
  return {ErrorCode::protocol,
          fmt::format("{} answers '{}' instead of {}", name_, printable_line(quoted), awaited), kSee};
}

Result<void> ExecProbe::Conversation::check_quiet(const std::string& awaited) {
  if (talk_.unread().empty()) return {};
  return garbage("", awaited);
}

Result<void> ExecProbe::Conversation::greet() {
  const std::string awaited = "its answer to the greeting";
  talk_.send(std::as_bytes(std::span(rig::kGreeting)));
  std::string line;
  if (const auto why = talk_.receive_line(line, rig::kAnswerBegin, rig::kLongestAnswer))
    return silence(*why, awaited);
  if (line.size() == rig::kLongestAnswer || !line.starts_with(rig::kAnswerBegin))
    return garbage(line, "'version=1 cells=ROWSxCOLUMNS channels=N'");
  auto shape = rig::parse_exec_answer(line);
  if (!shape)
    return Error{shape.error().code, fmt::format("{} {}", name_, shape.error().what), shape.error().hint};
  if (const auto why = talk_.flush()) return silence(*why, awaited);
  greeted_ = true;
  shape_ = *std::move(shape);
  if (shape_.patience) talk_.set_patience(*shape_.patience);
  return {};
}

Result<void> ExecProbe::Conversation::receive_header(std::size_t number, const std::string& awaited) {
  std::string line;
  if (const auto why = talk_.receive_line(line, rig::kHeaderBegin, rig::kLongestHeader))
    return silence(*why, awaited);
  const auto header = rig::parse_photograph_header(line);
  const std::int64_t bytes = shape_.photograph_bytes();
  if (!header) return garbage(line, fmt::format("'photograph {} {}'", number, bytes));
  if (header->number != static_cast<std::int64_t>(number))
    return Error{ErrorCode::protocol,
                 fmt::format("{} answers photograph {} instead of {}", name_, header->number, number),
                 "answer each pattern once, in order, counting from 1 in each batch"};
  if (header->bytes == bytes) return {};
  return Error{ErrorCode::protocol,
               fmt::format("{} answers photograph {} with {} bytes, but {} with {} channels are {}", name_,
                           number, header->bytes, to_string(shape_.camera), shape_.channels, bytes),
               "send mean and variance as 4-byte floats and valid as bytes, all of that size"};
}

Result<Radiance> ExecProbe::Conversation::receive(std::size_t number, const std::string& awaited) {
  SYMRIG_CHECK(receive_header(number, awaited));
  Radiance photograph{Image<float>(shape_.camera, shape_.channels),
                      Image<float>(shape_.camera, shape_.channels),
                      Image<std::uint8_t>(shape_.camera, shape_.channels)};
  for (const auto bytes : {std::as_writable_bytes(photograph.mean.values()),
                           std::as_writable_bytes(photograph.variance.values()),
                           std::as_writable_bytes(photograph.valid.values())})
    if (const auto why = talk_.receive(bytes)) return silence(*why, "the end of " + awaited);
  if (const auto fault = rig::settle(photograph))
    return Error{ErrorCode::protocol, fmt::format("{}: photograph {} has {}", name_, number, *fault),
                 "mean and variance must be finite, variance not negative; mark unusable pixels by valid 0"};
  rig::set_right(photograph, shape_.mirrored);
  return photograph;
}

Result<void> ExecProbe::Conversation::measure(std::span<const Pattern> patterns,
                                              std::vector<Radiance>& photographs) {
  SYMRIG_CHECK(check_quiet("silence until the next pattern"));
  const std::string line = fmt::format("measure {}\n", patterns.size());
  talk_.send(std::as_bytes(std::span(line)));
  for (const Pattern& pattern : patterns) talk_.send(std::as_bytes(pattern.values()));
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const std::string awaited = fmt::format("photograph {} of {}", i + 1, patterns.size());
    SYMRIG_TRY(auto photograph, receive(i + 1, awaited));
    photographs.push_back(std::move(photograph));
    if (taken_ && !taken_(1)) return silence(rig::Silence::stopped, awaited);
  }
  if (const auto why = talk_.flush()) return silence(*why, "it had read all patterns");
  return check_quiet("silence until the next pattern");
}

ExecProbe::ExecProbe(std::string command, std::unique_ptr<Conversation> conversation)
    : command_(std::move(command)), conversation_(std::move(conversation)) {}

ExecProbe::~ExecProbe() = default;

Result<std::unique_ptr<ExecProbe>> ExecProbe::open(std::string command, ExecOptions options) {
  if (command.find_first_not_of(" \t\n") == std::string::npos)
    return Error{ErrorCode::bad_argument, "exec: has no command", "give one: 'exec:python3 rig.py'"};
  if (command.find('\0') != std::string::npos)
    return Error{ErrorCode::bad_argument, "the command of exec: has a zero byte", "remove it"};
  SYMRIG_TRY(auto child, rig::ChildProcess::start(command));
  auto conversation = std::make_unique<Conversation>(named(command), std::move(child), std::move(options));
  if (const auto greeted = conversation->greet(); !greeted) {
    conversation->hang_up();
    return greeted.error();
  }
  return std::unique_ptr<ExecProbe>(new ExecProbe(std::move(command), std::move(conversation)));
}

Grid ExecProbe::grid() const {
  return conversation_->shape().cells;
}

Grid ExecProbe::camera_grid() const {
  return conversation_->shape().camera;
}

ViewLayout ExecProbe::views() const {
  return conversation_->shape().views;
}

int ExecProbe::channels() const {
  return conversation_->shape().channels;
}

std::string ExecProbe::describe() const {
  const rig::ExecShape& shape = conversation_->shape();
  const char* const mirror = shape.mirrored.rows && shape.mirrored.columns ? ", rows and columns mirrored"
                             : shape.mirrored.rows                         ? ", rows mirrored"
                             : shape.mirrored.columns                      ? ", columns mirrored"
                                                                           : "";
  return printable_line("exec:" + command_) + (shape.name.empty() ? "" : fmt::format(" ({})", shape.name)) +
         mirror;
}

void ExecProbe::tell(const TakenSome& taken) {
  conversation_->tell(taken);
}

Result<std::vector<Radiance>> ExecProbe::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  if (failed_) return *failed_;
  const Stopwatch watch;
  std::vector<Radiance> photographs;
  while (photographs.size() < patterns.size()) {
    const std::size_t first = photographs.size(), count = std::min(kExecBatch, patterns.size() - first);
    const auto measured = conversation_->measure(patterns.subspan(first, count), photographs);
    if (measured) continue;
    conversation_->hang_up();
    failed_ = measured.error();
    return *failed_;
  }
  cost_.photographs += static_cast<std::int64_t>(patterns.size());
  cost_.frames += static_cast<std::int64_t>(patterns.size());
  cost_.rig_seconds += watch.seconds();
  return photographs;
}

}  // namespace symrig
