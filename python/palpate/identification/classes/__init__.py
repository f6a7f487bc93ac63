# SPDX-License-Identifier: Apache-2.0
"""Model classes and the selection among them."""
