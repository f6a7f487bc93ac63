// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/detail/make_structure.hpp"
