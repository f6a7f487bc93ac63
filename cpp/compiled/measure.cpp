// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/detail/measure.hpp"
