// SPDX-License-Identifier: Apache-2.0
// Pairs behind sockets: the photographs, the secret, and hosts and pairs that misbehave.
#include "assert_ok.hpp"
#include "rig/pairs/pair_words.hpp"
#include "scratch.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/sim/simulated_pairs.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

namespace symrig::pair_server_test {
namespace {

using namespace std::chrono_literals;
using probe_laws::law_pattern;

constexpr ViewLayout kTwo{1, 2};
const std::string kScene = "sim:views2?size=24x20";

/// A pair that serves in a thread until it is destroyed.
class Served {
 public:
  Served(const std::string& scene, std::size_t pair, const std::string& place, const std::string& secret = "",
         ViewLayout layout = kTwo) {
    auto service = make_simulated_pair(scene, layout, pair);
    EXPECT_TRUE(service.ok()) << service.error().line();
    auto server = PairServer::open(*std::move(service), place, secret);
    EXPECT_TRUE(server.ok()) << server.error().line();
    server_ = std::make_unique<PairServer>(*std::move(server));
    thread_ = std::thread([this] { server_->run([this] { return !end_; }); });
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;
  ~Served() {
    end_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> end_ = false;
  std::unique_ptr<PairServer> server_;
  std::thread thread_;
};

PairAddress address_of(const std::string& place, const std::string& secret = "") {
  return {*DeviceUri::parse(place), secret};
}

Result<std::unique_ptr<SimulatedPairs>> joined(const std::vector<PairAddress>& addresses,
                                               SimulatedPairHooks hooks = {}) {
  std::vector<LinkedPair> pairs;
  for (const PairAddress& address : addresses) {
    SYMRIG_TRY(auto link, PairLink::open(address));
    pairs.push_back({address, std::move(link)});
  }
  return open_simulated_pairs(std::move(pairs), kTwo, {}, std::move(hooks));
}

int free_port() {
  const Fd fd(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  // NOLINTBEGIN(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  EXPECT_EQ(::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_EQ(::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  // NOLINTEND(cppcoreguidelines-pro-type-reinterpret-cast)
  return ntohs(address.sin_port);
}

std::string write_secret(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path) << text;
  std::filesystem::permissions(path,
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  return path.string();
}

std::vector<Pattern> patterns_of(Grid grid) {
  return {law_pattern(grid, 1), Pattern(grid), law_pattern(grid, 2), Pattern(grid, 1, 1.F)};
}

void expect_photographs_of(Probe& one, Probe& other) {
  const auto a = one.measure(patterns_of(one.grid())), b = other.measure(patterns_of(one.grid()));
  ASSERT_OK(a);
  ASSERT_OK(b);
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_EQ((*a)[i].mean, (*b)[i].mean) << i;
    EXPECT_EQ((*a)[i].variance, (*b)[i].variance) << i;
  }
}

TEST(PairServer, two_pairs_take_the_photographs_of_one_rig) {
  for (const std::string keys : {"", "&noise=off", "&channels=3&exposures=2"}) {
    const test::Scratch folder;
    const std::string left = "unix:" + (folder / "left").string(),
                      right = "unix:" + (folder / "right").string();
    const Served one(kScene + keys, 0, left), two(kScene + keys, 1, right);
    const auto pairs = joined({address_of(left), address_of(right)});
    ASSERT_OK(pairs);
    const auto alone = open_virtual_rig(kScene + keys);
    ASSERT_OK(alone);
    expect_photographs_of(**alone, **pairs);
  }
}

TEST(PairServer, keeps_the_laws_of_a_probe_over_tcp_with_a_secret) {
  const test::Scratch folder;
  const std::string secret = write_secret(folder / "secret", "0123456789abcdef\n");
  const std::string left = fmt::format("tcp:127.0.0.1:{}", free_port());
  const std::string right = "unix:" + (folder / "right").string();
  const Served one(kScene + "&exposures=3", 0, left, secret), two(kScene + "&exposures=3", 1, right);
  const auto pairs = joined({address_of(left, secret), address_of(right)});
  ASSERT_OK(pairs);
  expect_probe_laws(**pairs);
}

/// The pair stops between two photographs and comes back at the same place.
TEST(PairServer, a_lost_pair_is_connected_again) {
  const test::Scratch folder;
  const std::string left = "unix:" + (folder / "left").string(),
                    right = "unix:" + (folder / "right").string();
  const std::string scene = kScene + "&noise=off";
  const Served one(scene, 0, left);
  auto two = std::make_unique<Served>(scene, 1, right);
  SimulatedPairHooks hooks;
  int waited = 0;
  hooks.options = [&](RigOptions& options) {
    options.pause = [&](Nanoseconds) {
      if (++waited == 2) two = std::make_unique<Served>(scene, 1, right);
    };
  };
  const auto pairs = joined({address_of(left), address_of(right)}, std::move(hooks));
  ASSERT_OK(pairs);
  two.reset();
  const auto alone = open_virtual_rig(scene);
  ASSERT_OK(alone);
  expect_photographs_of(**alone, **pairs);
  EXPECT_EQ((*pairs)->rig().trouble().cameras_reopened, 1);
  EXPECT_EQ(waited, 2);
}

TEST(PairServer, a_pair_that_stays_away_is_named) {
  const test::Scratch folder;
  const std::string left = "unix:" + (folder / "left").string(),
                    right = "unix:" + (folder / "right").string();
  const Served one(kScene, 0, left);
  auto two = std::make_unique<Served>(kScene, 1, right);
  SimulatedPairHooks hooks;
  hooks.options = [](RigOptions& options) {
    options.pause = [](Nanoseconds) {};
    options.device_patience = 2s;
  };
  const auto pairs = joined({address_of(left), address_of(right)}, std::move(hooks));
  ASSERT_OK(pairs);
  two.reset();
  const auto seen = (*pairs)->measure(patterns_of((*pairs)->grid()));
  ASSERT_FALSE(seen.ok());
  EXPECT_EQ(seen.error().code, ErrorCode::device_lost);
  EXPECT_TRUE(seen.error().what.starts_with("pair 2: " + right)) << seen.error().line();
}

TEST(PairServer, another_scene_place_or_layout_is_refused) {
  const test::Scratch folder;
  const std::string left = "unix:" + (folder / "left").string(),
                    right = "unix:" + (folder / "right").string();
  const Served one(kScene, 0, left);
  for (const auto& [scene, pair, layout, word] :
       {std::tuple{kScene + "&seed=2", 1, kTwo, "scene"}, std::tuple{kScene, 0, kTwo, "place"},
        std::tuple{kScene, 1, ViewLayout{2, 1}, "layout"}}) {
    const Served two(scene, static_cast<std::size_t>(pair), right, "", layout);
    const auto pairs = joined({address_of(left), address_of(right)});
    ASSERT_FALSE(pairs.ok());
    EXPECT_EQ(pairs.error().code, ErrorCode::bad_argument);
    EXPECT_NE(pairs.error().what.find(word), std::string::npos) << pairs.error().line();
    EXPECT_TRUE(pairs.error().what.starts_with("pair 2: ")) << pairs.error().line();
  }
}

TEST(PairSecret, must_be_the_same_on_both_sides) {
  const test::Scratch folder;
  const std::string secret = write_secret(folder / "secret", "0123456789abcdef0123456789abcdef");
  const std::string other = write_secret(folder / "other", "0123456789abcdef0123456789abcdeF");
  const std::string place = fmt::format("tcp:127.0.0.1:{}", free_port());
  const std::string open_place = "unix:" + (folder / "open").string();
  const Served served(kScene, 0, place, secret), open(kScene, 0, open_place);
  EXPECT_TRUE(PairLink::open(address_of(place, secret)).ok());
  const auto wrong = PairLink::open(address_of(place, other));
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::device_refused);
  EXPECT_NE(wrong.error().what.find("the shared secret is another one"), std::string::npos)
      << wrong.error().line();
  const auto none = PairLink::open(address_of(place));
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::bad_argument) << none.error().line();
  const auto asked_for_none = PairLink::open(address_of(open_place, secret));
  ASSERT_FALSE(asked_for_none.ok()) << "somebody else may answer there";
  EXPECT_EQ(asked_for_none.error().code, ErrorCode::device_refused);
  EXPECT_TRUE(PairLink::open(address_of(place, secret)).ok()) << "the server goes on";
}

TEST(PairSecret, is_needed_for_tcp) {
  auto service = make_simulated_pair(kScene, kTwo, 0);
  ASSERT_OK(service);
  const auto server = PairServer::open(*std::move(service), "tcp:127.0.0.1:1", "");
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.error().code, ErrorCode::bad_argument);
}

TEST(PairSecret, is_long_and_for_its_owner_only) {
  const test::Scratch folder;
  const std::string brief = write_secret(folder / "brief", "0123456789abcde\n");
  EXPECT_EQ(read_pair_secret(brief).error().code, ErrorCode::bad_value);
  const std::string good = write_secret(folder / "good", "0123456789abcdef\n");
  EXPECT_EQ(*read_pair_secret(good), "0123456789abcdef");
  std::filesystem::permissions(good, std::filesystem::perms::group_read, std::filesystem::perm_options::add);
  EXPECT_EQ(read_pair_secret(good).error().code, ErrorCode::bad_value);
  EXPECT_EQ(read_pair_secret((folder / "none").string()).error().code, ErrorCode::not_found);
}

// RFC 4231, test case 2, shows the function; the text is the protocol's.
TEST(PairSecret, proofs_differ_by_role_and_challenge) {
  const std::string a(64, 'a'), b(64, 'b');
  const std::string proof = rig::proof_of("secret of both", rig::Prover::host, a, b);
  EXPECT_TRUE(rig::is_challenge(proof));
  EXPECT_EQ(proof, rig::proof_of("secret of both", rig::Prover::host, a, b));
  EXPECT_NE(proof, rig::proof_of("secret of both", rig::Prover::pair, a, b));
  EXPECT_NE(proof, rig::proof_of("secret of both", rig::Prover::host, b, a));
  EXPECT_NE(proof, rig::proof_of("another secret", rig::Prover::host, a, b));
  EXPECT_NE(*rig::random_challenge(), *rig::random_challenge());
}

/// A host that sends what it likes.
class RawHost {
 public:
  explicit RawHost(const std::string& path) : fd_(*board::connect_unix(path)) {}
  void send(std::string_view text) const { ::send(fd_.get(), text.data(), text.size(), MSG_NOSIGNAL); }
  /// One line; what there is after ten seconds.
  std::string line() const {
    std::string text;
    pollfd one{fd_.get(), POLLIN, 0};
    for (char c = 0; ::poll(&one, 1, 10'000) > 0 && ::recv(fd_.get(), &c, 1, 0) == 1 && c != '\n';) text += c;
    return text;
  }

 private:
  Fd fd_;
};

const std::string kGreeting = "symrig-pair 1 challenge=" + std::string(64, '0') + "\n";

TEST(PairServer, a_replayed_proof_is_refused) {
  const test::Scratch folder;
  const std::string secret = write_secret(folder / "secret", "0123456789abcdef");
  const std::string path = (folder / "socket").string();
  const Served served(kScene, 0, "unix:" + path, secret);
  std::string proof;
  {
    const RawHost host(path);
    host.send(kGreeting);
    const std::string challenge = host.line().substr(10);
    proof = "proof=" + rig::proof_of("0123456789abcdef", rig::Prover::host, challenge, std::string(64, '0')) +
            "\n";
    host.send(proof);
    EXPECT_TRUE(host.line().starts_with("proof="));
  }
  const RawHost host(path);
  host.send(kGreeting);
  EXPECT_TRUE(host.line().starts_with("challenge="));
  host.send(proof);
  EXPECT_EQ(host.line(), "error: the shared secret is another one");
}

TEST(PairServer, hostile_bytes_get_one_line_and_harm_nobody) {
  const test::Scratch folder;
  const std::string path = (folder / "socket").string();
  const Served served(kScene, 0, "unix:" + path);
  const std::string floods(100'000, 'x');
  for (const std::string& greeting :
       {std::string("symrig-exec 1\n"), std::string("symrig-pair 2 challenge=0\n"),
        std::string("GET / HTTP/1.1\r\n"), floods, std::string("symrig-pair 1 challenge=zz\n"),
        std::string(2000, '\0')}) {
    const RawHost host(path);
    host.send(greeting);
    EXPECT_TRUE(host.line().starts_with("error: ")) << greeting.substr(0, 40);
  }
  const auto answer_to = [&](const std::string& request) {
    const RawHost host(path);
    host.send(kGreeting);
    EXPECT_EQ(host.line(), "open");
    EXPECT_TRUE(host.line().starts_with("version=1 kind=simulated pair=1 layout=1x2 scene=sim:views2"));
    host.send(request);
    return host.line();
  };
  for (const char* const request :
       {"develop\n", "develop 1\n", "develop 65 1\n", "develop 1 257\n", "develop 1 0\n", "develop -1 1\n",
        "develop 1 1 \n", "develop 99999999999999999999 1\n", "measure 1\n", "\n"})
    EXPECT_TRUE(answer_to(request).starts_with("error: ")) << request;
  std::string nan(8 + 4 * 24 * 20, '\0');
  std::memset(nan.data() + 8, 0xff, 4);
  EXPECT_TRUE(answer_to("develop 1 1\n" + nan).starts_with("error: pattern 1"));
  const std::string dark(8 + 4 * 24 * 20, '\0'), zeros(24, '\0');
  EXPECT_TRUE(answer_to("develop 1 1\n" + dark + zeros).starts_with("error: an exposure of 0 s"));
  EXPECT_TRUE(PairLink::open(address_of("unix:" + path)).ok()) << "it goes on";
}

/// Strangers who send a byte of a greeting now and then, and connect again after each refusal.
class Strangers {
 public:
  Strangers(const std::string& path, int count) {
    for (int k = 0; k < count; ++k)
      threads_.emplace_back([this, path] {
        while (!end_) visit(path);
      });
  }
  Strangers(const Strangers&) = delete;
  Strangers& operator=(const Strangers&) = delete;
  ~Strangers() {
    end_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  int visits() const { return visits_; }

 private:
  void visit(const std::string& path) {
    const auto fd = board::connect_unix(path);
    if (!fd) return;
    ++visits_;
    while (!end_ && ::send(fd->get(), "s", 1, MSG_NOSIGNAL) == 1) std::this_thread::sleep_for(50ms);
  }

  std::atomic<bool> end_ = false;
  std::atomic<int> visits_ = 0;
  std::vector<std::thread> threads_;
};

// The time of a greeting is for all of it, not for each byte. Who waits is served before strangers that come
// again.
TEST(PairServer, strangers_do_not_keep_the_owner_out) {
  const test::Scratch folder;
  const std::string path = (folder / "socket").string();
  const std::string secret = write_secret(folder / "secret", std::string(64, 'a'));
  const Served served(kScene, 0, "unix:" + path, secret);
  const Strangers strangers(path, 2);
  while (strangers.visits() < 2) std::this_thread::sleep_for(1ms);
  const auto owner = PairLink::open(address_of("unix:" + path, secret));
  EXPECT_TRUE(owner.ok()) << owner.error().line();
}

TEST(PairServer, one_host_at_a_time) {
  const test::Scratch folder;
  const std::string place = "unix:" + (folder / "socket").string();
  const Served served(kScene, 0, place);
  const auto first = PairLink::open(address_of(place));
  ASSERT_OK(first);
  const auto second = PairLink::open(address_of(place));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::device_lost);
  EXPECT_NE(second.error().what.find("busy"), std::string::npos) << second.error().line();
}

/// A pair that answers what it likes, one text for each line that it hears.
class RawPair {
 public:
  RawPair(const std::string& path, std::vector<std::string> answers) : fd_(*board::listen_unix(path)) {
    thread_ = std::thread([this, answers = std::move(answers)] {
      pollfd one{fd_.get(), POLLIN, 0};
      if (::poll(&one, 1, 10'000) <= 0) return;
      const Fd host(::accept(fd_.get(), nullptr, nullptr));
      fd_.close();  // it answers once
      for (const std::string& answer : answers) {
        for (char c = 0; ::recv(host.get(), &c, 1, 0) == 1 && c != '\n';) continue;
        ::send(host.get(), answer.data(), answer.size(), MSG_NOSIGNAL);
      }
      ::shutdown(host.get(), SHUT_WR);
      std::vector<char> heard(4096);
      while (::recv(host.get(), heard.data(), heard.size(), 0) > 0) continue;
    });
  }
  RawPair(const RawPair&) = delete;
  RawPair& operator=(const RawPair&) = delete;
  ~RawPair() { thread_.join(); }

 private:
  Fd fd_;
  std::thread thread_;
};

TEST(PairLink, refuses_what_is_no_pair) {
  const std::string long_line(5000, 'x');
  struct Answer {
    std::string text;
    ErrorCode code;
  };
  for (const Answer& answer :
       {Answer{"", ErrorCode::device_lost}, Answer{"open\n", ErrorCode::device_lost},
        Answer{"HTTP/1.1 400\r\n\r\n", ErrorCode::protocol}, Answer{long_line, ErrorCode::protocol},
        Answer{"open\nversion=2 kind=simulated\n", ErrorCode::protocol},
        Answer{"open\nversion=1\n", ErrorCode::protocol}, Answer{"challenge=12\n", ErrorCode::protocol},
        Answer{"error: no\n", ErrorCode::device_refused}}) {
    const test::Scratch folder;
    const std::string path = (folder / "socket").string();
    const RawPair pair(path, {answer.text});
    const auto link = PairLink::open(address_of("unix:" + path));
    ASSERT_FALSE(link.ok()) << answer.text.substr(0, 40);
    EXPECT_EQ(link.error().code, answer.code) << link.error().line();
    EXPECT_EQ(link.error().line().find('\n'), std::string::npos);
  }
}

TEST(PairLink, does_not_trust_a_pair_without_the_secret) {
  const test::Scratch folder;
  const std::string secret = write_secret(folder / "secret", "0123456789abcdef");
  const std::string path = (folder / "socket").string();
  const RawPair pair(path, {"challenge=" + std::string(64, 'a') + "\n",
                            "proof=" + std::string(64, 'b') + " version=1 kind=simulated\n"});
  const auto link = PairLink::open(address_of("unix:" + path, secret));
  ASSERT_FALSE(link.ok());
  EXPECT_EQ(link.error().code, ErrorCode::device_refused);
}

/// Frames of another size, or a connection that ends in the middle of one.
TEST(SimulatedPairs, a_pair_that_breaks_the_framing_is_named) {
  const test::Scratch folder;
  const std::string left = "unix:" + (folder / "left").string(), path = (folder / "right").string();
  const Served one(kScene, 0, left);
  for (const std::string frames : {"frame 1 7\n1234567", "frame 1 480\nabc", "nonsense\n"}) {
    std::filesystem::remove(path);
    const RawPair two(
        path, {"open\nversion=1 kind=simulated pair=2 layout=1x2 scene=sim:views2?size=24x20\n", frames});
    SimulatedPairHooks hooks;
    hooks.options = [](RigOptions& options) {
      options.pause = [](Nanoseconds) {};
      options.device_patience = 0s;
    };
    const auto pairs = joined({address_of(left), address_of("unix:" + path)}, std::move(hooks));
    ASSERT_FALSE(pairs.ok());
    EXPECT_NE(pairs.error().what.find("pair 2: unix:" + path), std::string::npos) << pairs.error().line();
  }
}

}  // namespace
}  // namespace symrig::pair_server_test
