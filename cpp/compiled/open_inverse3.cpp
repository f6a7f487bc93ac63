// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/detail/open_inverse3.hpp"
