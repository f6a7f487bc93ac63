# SPDX-License-Identifier: Apache-2.0
"""Writes the model of the knob of `palpate demo`, without its renderings and figures.

python docs/builder/knob.py MODEL.json
"""

import sys
from pathlib import Path

import palpate
from palpate.cli.demo import IDENTIFY_SEED
from palpate.recording.sample import sample_recording

if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.parent.mkdir(exist_ok=True)
    palpate.identify(sample_recording(IDENTIFY_SEED)).save(path)
