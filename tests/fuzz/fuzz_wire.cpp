// SPDX-License-Identifier: Apache-2.0
// The board's end of the wire alone: what it lets through to the core against the rules of sequence, kept
// here in a few lines; and the urgent abort found in an interrupt against the one that the link obeys.
#include "compact_program.hpp"
#include "symrig/firmware/link.hpp"
#include "symrig/protocol/frame.hpp"
#include "symrig/protocol/messages.hpp"
#include "targets.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <vector>

namespace symrig::fuzz {
namespace {

using protocol::Frame;
using protocol::FrameDecoder;

void expect_round_trip(const Frame& frame) {
  require(frame.body.size <= protocol::kMaxBody, "a body fits the MTU");
  const std::vector<std::uint8_t> body(frame.body.data, frame.body.data + frame.body.size);
  std::array<std::uint8_t, protocol::kMaxWire> wire{};
  const std::size_t size =
      protocol::encode_frame(frame.header, {body.data(), body.size()}, {wire.data(), wire.size()});
  require(size > 0, "what was decoded can be encoded");
  FrameDecoder again;
  for (std::size_t i = 0; i + 1 < size; ++i)
    require(wire[i] != 0 && again.push(wire[i]) == FrameDecoder::Event::none, "no zero within a frame");
  require(again.push(0) == FrameDecoder::Event::frame, "what was encoded can be decoded");
  require(again.frame().header.seq == frame.header.seq && again.frame().header.kind == frame.header.kind,
          "the header survives");
  require(std::equal(body.begin(), body.end(), again.frame().body.data,
                     again.frame().body.data + again.frame().body.size),
          "the body survives");
}

}  // namespace

void fuzz_frame(const std::uint8_t* data, std::size_t size) {
  FrameDecoder decoder;
  for (std::size_t i = 0; i < size; ++i)
    if (decoder.push(data[i]) == FrameDecoder::Event::frame) expect_round_trip(decoder.frame());
}

namespace {

template <class Message>
void expect_stable(const std::uint8_t* data, std::size_t size) {
  Message message;
  if (!protocol::decode({data, size}, message)) return;
  protocol::BodyBuffer first{};
  const std::size_t first_size = encode(message, first);
  require(first_size <= protocol::kMaxBody, "a message fits its bound");
  Message again;
  require(protocol::decode({first.bytes, first_size}, again), "what was encoded can be decoded");
  protocol::BodyBuffer second{};
  const std::size_t second_size = encode(again, second);
  require(first_size == second_size && std::memcmp(first.bytes, second.bytes, first_size) == 0,
          "encoding is stable");
}

/// Marks and edges have an encoder of their own, which gives the same bytes.
void expect_twin(const std::uint8_t* data, std::size_t size) {
  symrig_wire_Event event;
  if (!protocol::decode({data, size}, event)) return;
  protocol::BodyBuffer general{};
  protocol::BodyBuffer own{};
  const std::size_t general_size = encode(event, general);
  std::size_t own_size = 0;
  if (event.which_body == symrig_wire_Event_step_mark_tag) {
    own_size = encode(event.body.step_mark, own);
  } else if (event.which_body == symrig_wire_Event_edge_tag) {
    own_size = encode(event.body.edge, own);
  } else {
    return;
  }
  require(own_size == general_size && std::memcmp(own.bytes, general.bytes, own_size) == 0,
          "both encoders of marks and edges agree");
}

/// The first byte names a field of the outer message, the rest is what it holds: each kind of message is
/// reached at once.
void expect_each_stable(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > protocol::kMaxBody - 6) return;
  std::array<std::uint8_t, protocol::kMaxBody> body{};
  const std::uint32_t field = data[0] % 64U;
  const auto content = static_cast<std::uint32_t>(size - 1);
  std::size_t at = 0;
  const auto varint = [&](std::uint32_t value) {
    for (; value >= 0x80; value >>= 7U) body[at++] = static_cast<std::uint8_t>(value | 0x80U);
    body[at++] = static_cast<std::uint8_t>(value);
  };
  varint(field << 3U | 2U);
  varint(content);
  std::copy_n(data + 1, content, body.begin() + static_cast<std::ptrdiff_t>(at));
  expect_stable<symrig_wire_Request>(body.data(), at + content);
  expect_stable<symrig_wire_Reply>(body.data(), at + content);
  expect_stable<symrig_wire_Event>(body.data(), at + content);
  expect_twin(body.data(), at + content);
}

}  // namespace

