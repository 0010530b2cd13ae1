// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/text.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/internal/client_talk.hpp"
#include "symrig/rig/internal/received_photograph.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

static_assert(std::endian::native == std::endian::little, "the floats of the framing are little-endian");

constexpr Nanoseconds kGreetingTime{10'000'000'000};  // a stranger must not keep the rig, whatever it sends
constexpr Nanoseconds kBatchTime{600'000'000'000};  // between two bytes of a batch: as ExecOptions::patience
constexpr std::size_t kLongestRequest = 16;         // "measure 16"
constexpr std::size_t kLongestOwnName = 600;        // so that the answer fits in kLongestAnswer

/// A name without blanks, of printable ASCII.
std::string name_of(const Probe& rig) {
  std::string name = rig.describe().substr(0, kLongestOwnName);
  for (char& c : name)
    if (c <= ' ' || c > '~') c = '_';
  return name;
}

/// A rig of one view does not state it: hosts from before this word know no views.
std::string answer_of(const Probe& rig) {
  const std::string views = rig.views().single() ? "" : fmt::format(" views={}", to_string(rig.views()));
  return fmt::format("version=1 cells={} camera={}{} channels={} name={}\n", to_string(rig.grid()),
                     to_string(rig.camera_grid()), views, rig.channels(), name_of(rig));
}

/// N of "measure N".
std::optional<std::size_t> patterns_asked(std::string_view line) {
  constexpr std::string_view kMeasure = "measure ";
  if (!line.starts_with(kMeasure)) return std::nullopt;
  line.remove_prefix(kMeasure.size());
  std::size_t count = 0;
  const auto [end, failed] = std::from_chars(line.data(), line.data() + line.size(), count);
  const bool number = failed == std::errc{} && end == line.data() + line.size();
  return number && count >= 1 && count <= kExecBatch ? std::optional(count) : std::nullopt;
}

std::string error_line(std::string_view text) {
  return fmt::format("error: {}\n", printable_line(text));
}

/// One client from its greeting to its end.
class Visit {
 public:
  Visit(Probe& rig, rig::ClientTalk& talk) : rig_(rig), talk_(talk) {}

  /// Whether it has used the rig.
  bool run() {
    talk_.begin_greeting(kGreetingTime);
    if (!greet()) return false;
    talk_.end_greeting();
    std::string line;
    for (;;) {
      talk_.set_patience(std::nullopt);  // a host may think for hours between two batches
      if (!talk_.receive_line(line, kLongestRequest)) return used_;
      talk_.set_patience(kBatchTime);
      const auto count = patterns_asked(line);
      if (!count) {
        talk_.dismiss(
            error_line(fmt::format("'{}' is not 'measure N' with N from 1 to {}", line, kExecBatch)));
        return used_;
      }
      for (std::size_t k = 1; k <= *count; ++k)
        if (!answer_pattern(k)) return used_;
    }
  }

 private:
  bool greet() {
    std::string line;
    if (!talk_.receive_line(line, rig::kGreeting.size())) return false;
    if (line + "\n" == rig::kGreeting) return talk_.send(answer_of(rig_));
    talk_.dismiss(error_line(fmt::format("'{}' is not 'symrig-exec 1'", line)));
    return false;
  }

  /// Reads a pattern and sends its photograph. So a batch needs the memory of one.
  bool answer_pattern(std::size_t number) {
    Pattern pattern(rig_.grid());
    if (!talk_.receive(std::as_writable_bytes(pattern.values()))) return false;
    const auto photographs = rig_.measure({&pattern, 1});
    used_ = true;
    if (!photographs) {
      talk_.dismiss(error_line(photographs.error().line()));
      return false;
    }
    const Radiance& photograph = photographs->front();
    const std::size_t bytes = photograph.mean.values().size() * 9;
    return talk_.send(fmt::format("photograph {} {}\n", number, bytes)) &&
           talk_.send(std::as_bytes(photograph.mean.values())) &&
           talk_.send(std::as_bytes(photograph.variance.values())) &&
           talk_.send(std::as_bytes(photograph.valid.values()));
  }

  Probe& rig_;
  rig::ClientTalk& talk_;
  bool used_ = false;
};

Result<void> check_framing(const Probe& rig) {
  const std::int64_t bytes = 4 * rig.grid().size() + 9 * rig.camera_grid().size() * rig.channels();
  if (bytes <= kExecLargest && rig.channels() <= kExecChannels) return {};
  return Error{ErrorCode::limit,
               fmt::format("a pattern and its photograph have {} bytes, but at most {} are allowed", bytes,
                           kExecLargest),
               "use a smaller grid or fewer channels"};
}

}  // namespace

class PhotographServer::ServedRig {
 public:
  ServedRig(OpenRig open, std::unique_ptr<Probe> first, board::ListeningPlace place)
      : open_(std::move(open)), rig_(std::move(first)), place_(std::move(place)) {}

  void run(const std::function<bool()>& keep_going) {
    rig::serve_clients(place_, keep_going, [this](rig::ClientTalk& talk) { serve(talk); });
  }

 private:
  void serve(rig::ClientTalk& talk) {
    if (!rig_) {
      auto rig = open_();
      if (!rig) {
        talk.dismiss(error_line(rig.error().line()));
        return;
      }
      rig_ = *std::move(rig);
    }
    if (Visit(*rig_, talk).run()) rig_.reset();
  }

  OpenRig open_;
  std::unique_ptr<Probe> rig_;  // not yet used; none: the last client has used it
  board::ListeningPlace place_;
};

PhotographServer::PhotographServer(std::unique_ptr<ServedRig> served) : served_(std::move(served)) {}
PhotographServer::PhotographServer(PhotographServer&&) noexcept = default;
PhotographServer& PhotographServer::operator=(PhotographServer&&) noexcept = default;
PhotographServer::~PhotographServer() = default;

Result<PhotographServer> PhotographServer::open(OpenRig open, const std::string& place) {
  SYMRIG_TRY(std::unique_ptr<Probe> rig, open());
  SYMRIG_CHECK(check_framing(*rig));
  SYMRIG_TRY(board::ListeningPlace listening, board::ListeningPlace::open(place));
  return PhotographServer(std::make_unique<ServedRig>(std::move(open), std::move(rig), std::move(listening)));
}

void PhotographServer::run(const std::function<bool()>& keep_going) {
  served_->run(keep_going);
}

}  // namespace symrig
