// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/detail/radial_bounds.hpp"
