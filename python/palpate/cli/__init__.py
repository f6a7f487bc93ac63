# SPDX-License-Identifier: Apache-2.0
"""The command line: `palpate VERB ...`, one file per verb."""
