# SPDX-License-Identifier: Apache-2.0
"""Command line: `palpate VERB ...`, one file per verb."""
