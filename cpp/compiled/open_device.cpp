// SPDX-License-Identifier: Apache-2.0
#include "palpate/simulation/detail/open_device.hpp"