void fuzz_messages(const std::uint8_t* data, std::size_t size) {
  expect_stable<symrig_wire_Request>(data, size);
  expect_stable<symrig_wire_Reply>(data, size);
  expect_stable<symrig_wire_Event>(data, size);
  expect_twin(data, size);
  expect_each_stable(data, size);
}

namespace {

using protocol::Kind;
namespace flag = protocol::flag;

class Pipe final : public hal::ByteLink {
 public:
  std::deque<std::uint8_t> to_board;
  std::vector<std::uint8_t> to_host;
  std::size_t free = 4096;

  std::size_t read(std::uint8_t* out, std::size_t room) override {
    std::size_t count = 0;
    for (; count < room && !to_board.empty(); ++count) {
      out[count] = to_board.front();
      to_board.pop_front();
    }
    return count;
  }
  std::size_t room() const override { return free; }
  void write(const std::uint8_t* bytes, std::size_t size) override {
    require(size <= free, "no more is written than there is room for");
    to_host.insert(to_host.end(), bytes, bytes + size);
  }
  bool attached() const override { return true; }
};

/// Counts what was let through. Every third request is answered later.
class Counter final : public firmware::Requests {
 public:
  std::uint32_t requests = 0;
  std::uint32_t chunks = 0;
  std::uint32_t aborts = 0;
  std::uint32_t pending = 0;

  firmware::Answer answer(const symrig_wire_Request& request, symrig_wire_Reply&) override {
    if (request.which_body == symrig_wire_Request_abort_tag) ++aborts;
    ++requests;
    if (request.which_body != symrig_wire_Request_program_commit_tag) return firmware::Answer::now;
    pending = 1;
    return firmware::Answer::later;
  }
  void take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) override {
    ++chunks;
    if (chunk.offset % 2 != 0) reply.code = symrig_wire_Code_CODE_BAD_CHUNK;
  }
};

class LinkPlayer {
 public:
  explicit LinkPlayer(std::span<const std::uint8_t> bytes) : input_(bytes) {}

  void play() {
    while (!input_.empty()) move();
    pipe_.free = 4096;
    expect_session();
  }

 private:
  void move() {
    switch (input_.byte() % 8) {
      case 0:
        feed(input_.bytes(input_.byte()));
        break;
      case 1:
        pipe_.free = std::size_t{16} * input_.byte();
        break;
      case 2:
        event();
        break;
      case 3:
        now_ += std::uint64_t{1000} * input_.word();
        break;
      case 4:
        if (counter_.pending != 0) finish_later();
        break;
      default:
        frame();
        break;
    }
    link_.send_events(now_);
    check_host_side();
  }

  /// A frame with a number near the one expected.
  void frame() {
    static constexpr std::array<Kind, 8> kKinds{Kind::request, Kind::request, Kind::request, Kind::data,
                                                Kind::ack,     Kind::nak,     Kind::reply,   Kind::event};
    const std::uint8_t what = input_.byte();
    const Kind kind = kKinds.at(what % 8U);
    const std::uint8_t flags = (what >> 3U) % 8U < 4 ? 0 : static_cast<std::uint8_t>(what >> 6U);
    const auto seq = static_cast<std::uint16_t>(model_expected_ + input_.byte() % 8U - 3U);
    feed_frame(kind, seq, flags, body(kind));
  }

  std::vector<std::uint8_t> body(Kind kind) {
    static constexpr std::array<std::array<std::uint8_t, 2>, 5> kBodies{
        {{0x52, 0}, {0x0A, 0}, {0x72, 0}, {0x3A, 0}, {0x62, 0}}};
    if (kind == Kind::data) {
      std::vector<std::uint8_t> chunk(16);
      chunk[4] = input_.byte();
      chunk[8] = 4;
      return chunk;
    }
    const std::uint8_t which = input_.byte();
    if (which % 6 == 5) return input_.bytes(which / 6U);
    const auto& known = kBodies.at(which % 6U);
    return {known.begin(), known.end()};
  }

