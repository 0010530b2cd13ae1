// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/old_trees.hpp"

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
                          Budget& budget) {
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
  Budget budget(file);
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

}  // namespace symrig::tensor::h5
