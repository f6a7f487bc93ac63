// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Includes all headers of palpate that need no third-party library; those of live control only on Linux.

#include "palpate/device/mit_wire.hpp"
#include "palpate/device/moteus_wire.hpp"
#include "palpate/device/packet_stream.hpp"
#include "palpate/device/pid_reports.hpp"
#include "palpate/dynamics/filters.hpp"
#include "palpate/fields/escaped.hpp"
#include "palpate/portable/export_check.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/force_error.hpp"
#include "palpate/simulation/press.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "palpate/stability/renderable_slopes.hpp"
#include "palpate/version.hpp"

// Live control needs the clock and the scheduler of Linux; all other headers work on every system.
#ifdef __linux__
#include "palpate/realtime/wake_up.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/transports.hpp"
#endif
