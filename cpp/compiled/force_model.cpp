// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/detail/force_model.hpp"

#include "palpate/model/detail/energy.hpp"
