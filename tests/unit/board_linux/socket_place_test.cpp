// SPDX-License-Identifier: Apache-2.0
// Where symrigd puts its socket: only a socket of before is replaced.
#include "scratch.hpp"
#include "socket_transport.hpp"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::socket_place_test {
namespace {

using symrig::test::Scratch;

TEST(SocketPlace, a_file_in_the_place_of_the_socket_stays) {
  const Scratch folder;
  std::ofstream(folder / "board.sock") << "of somebody else";
  const auto refused = SocketTransport::listen_unix(folder / "board.sock");
  EXPECT_FALSE(refused.ok());
  std::stringstream text;
  text << std::ifstream(folder / "board.sock").rdbuf();
  EXPECT_EQ(text.str(), "of somebody else");
}

TEST(SocketPlace, a_socket_that_nobody_serves_is_replaced) {
  const Scratch folder;
  {
    const auto first = SocketTransport::listen_unix(folder / "board.sock");
    ASSERT_TRUE(first.ok());
    std::filesystem::create_hard_link(folder / "board.sock", folder / "left.sock");
  }
  EXPECT_TRUE(SocketTransport::listen_unix(folder / "left.sock").ok());
}

}  // namespace
}  // namespace symrig::board_linux::test::socket_place_test
