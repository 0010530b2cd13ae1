// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/trees.hpp"

#include <bit>
#include <utility>

namespace symrig::tensor::h5 {
namespace {

constexpr std::string_view kOldTree = "B-tree";

struct Node {
  Address at;
  unsigned level;
};

/// The entries of a node, behind its head.
struct Entries {
  unsigned level = 0;
  std::uint64_t count = 0;
  std::vector<std::uint8_t> bytes;
};

Result<Entries> read_node(const FileBytes& file, Address at, unsigned kind, std::uint64_t entry_bytes,
                          NodeBudget& budget) {
  const std::uint64_t head_bytes = 8 + 2 * file.superblock().address_bytes;
  SYMRIG_TRY(const auto head, file.read(at, head_bytes));
  Bytes bytes(head);
  if (!bytes.signature("TREE") || bytes.byte() != kind)
    return damaged_at(kOldTree, at, "is none of its kind");
  Entries entries;
  entries.level = bytes.byte();
  entries.count = bytes.number(2);
  SYMRIG_CHECK(budget.take(kOldTree, at, head_bytes + entries.count * entry_bytes));
  SYMRIG_TRY(entries.bytes, file.read(at + head_bytes, entries.count * entry_bytes));
  return entries;
}

}  // namespace

Result<void> walk_old_tree(const FileBytes& file, Address root, unsigned kind, std::uint64_t key_bytes,
                           const VisitOldEntry& visit) {
  constexpr unsigned kAnyLevel = 256;
  const std::uint64_t entry_bytes = key_bytes + file.superblock().address_bytes;
  NodeBudget budget(file);
  std::vector<Node> open{{root, kAnyLevel}};
  while (!open.empty()) {
    const Node node = open.back();
    open.pop_back();
    SYMRIG_TRY(const Entries entries, read_node(file, node.at, kind, entry_bytes, budget));
    if (node.level != kAnyLevel && entries.level != node.level)
      return damaged_at(kOldTree, node.at, "is of another level than it should be");
    Bytes bytes(entries.bytes);
    for (std::uint64_t k = 0; k < entries.count; ++k) {
      const Bytes key(bytes.take(key_bytes));
      const Address child = file.address(bytes);
      if (entries.level == 0) {
        SYMRIG_CHECK(visit(key, child));
      } else {
        open.push_back({child, entries.level - 1});
      }
    }
  }
  return {};
}

namespace {

constexpr std::string_view kNewTree = "B-tree";
constexpr std::uint64_t kNodeHead = 6, kNodeEnd = 4;

/// Bytes for numbers up to `most`.
std::uint64_t width_of(std::uint64_t most) {
  return (static_cast<std::uint64_t>(std::bit_width(most)) + 7) / 8;
}

class NewTree {
 public:
  NewTree(const FileBytes& file, unsigned kind, const VisitRecord& visit)
      : file_(file), kind_(kind), visit_(visit), budget_(file) {}

  Result<void> walk(Address header) {
    SYMRIG_TRY(const auto head,
               file_.read_checked(kNewTree, header,
                                  22U + file_.superblock().address_bytes + file_.superblock().length_bytes));
    Bytes bytes(head);
    if (!bytes.signature("BTHD") || bytes.byte() != 0 || bytes.byte() != kind_)
      return damaged_at(kNewTree, header, "is none of its kind");
    node_bytes_ = bytes.number(4);
    record_bytes_ = bytes.number(2);
    const auto depth = static_cast<unsigned>(bytes.number(2));
    bytes.skip(2);
    Node root{file_.address(bytes), 0, depth};
    root.records = bytes.number(2);
    if (record_bytes_ == 0 || node_bytes_ < kNodeHead + kNodeEnd + record_bytes_ || !find_widths(depth))
      return damaged_at(kNewTree, header, "has impossible sizes");
    if (root.at == kUndefined || root.records == 0) return {};
    std::vector<Node> open{root};
    while (!open.empty()) {
      const Node node = open.back();
      open.pop_back();
      SYMRIG_CHECK(visit_node(node, open));
    }
    return {};
  }

 private:
  struct Node {
    Address at;
    std::uint64_t records;
    unsigned level;  ///< 0: a leaf
  };

  /// How many bytes the numbers of children take at each level. They follow from how many records fit.
  bool find_widths(unsigned depth) {
    constexpr unsigned kMostDepth = 32;
    if (depth > kMostDepth) return false;
    const std::uint64_t room = node_bytes_ - kNodeHead - kNodeEnd;
    std::uint64_t most = room / record_bytes_, below = most;
    count_width_ = width_of(most);
    total_width_.assign(1, 0);
    for (unsigned level = 1; level <= depth; ++level) {
      const std::uint64_t pointer = pointer_bytes(level);
      if (room < pointer + record_bytes_) return false;
      most = (room - pointer) / (record_bytes_ + pointer);
      if (__builtin_mul_overflow(most + 1, below, &below) || __builtin_add_overflow(below, most, &below))
        return false;
      total_width_.push_back(width_of(below));
    }
    return true;
  }
  /// Of a child in a node of this level.
  std::uint64_t pointer_bytes(unsigned level) const {
    return file_.superblock().address_bytes + count_width_ + total_width_[level - 1];
  }

  Result<void> visit_node(const Node& node, std::vector<Node>& open) {
    const std::uint64_t pointers = node.level == 0 ? 0 : (node.records + 1) * pointer_bytes(node.level);
    const std::uint64_t used = kNodeHead + node.records * record_bytes_ + pointers + kNodeEnd;
    if (used > node_bytes_) return damaged_at(kNewTree, node.at, "has too many records");
    SYMRIG_CHECK(budget_.take(kNewTree, node.at, used));
    SYMRIG_TRY(const auto content, file_.read_checked(kNewTree, node.at, used));
    Bytes bytes(content);
    if (!bytes.signature(node.level == 0 ? "BTLF" : "BTIN") || bytes.byte() != 0 || bytes.byte() != kind_)
      return damaged_at(kNewTree, node.at, "has a node of another kind");
    for (std::uint64_t k = 0; k < node.records; ++k) SYMRIG_CHECK(visit_(Bytes(bytes.take(record_bytes_))));
    if (node.level == 0) return {};
    for (std::uint64_t k = 0; k <= node.records; ++k) {
      Node child{file_.address(bytes), 0, node.level - 1};
      child.records = bytes.number(count_width_);
      bytes.skip(total_width_[node.level - 1]);
      open.push_back(child);
    }
    return {};
  }

  const FileBytes& file_;
  unsigned kind_;
  const VisitRecord& visit_;
  NodeBudget budget_;
  std::uint64_t node_bytes_ = 0, record_bytes_ = 0, count_width_ = 0;
  std::vector<std::uint64_t> total_width_;  // of each level's children
};

}  // namespace

Result<void> walk_new_tree(const FileBytes& file, Address header, unsigned kind, const VisitRecord& visit) {
  return NewTree(file, kind, visit).walk(header);
}

}  // namespace symrig::tensor::h5
