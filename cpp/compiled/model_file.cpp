// SPDX-License-Identifier: Apache-2.0
#include "palpate/io/detail/model_file.hpp"
