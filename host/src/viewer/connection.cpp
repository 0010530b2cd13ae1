// SPDX-License-Identifier: Apache-2.0
#include "viewer/connection.hpp"

#include <chrono>
#include <cstdint>
#include <utility>

namespace symrig::viewer {
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
