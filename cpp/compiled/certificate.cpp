// SPDX-License-Identifier: Apache-2.0
#include "palpate/stability/detail/certificate.hpp"
#include "palpate/stability/detail/account_certificate.hpp"
#include "palpate/stability/detail/certificate_check.hpp"