  void feed_frame(Kind kind, std::uint16_t seq, std::uint8_t flags, const std::vector<std::uint8_t>& body) {
    std::vector<std::uint8_t> wire(protocol::kMaxWire);
    const protocol::FrameHeader header{protocol::kProtoMajor, kind, seq, input_.byte(), input_.byte(), flags};
    wire.resize(protocol::encode_frame(header, {body.data(), body.size()}, {wire.data(), wire.size()}));
    feed(wire);
  }

  /// Byte by byte: the scan in the interrupt and the link must agree on every abort as encoders write it, and
  /// the link must do with each frame what the rules say.
  void feed(const std::vector<std::uint8_t>& bytes) {
    for (const std::uint8_t byte : bytes) {
      const Counter before = counter_;
      const bool found = scan_.push(byte);
      pipe_.to_board.push_back(byte);
      link_.receive(counter_, now_);
      require(!found || counter_.aborts == before.aborts + 1, "an abort that the scan finds is obeyed");
      if (sniffer_.push(byte) == protocol::FrameDecoder::Event::frame) expect_rules(sniffer_.frame(), before);
    }
  }

  /// What the rules of "Sequence" say of a frame, from here.
  void expect_rules(const protocol::Frame& frame, const Counter& before) {
    const auto [major, kind, seq, ack, credit, flags] = frame.header;
    const bool sync = kind == Kind::request && (flags & flag::sync) != 0;
    const bool urgent = kind == Kind::request && !sync && (flags & flag::urgent) != 0;
    symrig_wire_Request request;
    const bool sound = protocol::decode(frame.body, request);
    const std::uint32_t done = counter_.requests - before.requests + counter_.chunks - before.chunks;
    if (sync) {
      const bool begins = sound && request.which_body == symrig_wire_Request_hello_tag;
      require(done == (begins ? 1U : 0U), "hello, and nothing else, begins a session");
      if (begins) {
        model_session_ = true;
        model_expected_ = static_cast<std::uint16_t>(seq + 1);
        counter_.pending = 0;
      }
    } else if (urgent) {
      const bool may = sound && (request.which_body == symrig_wire_Request_abort_tag ||
                                 request.which_body == symrig_wire_Request_time_ping_tag);
      require(done == (may ? 1U : 0U), "abort and time are carried out at once, nothing else");
    } else {
      const bool numbered = kind == Kind::request || kind == Kind::data;
      const bool in_turn = model_session_ && numbered && before.pending == 0 && seq == model_expected_;
      if (in_turn) ++model_expected_;
      require(done <= (in_turn ? 1U : 0U), "a frame is carried out once, in its turn");
      const bool must = in_turn && kind == Kind::request && sound && major == protocol::kProtoMajor;
      require(!must || done == 1, "a sound request in turn is carried out");
    }
  }

  void finish_later() {
    counter_.pending = 0;
    symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
    link_.complete(reply);
  }

  void event() {
    symrig_wire_Event event = symrig_wire_Event_init_zero;
    event.which_body = symrig_wire_Event_step_mark_tag;
    event.body.step_mark.id = ++event_id_;
    queue_.push(event, event_id_);
  }

  /// Whatever the board sends is sound frames.
  void check_host_side() {
    for (const std::uint8_t byte : pipe_.to_host) {
      const auto found = host_.push(byte);
      require(found == protocol::FrameDecoder::Event::none || found == protocol::FrameDecoder::Event::frame,
              "a board sends nothing but frames");
    }
    pipe_.to_host.clear();
  }

  void expect_session() {
    feed({0});
    const std::uint32_t before = counter_.requests;
    feed_frame(Kind::request, 0x4321, flag::sync, {0x0A, 0});
    require(counter_.requests == before + 1, "a session can always begin");
  }

  Input input_;
  Pipe pipe_;
  std::array<symrig_wire_Event, 16> slots_{};
  firmware::EventQueue queue_{slots_.data(), 16};
  firmware::Link link_{pipe_, queue_, 1'000'000};
  firmware::UrgentScan scan_;
  Counter counter_;
  protocol::FrameDecoder sniffer_, host_;
  std::uint64_t now_ = 0;
  std::uint32_t event_id_ = 0;
  bool model_session_ = false;
  std::uint16_t model_expected_ = 0;
};

}  // namespace

void fuzz_link(const std::uint8_t* data, std::size_t size) {
  LinkPlayer({data, size}).play();
}

}  // namespace symrig::fuzz
