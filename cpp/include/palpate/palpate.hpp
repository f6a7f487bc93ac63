// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Everything that needs no third-party library.

#include "palpate/controller.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/hand.hpp"
#include "palpate/device/simulated.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/dynamics/filters.hpp"
#include "palpate/dynamics/transfer_function.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/network.hpp"
#include "palpate/model/radial_network.hpp"
#include "palpate/model/wavelet.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/status.hpp"
