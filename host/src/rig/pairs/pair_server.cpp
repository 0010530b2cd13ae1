// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/pair_words.hpp"
#include "symrig/base/text.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/rig/internal/client_talk.hpp"
#include "symrig/rig/pair_link.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr Nanoseconds kGreetingLimit{3'000'000'000};  // a stranger must not keep the pair, whatever it sends
constexpr Nanoseconds kRequestTime{600'000'000'000};  // between two bytes of a request

std::string refusal(std::string_view text) {
  return fmt::format("error: {}\n", printable_line(text));
}

/// "lost: ..." tells a host that a device may come back.
std::string refusal(const Error& error) {
  const bool lost = error.code == ErrorCode::device_lost || error.code == ErrorCode::timeout;
  return lost ? fmt::format("lost: {}\n", printable_line(error.line())) : refusal(error.line());
}

/// One host from its greeting to its end.
class Stay {
 public:
  Stay(PairService& service, const std::string& secret, rig::ClientTalk& talk)
      : service_(service), secret_(secret), talk_(talk) {}

  void run() {
    talk_.begin_greeting(kGreetingLimit);
    if (!greet()) return;
    talk_.end_greeting();
    for (;;) {
      talk_.set_patience(std::nullopt);  // a host may think for hours between two photographs
      std::string request;
      if (!talk_.receive_line(request, rig::kLongestPairLine)) return;
      talk_.set_patience(kRequestTime);
      const auto answered = service_.answer(request, talk_);
      if (!answered) talk_.dismiss(refusal(answered.error()));
      if (!answered || !*answered) return;
    }
  }

 private:
  bool refuse(std::string_view why) {
    talk_.dismiss(refusal(why));
    return false;
  }

  bool greet() {
    std::string line;
    if (!talk_.receive_line(line, rig::kLongestPairLine)) return false;
    const std::string begin = fmt::format("{} challenge=", rig::kPairGreeting);
    const std::string challenge = line.substr(std::min(begin.size(), line.size()));
    if (!line.starts_with(begin) || !rig::is_challenge(challenge))
      return refuse(
          fmt::format("'{}' is not '{}64 hexadecimal digits'", line.substr(0, begin.size()), begin));
    std::string proof;
    if (secret_.empty()) {
      if (!talk_.send(std::string_view("open\n"))) return false;
    } else {
      const auto own = rig::random_challenge();
      if (!own) return refuse(own.error().line());
      if (!talk_.send(fmt::format("challenge={}\n", *own))) return false;
      if (!talk_.receive_line(line, rig::kLongestPairLine)) return false;
      const std::string wanted =
          fmt::format("proof={}", rig::proof_of(secret_, rig::Prover::host, *own, challenge));
      if (!rig::same_proof(line, wanted)) return refuse("the shared secret is another one");
      proof = fmt::format("proof={} ", rig::proof_of(secret_, rig::Prover::pair, *own, challenge));
    }
    const auto begun = service_.begin();
    if (!begun) talk_.dismiss(refusal(begun.error()));
    return begun && talk_.send(fmt::format("{}version=1 {}\n", proof, service_.facts()));
  }

  PairService& service_;
  const std::string& secret_;
  rig::ClientTalk& talk_;
};

}  // namespace

class PairServer::ServedPair {
 public:
  ServedPair(std::unique_ptr<PairService> service, std::string secret, board::ListeningPlace place)
      : service_(std::move(service)), secret_(std::move(secret)), place_(std::move(place)) {}

  void run(const std::function<bool()>& keep_going) {
    rig::serve_clients(place_, keep_going,
                       [this](rig::ClientTalk& talk) { Stay(*service_, secret_, talk).run(); });
  }

 private:
  std::unique_ptr<PairService> service_;
  std::string secret_;
  board::ListeningPlace place_;
};

PairServer::PairServer(std::unique_ptr<ServedPair> served) : served_(std::move(served)) {}
PairServer::PairServer(PairServer&&) noexcept = default;
PairServer& PairServer::operator=(PairServer&&) noexcept = default;
PairServer::~PairServer() = default;

Result<PairServer> PairServer::open(std::unique_ptr<PairService> service, const std::string& place,
                                    const std::string& secret) {
  std::string known;
  if (!secret.empty()) {
    SYMRIG_TRY(known, read_pair_secret(secret));
  }
  if (known.empty() && !place.starts_with("unix:"))
    return Error{ErrorCode::bad_argument, fmt::format("{} needs a shared secret", place),
                 "give a file with a secret, or listen at unix:PATH"};
  SYMRIG_TRY(board::ListeningPlace listening, board::ListeningPlace::open_to_network(place));
  return PairServer(std::make_unique<ServedPair>(std::move(service), std::move(known), std::move(listening)));
}

void PairServer::run(const std::function<bool()>& keep_going) {
  served_->run(keep_going);
}

}  // namespace symrig
