# SPDX-License-Identifier: Apache-2.0
"""`python -m palpate` is `palpate`."""

import sys

from .cli.main import main

sys.exit(main())
