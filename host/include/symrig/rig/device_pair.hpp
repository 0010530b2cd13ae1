// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/view_layout.hpp"
#include "symrig/rig/devices.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/pair_server.hpp"

#include <cstddef>
#include <memory>

namespace symrig {

/// A camera and a projector of this computer, for a host whose board fires them (docs/pair-protocol.md).
/// devices: its camera and its projector; the board is the host's. They are opened when a host comes, and
/// opened again after one was lost. pair: its place in the layout, from 0.
std::unique_ptr<PairService> serve_devices(RigDevices devices, ViewLayout layout, std::size_t pair);

/// The camera and the projector of such a pair, as devices of the host. They share a connection, which is
/// made when they are opened, and again after it was lost. Frames have no stamps: the two computers share no
/// clock. So the ledger trusts their numbers and contents only (docs/ledger.md). The openers fail as
/// PairLink::open, and with bad_argument (another place, layout or kind of pair), size_mismatch (other cells
/// than `cells`).
RigDevices linked_devices(PairAddress address, ViewLayout layout, std::size_t pair, Grid cells,
                          PairLink::KeepWaiting keep_waiting);

}  // namespace symrig
