// SPDX-License-Identifier: Apache-2.0

#include "symrig/viewer/server.hpp"
#include "viewer/service.hpp"
#include "viewer/view_service.hpp"

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <fmt/format.h>

namespace symrig::viewer {

using Socket = boost::asio::ip::tcp::socket;
using Failure = boost::system::error_code;

class Connection;

/// Open connections in two lists. A new one is a stranger until a request of it shows the secret. In each
/// list the first has waited longest, and it is closed when there are too many. So strangers push out only
/// each other: they cost memory, but never a page its connection.
struct Connections {
  static constexpr std::size_t kMost = 32;  ///< of a list

  std::list<std::shared_ptr<Connection>> strangers;
  std::list<std::shared_ptr<Connection>> known;
};

/// One connection: reads a request, writes the reply, and so on. All of it runs on one thread.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Socket socket, Service& service, Connections& all);

  void start();
  /// Its operations fail, and so it ends.
  void close();

 private:
  void become_known();
  void read();
  void take_head(Failure failure);
  void take_body(Failure failure);
  void give_up(Failure failure);
  void write(ViewReply reply, bool keep);
  ViewRequest request() const;

  boost::beast::tcp_stream stream_;
  Service& service_;
  Connections& all_;
  std::list<std::shared_ptr<Connection>>* list_ = nullptr;  // none: it has ended
  std::list<std::shared_ptr<Connection>>::iterator place_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  boost::beast::http::response<boost::beast::http::string_body> reply_;
};

namespace {

namespace beast = boost::beast;

namespace http = beast::http;

constexpr std::uint32_t kMaxHead = 8 * 1024;                  // bytes
constexpr std::size_t kBufferBytes = std::size_t{64} * 1024;  // a head and the beginning of a body

/// A request must be complete, and a reply taken, within this time. An idle connection ends after it too.
constexpr auto kPatience = std::chrono::seconds(20);

/// Closes the one that has waited longest, if another has no room.
void make_room(std::list<std::shared_ptr<Connection>>& list) {
  if (list.size() >= Connections::kMost) list.front()->close();
}

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// The answer to bytes that are no request; nothing if the connection just ended.
std::optional<ViewReply> reply_to(Failure failure) {
  if (failure == http::error::body_limit)
    return ViewReply{.status = 413, .body = "The request is too large.\n"};
  if (failure == http::error::header_limit)
    return ViewReply{.status = 431, .body = "The head of the request is too large.\n"};
  const bool ended = failure == http::error::end_of_stream || failure == http::error::partial_message;
  if (ended || failure.category() != make_error_code(http::error::bad_method).category()) return std::nullopt;
  return ViewReply{.status = 400, .body = "This is no HTTP request.\n"};
}

}  // namespace

Connection::Connection(Socket socket, Service& service, Connections& all)
    : stream_(std::move(socket)), service_(service), all_(all), buffer_(kBufferBytes) {}

void Connection::start() {
  list_ = &all_.strangers;
  make_room(*list_);
  place_ = list_->insert(list_->end(), shared_from_this());
  read();
}

/// The last of those that have waited.
void Connection::become_known() {
  if (list_ == nullptr) return;
  if (list_ != &all_.known) make_room(all_.known);
  all_.known.splice(all_.known.end(), *std::exchange(list_, &all_.known), place_);
}

void Connection::close() {
  Failure ignored;
  stream_.socket().close(ignored);
  // The list may hold the last reference to this object.
  if (list_ != nullptr) std::exchange(list_, nullptr)->erase(place_);
}

void Connection::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHead);
  parser_->body_limit(service_.max_body());
  stream_.expires_after(kPatience);
  http::async_read_header(
      stream_, buffer_, *parser_,
      [self = shared_from_this()](Failure failure, std::size_t) { self->take_head(failure); });
}

/// The body of a stranger's request is not read, so it costs no memory.
void Connection::take_head(Failure failure) {
  if (failure) return give_up(failure);
  if (auto refusal = service_.refused(request())) return write(*std::move(refusal), false);
  become_known();
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](Failure later, std::size_t) { self->take_body(later); });
}

void Connection::take_body(Failure failure) {
  if (failure) return give_up(failure);
  become_known();
  write(service_.answer(request()), parser_->get().keep_alive());
}

void Connection::give_up(Failure failure) {
  auto reply = reply_to(failure);
  if (reply) return write(*std::move(reply), false);
  close();
}

