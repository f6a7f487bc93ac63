// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/detail/validate.hpp"
#include "palpate/model/detail/validate.hpp"
#include "palpate/rendering/detail/validate.hpp"
