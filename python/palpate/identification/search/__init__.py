# SPDX-License-Identifier: Apache-2.0
"""Growth of a network: selection, stopping and evidence."""