void Connection::write(ViewReply reply, bool keep) {
  reply_ = {};
  reply_.version(11);
  reply_.result(reply.status);
  reply_.set(http::field::content_type, beast::string_view(reply.type.data(), reply.type.size()));
  reply_.set(http::field::cache_control, "no-store");
  reply_.set("Referrer-Policy", "no-referrer");
  reply_.set("X-Content-Type-Options", "nosniff");
  reply_.set(http::field::x_frame_options, "DENY");
  reply_.set("Cross-Origin-Resource-Policy", "same-origin");
  if (!reply.policy.empty()) reply_.set("Content-Security-Policy", reply.policy + "; frame-ancestors 'none'");
  reply_.keep_alive(keep);
  const std::size_t size = reply.body.size();
  if (parser_->get().method() != http::verb::head) reply_.body() = std::move(reply.body);
  reply_.content_length(size);
  stream_.expires_after(kPatience);
  http::async_write(stream_, reply_, [self = shared_from_this(), keep](Failure failure, std::size_t) {
    if (failure || !keep)
      self->close();
    else
      self->read();
  });
}

ViewRequest Connection::request() const {
  const auto& message = parser_->get();
  return {view(message.method_string()), view(message.target()), view(message[http::field::host]),
          view(message[http::field::origin]), message.body()};
}

}  // namespace symrig::viewer

namespace symrig {

namespace {

namespace asio = boost::asio;
using viewer::Failure, viewer::Socket;

constexpr auto kAskEvery = std::chrono::milliseconds(100);

/// 128 random bits of the system, as 32 hexadecimal digits.
std::string random_word() {
  std::random_device system;
  std::string word;
  for (int k = 0; k < 4; ++k) word += fmt::format("{:08x}", static_cast<std::uint32_t>(system()));
  return word;
}

using MakeService =
    std::function<std::unique_ptr<viewer::Service>(const std::string& secret, std::string nonce)>;

}  // namespace

class ViewServer::Listener {
 public:
  Listener(std::uint16_t port, const MakeService& make)
      : secret_(random_word()), port_(port), service_(make(secret_, random_word())), acceptor_(context_) {}

  Result<void> open() {
    const asio::ip::tcp::endpoint here(asio::ip::address_v4::loopback(), port_);
    Failure failure;
    acceptor_.open(here.protocol(), failure);
    if (!failure) acceptor_.set_option(asio::socket_base::reuse_address(true), failure);
    if (!failure) acceptor_.bind(here, failure);
    if (!failure) acceptor_.listen(asio::socket_base::max_listen_connections, failure);
    if (!failure) port_ = acceptor_.local_endpoint(failure).port();
    if (!failure) return {};
    return Error{ErrorCode::io, fmt::format("port {} of 127.0.0.1: {}", port_, failure.message()),
                 "give another port, or none for a free one"};
  }

  std::string address() const { return fmt::format("http://127.0.0.1:{}/{}/", port_, secret_); }

  void run(const std::function<bool()>& keep_going) {
    accept();
    while (keep_going()) {
      context_.restart();
      context_.run_for(kAskEvery);
    }
    Failure ignored;
    acceptor_.close(ignored);
    for (auto* list : {&connections_.strangers, &connections_.known})
      while (!list->empty()) list->front()->close();
    context_.restart();
    context_.run();
  }

 private:
  void accept() {
    acceptor_.async_accept([this](Failure failure, Socket socket) {
      if (failure == asio::error::operation_aborted) return;
      if (!failure) take(std::move(socket));
      accept();
    });
  }

  void take(Socket socket) {
    Failure ignored;
    socket.set_option(asio::ip::tcp::no_delay(true), ignored);
    std::make_shared<viewer::Connection>(std::move(socket), *service_, connections_)->start();
  }

  std::string secret_;
  std::uint16_t port_;
  std::unique_ptr<viewer::Service> service_;
  asio::io_context context_{1};
  asio::ip::tcp::acceptor acceptor_;
  viewer::Connections connections_;
};

ViewServer::ViewServer(std::unique_ptr<Listener> listener) : listener_(std::move(listener)) {}
ViewServer::ViewServer(ViewServer&&) noexcept = default;
ViewServer& ViewServer::operator=(ViewServer&&) noexcept = default;
ViewServer::~ViewServer() = default;

Result<ViewServer> ViewServer::open(StoredScene scene, ViewOptions options) {
  auto listener = std::make_unique<Listener>(options.port, [&](const std::string& secret, std::string nonce) {
    return std::make_unique<viewer::ViewService>(std::move(scene), options, secret, std::move(nonce));
  });
  SYMRIG_CHECK(listener->open());
  return ViewServer(std::move(listener));
}

Result<ViewServer> ViewServer::open(std::shared_ptr<const LiveScene> scene, ViewOptions options) {
  auto listener = std::make_unique<Listener>(options.port, [&](const std::string& secret, std::string nonce) {
    return std::make_unique<viewer::LiveService>(std::move(scene), options, secret, std::move(nonce));
  });
  SYMRIG_CHECK(listener->open());
  return ViewServer(std::move(listener));
}

std::string ViewServer::address() const {
  return listener_->address();
}

void ViewServer::run(const std::function<bool()>& keep_going) {
  listener_->run(keep_going);
}

}  // namespace symrig
