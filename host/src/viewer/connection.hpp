// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "viewer/service.hpp"

#include <list>
#include <memory>
#include <optional>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>

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

}  // namespace symrig::viewer
