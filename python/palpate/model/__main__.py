# SPDX-License-Identifier: Apache-2.0
"""``python -m palpate.model`` prints the JSON schema of the model file."""

import json

from .schema import json_schema

print(json.dumps(json_schema(), indent=2))
