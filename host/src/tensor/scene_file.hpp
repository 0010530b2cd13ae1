// SPDX-License-Identifier: Apache-2.0
// Shared by writing and reading of scene.h5.
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/h5_file.hpp"
#include "tensor/h5_write.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace symrig::tensor {

constexpr std::int32_t kVersionMajor = 2;  ///< version 1 can also be read
constexpr std::int32_t kVersionMinor = 1;

/// Writes the tree of one side ("camera" or "projector"): dataset <side>_order, and for a grid of several
/// views the attributes <side>_views, <side>_split and, unless flat, the dataset <side>_boundaries.
bool write_tree(hid_t file, const std::string& side, const BlockTree& tree);

/// The inverse of write_tree(). Without <side>_split the tree is the flat tree of one view.
/// fails: bad_format (missing, damaged, or not a tree).
Result<BlockTree> read_tree(const h5::Object& file, const std::string& side, Grid grid);

// Which values a file may contain.

/// Radiances and entries of T stay below this, so that no sum over a picture overflows a float.
constexpr float kLargest = 0x1p60F;
/// The limit for the values of a pattern.
constexpr float kBrightest = 0x1p30F;

/// A part of a file is missing or does not fit the others. Without a hint: h5::read_file() adds it.
Error damaged(const std::string& what);
/// A value that no camera and no scene gives. what: names it.
Error impossible(const std::string& what);
bool all_finite(std::span<const float> values);
/// Checks that every value is finite and |value| < `most`, a power of two. fails: bad_value (the message
/// names `what`).
Result<void> check_values(std::span<const float> values, const std::string& what, float most);

// Reads the tensor of a scene.h5. Every value is checked before it is used.

using h5::Object;

/// The root attributes.
struct Head {
  std::int32_t version;  ///< 1 or 2
  bool symmetric;
  int channels;
  Grid camera, projector;
  bool may_have_camera;  ///< since version 2.1; in older files the name is free
};

/// An attribute that counts the groups "0", "1", … of the group `groups`. fails: bad_format (negative, or
/// there is one more).
Result<std::int32_t> read_count(const Object& file, const char* attribute, const std::string& groups);

/// The group `camera`: T on the camera's own pixels.
bool write_camera(hid_t file, const CameraTransport& camera, const Work& work);
/// Whether the file has it.
Result<bool> has_camera(const Object& file, const Head& head);
/// The inverse. nullptr: the file has no such group. cells: the tree of the projector.
/// fails: bad_format, bad_value.
Result<std::shared_ptr<const CameraTransport>> read_camera(const Object& file, const Head& head,
                                                           const BlockTree& cells);

/// Where the factors of leaves are kept.
struct KeepLeaves {
  std::int64_t bytes;          ///< more than that stay in the file
  std::filesystem::path path;  ///< of the file, for messages
};

/// Reads every part of T into the builder. fails: bad_format, bad_value.
Result<void> read_tensor(const Object& file, const Head& head, const BlockTree& camera,
                         const BlockTree& projector, const KeepLeaves& keep, TensorBuilder& builder);

}  // namespace symrig::tensor
