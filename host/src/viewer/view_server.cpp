// SPDX-License-Identifier: Apache-2.0
#include "symrig/viewer/server.hpp"
#include "viewer/connection.hpp"
#include "viewer/live_service.hpp"
#include "viewer/view_service.hpp"

#include <chrono>
#include <random>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <fmt/format.h>

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
